//! Renders the points of a study in process, each from the very words of its command line.

use super::CliError;
use super::bar::Bar;
use super::compare::fit as fit_reference;
use super::engine::{self, Prepared};
use super::signals::Signals;
use super::study::{Plan, StudyArgs, parse};
use super::while_running;
use crate::integrator::{Progress, Quiet};
use crate::mutation::Strategy;
use crate::output::{Image, check_writable, read_windowed};
use crate::plan::Shares;
use crate::scene::IntegratorKind;
use crate::study::axes::joined;
use crate::study::fit::Pace;
use crate::study::page::{Facts, Study};
use crate::study::record::{Clock, Point, Store};
use crate::study::reference::{Reference, stated_errors};
use crate::study::schedule::{Cost, LEVELS, even, seed};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

/// Parts of a reference: their spread tells its noise, with three degrees of freedom.
const PARTS: usize = 4;
/// The page is written at most this often.
const REFRESH: Duration = Duration::from_secs(10);
/// A pilot goes on until it has lasted so long.
const PILOT: f64 = 0.1;

/// The scene with the options that every image shares.
pub fn base(scene: &Path, shared: &[String], command: &str) -> Result<Prepared, CliError> {
    let words = words(scene, shared);
    let args = parse(&words)?;
    let set = [
        ("--output", !args.output.is_empty()),
        ("--rounds", args.rounds.is_some()),
        ("--mutations", args.mutations.is_some()),
        ("--spp", args.spp.is_some()),
        ("--time-limit", args.time_limit.is_some()),
        ("--target-error", args.target_error.is_some()),
        ("--seed", shared.iter().any(|a| a.starts_with("--seed"))),
    ];
    if let Some((name, _)) = set.iter().find(|(_, given)| *given) {
        let text = format!("{name} after -- : each image of a study has its own");
        return Err(CliError::Usage(text));
    }
    while_running::refuse(&args, command)?;
    let prepared = Prepared::new(&args)?;
    if prepared.job.is_dark() {
        let text =
            format!("{command}: errors are relative to the image: found a scene without light");
        return Err(CliError::Usage(text));
    }
    Ok(prepared)
}

/// The shares that the render with these words has.
///
/// # Errors
/// A backend that refuses, threads that cannot be started.
pub fn shares(scene: &Path, shared: &[String], prepared: &Prepared) -> Result<Shares, CliError> {
    match prepared.job.integrator {
        IntegratorKind::Mlt => Ok(engine::decide(&parse(&words(scene, shared))?, prepared)?.shares),
        IntegratorKind::Pt | IntegratorKind::Bdpt => Ok(prepared.job.plan.shares),
    }
}

fn words(scene: &Path, more: &[String]) -> Vec<String> {
    let mut all = vec![scene.display().to_string()];
    all.extend(more.iter().cloned());
    all
}

/// Paces found by pilots, kept so that a study that goes on asks for the same rounds.
#[derive(Default, Serialize, Deserialize)]
struct Pilots {
    scene_hash: String,
    found: BTreeMap<String, Pilot>,
}

/// What the pilots of a setting told.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct Pilot {
    pace: Pace,
    around: f64,
    /// Seconds that the pilots took.
    took: f64,
    /// Squared relative error of one round by its own account, if it could be told.
    square: Option<f64>,
}

/// Renders for a study.
pub struct Runner<'a> {
    args: &'a StudyArgs,
    store: &'a Store,
    scene_hash: String,
    pilots: Pilots,
    begun: Instant,
    signals: &'a Signals,
}

impl<'a> Runner<'a> {
    /// For the scene as prepared.
    pub fn new(
        args: &'a StudyArgs,
        store: &'a Store,
        prepared: &Prepared,
        (begun, signals): (Instant, &'a Signals),
    ) -> Self {
        let scene_hash = format!("{:016x}", prepared.scene.hash);
        let pilots: Pilots = store.read_json("pilots.json").unwrap_or_default();
        let fits = |p: &Pilots| p.scene_hash == scene_hash;
        let pilots = Some(pilots).filter(fits).unwrap_or_default();
        Self {
            args,
            store,
            scene_hash,
            pilots,
            begun,
            signals,
        }
    }

    fn command(&self, setting: &[String], rounds: u64, seed: u64) -> Vec<String> {
        let mut all = words(&self.args.scene, &joined(&self.args.render, setting));
        for (name, value) in [("--rounds", rounds), ("--seed", seed)] {
            all.extend([name.to_owned(), value.to_string()]);
        }
        all
    }

    /// What a setting costs, from renders of one round and of a few, and the seconds that these took: when they were
    /// made, so that a study that goes on plans what it did at first.
    pub fn cost(&mut self, setting: &[String]) -> Result<(Cost, f64), CliError> {
        let Pilot {
            pace, around, took, ..
        } = self.pilot(setting)?;
        Ok((Cost { pace, around }, took))
    }

    fn pilot(&mut self, setting: &[String]) -> Result<Pilot, CliError> {
        let key = joined(&self.args.render, setting).join(" ");
        if let Some(pilot) = self.pilots.found.get(&key) {
            return Ok(*pilot);
        }
        let start = Instant::now();
        let mut square = None;
        let mut times = Vec::new();
        let mut around = 0.0f64;
        while let Some(rounds) = Pace::next_pilot(&times, PILOT) {
            let rounds = even(rounds);
            let begin = Instant::now();
            let command = self.command(setting, rounds, 1);
            let (point, _) = self.render(&command, rounds, 1, 0, None, &Quiet)?;
            let seconds = point.seconds(self.args.clock).max(1e-6);
            times.push((rounds as f64, seconds));
            square = point.claimed.map(|e| e * e * rounds as f64).or(square);
            around = around.max(begin.elapsed().as_secs_f64() - point.wall_seconds);
        }
        let pace = Pace::of(&times);
        self.pilots.scene_hash.clone_from(&self.scene_hash);
        let pilot = Pilot {
            pace,
            around,
            square,
            took: start.elapsed().as_secs_f64(),
        };
        self.pilots.found.insert(key, pilot);
        self.store
            .write_json(&self.store.file("pilots.json"), &self.pilots)?;
        Ok(pilot)
    }

    /// Where specular surfaces may hide light from a short pilot, chains are trusted to find it; else the less noisy of two
    /// unbiased integrators by their pilots.
    fn reference_integrator(&mut self, prepared: &Prepared) -> Result<String, CliError> {
        if self.args.reference_integrator != "auto" {
            return Ok(self.args.reference_integrator.clone());
        }
        if prepared.job.plan.shares.0[Strategy::Caustic as usize] > 0.0 {
            return Ok("mlt".into());
        }
        let mut price = |name: &str| -> Result<f64, CliError> {
            let pilot = self.pilot(&["--integrator".into(), name.into()])?;
            Ok(pilot.square.map_or(f64::INFINITY, |s| s * pilot.pace.each))
        };
        let (chains, paths) = (price("mlt")?, price("bdpt")?);
        Ok(if paths < chains { "bdpt" } else { "mlt" }.into())
    }

    /// Renders a command and, if `file` is given, keeps the image and the point.
    fn render(
        &self,
        command: &[String],
        rounds: u64,
        seed: u64,
        repeat: usize,
        file: Option<&Path>,
        progress: &dyn Progress,
    ) -> Result<(Point, Image), CliError> {
        let args = parse(command)?;
        let prepared = Prepared::new(&args)?;
        let rendered = engine::render(&args, &prepared, progress)?;
        let told = serde_json::to_value(&rendered.report)
            .map_err(|e| CliError::Internal(e.to_string()))?;
        let number = |at: &str| told.pointer(at).and_then(serde_json::Value::as_f64);
        let point = Point {
            command: command.to_vec(),
            scene_hash: self.scene_hash.clone(),
            rounds,
            seed,
            repeat,
            wall_seconds: number("/wall_seconds").unwrap_or(0.0),
            cpu_seconds: number("/cpu_seconds").unwrap_or(0.0),
            threads: number("/threads").unwrap_or(1.0) as usize,
            claimed: number("/error/relative"),
            faults: rendered.report.faults_impossible(),
        };
        if let Some(file) = file {
            rendered.write(file, 0.0)?;
            self.store.keep(&point)?;
        }
        Ok((point, rendered.image))
    }

    /// The point of a command: from the folder, or rendered now.
    fn point(
        &self,
        setting: &[String],
        rounds: u64,
        seed: u64,
        repeat: usize,
        progress: &dyn Progress,
    ) -> Result<(Point, Image), CliError> {
        let command = self.command(setting, rounds, seed);
        if let Some((mut point, image)) = self.store.find(&command, &self.scene_hash) {
            point.repeat = repeat;
            return Ok((point, image));
        }
        let file = self.store.image_file(&command, &self.scene_hash);
        check_writable(&file)?;
        self.render(&command, rounds, seed, repeat, Some(&file), progress)
    }

    /// The reference: the image given, or parts rendered for `seconds` together.
    pub fn reference(
        &mut self,
        prepared: &Prepared,
        seconds: f64,
        bar: &Bar,
    ) -> Result<Reference, CliError> {
        let [x0, y0, x1, y1] = prepared.scene.camera.crop;
        let (width, height) = ((x1 - x0) as usize, (y1 - y0) as usize);
        if let Some(path) = &self.args.reference {
            let (image, at) = read_windowed(path)?;
            let errors = stated_errors(path, width * height);
            let wanted = crate::output::Window {
                origin: [x0 as i32, y0 as i32],
                full: prepared.scene.camera.resolution.map(|v| v as usize),
            };
            let image = fit_reference([width, height], wanted, &image, at)?;
            return Ok(Reference::of_file(image, errors.as_deref(), path));
        }
        let integrator = self.reference_integrator(prepared)?;
        let setting = ["--integrator".to_owned(), integrator.clone()];
        let (cost, _) = self.cost(&setting)?;
        let rounds = even(cost.pace.work(seconds / PARTS as f64)).max(1);
        let (mut images, mut commands) = (Vec::new(), Vec::new());
        for part in 0..PARTS {
            if self.signals.stop().is_some() {
                let text = "interrupted before the reference was whole; the same command goes on from here";
                return Err(CliError::Stopped(text.into()));
            }
            let nested = Nested {
                bar,
                from: part as f64 / PARTS as f64,
                part: 1.0 / PARTS as f64,
            };
            bar.say("rendering the reference");
            let (point, image) =
                self.point(&setting, rounds, 900_001 + part as u64, part, &nested)?;
            commands.push(point.command);
            images.push(image);
        }
        let origin = format!(
            "{integrator}, {PARTS} independent parts of {rounds} rounds each; its noise: from the spread of the parts"
        );
        Ok(Reference::of_parts(&images, origin, commands))
    }

    /// What the page says of the circumstances.
    pub fn facts(&self, prepared: &Prepared) -> Facts {
        let [x0, y0, x1, y1] = prepared.scene.camera.crop;
        Facts {
            scene: self.args.scene.display().to_string(),
            scene_hash: self.scene_hash.clone(),
            shared: self.args.render.clone(),
            size: [x1 - x0, y1 - y0],
            version: env!("CARGO_PKG_VERSION").into(),
            threads: rayon_threads(prepared.job.threads),
            triangles: prepared.scene.geometry.triangle_count(),
            max_depth: prepared.scene.settings.max_depth,
        }
    }

    /// Renders what the plan says, lowest budgets first, and calls `refresh` now and then. Images that would not end
    /// within the budget are left out.
    pub fn points(
        &self,
        plan: &Plan,
        study: &mut Study,
        bar: &Bar,
        mut refresh: impl FnMut(&Study) -> Result<(), crate::output::ImageError>,
    ) -> Result<Done, CliError> {
        // A level costs twice the one below it.
        let weight = |level: usize| 2f64.powi(level as i32);
        let each = |r: &Vec<Option<u64>>| {
            let levels = r.iter().enumerate().filter(|(_, n)| n.is_some());
            levels.map(|(level, _)| weight(level)).sum::<f64>()
        };
        let total = plan.schedule.rounds.iter().map(each).sum::<f64>() * self.args.repeat as f64;
        let mut ended = Done::default();
        let (mut done, mut written) = (0.0, Instant::now());
        for level in 0..LEVELS {
            for repeat in 0..self.args.repeat {
                for (i, setting) in plan.settings.iter().enumerate() {
                    let Some(rounds) = plan.schedule.rounds[i][level] else {
                        continue;
                    };
                    let seconds = plan.costs[i].pace.seconds(rounds as f64);
                    let late = self.begun.elapsed().as_secs_f64() + seconds;
                    let command = self.command(setting, rounds, seed(rounds, repeat));
                    let kept = self.store.image_file(&command, &self.scene_hash).exists();
                    let watched = self.args.clock == Clock::Wall;
                    if watched && late > self.args.budget.as_secs_f64() && !kept {
                        ended.left_out += 1;
                        continue;
                    }
                    bar.say(&format!(
                        "budget {} of {LEVELS}, repeat {}",
                        level + 1,
                        repeat + 1
                    ));
                    let nested = Nested {
                        bar,
                        from: done / total,
                        part: weight(level) / total,
                    };
                    let (point, image) =
                        self.point(setting, rounds, seed(rounds, repeat), repeat, &nested)?;
                    study.add(i, level, point, &image);
                    done += weight(level);
                    if written.elapsed() > REFRESH {
                        refresh(study)?;
                        written = Instant::now();
                    }
                    if self.signals.stop().is_some() {
                        ended.stopped = true;
                        return Ok(ended);
                    }
                }
            }
        }
        Ok(ended)
    }
}

fn rayon_threads(asked: usize) -> usize {
    if asked > 0 {
        asked
    } else {
        std::thread::available_parallelism().map_or(1, usize::from)
    }
}

/// How the points came to an end.
#[derive(Default)]
pub struct Done {
    /// An interrupt ended them.
    pub stopped: bool,
    /// Images there was no time for.
    pub left_out: usize,
}

/// A render's progress as a part of the study's.
struct Nested<'a> {
    bar: &'a Bar,
    from: f64,
    part: f64,
}

impl Progress for Nested<'_> {
    fn update(&self, done: f64) {
        self.bar.update(self.from + self.part * done);
    }
}
