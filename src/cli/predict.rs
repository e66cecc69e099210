//! `metrolux predict`: how long a render will take to an error, or how far it gets in a time.

use super::CliError;
use super::bar::Bar;
use super::engine::{self, Prepared};
use super::parse::{duration, positive};
use super::study::parse;
use super::study_run::base;
use crate::integrator::{Progress, Quiet};
use crate::scene::IntegratorKind;
use crate::study::fit::Pace;
use crate::study::interval::Interval;
use crate::study::predict::{CONFIDENCE, Forecast, Pilot, forecast};
use crate::study::words::{bounds, digits, percent, time};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Tell how long `render --target-error` will take, or what error `render --time-limit` will reach.
///
/// Renders a few short pilots, each with a seed of its own, and states the expected time with the interval in which it lies
/// with 90 %. What pilots do is counted in rounds, so the rounds told do not depend on the machine. Options after `--` go to
/// the render: metrolux predict SCENE --target-error 0.02 -- --integrator bdpt
#[derive(Args, Debug)]
#[command(group = clap::ArgGroup::new("what").required(true))]
pub struct PredictArgs {
    /// pbrt-v4 scene file
    pub scene: PathBuf,
    /// Relative error to reach: 0.02 for 2 %
    #[arg(long, value_name = "E", value_parser = positive, group = "what")]
    pub target_error: Option<f64>,
    /// Time the render would be given: 30s, 10m, 2h
    #[arg(long, value_name = "TIME", value_parser = duration, group = "what")]
    pub time_limit: Option<Duration>,
    /// Pilots to render, at least three
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u64).range(3..=100))]
    pub pilots: u64,
    /// Seed of the render; pilots have others
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print one JSON object instead of sentences
    #[arg(long)]
    pub json: bool,
    /// No progress, no messages but errors
    #[arg(short, long)]
    pub quiet: bool,
    /// Options of `metrolux render`
    #[arg(last = true, value_name = "RENDER OPTIONS")]
    pub render: Vec<String>,
}

/// Work of a pilot: mutations a pixel, samples a pixel. The error of fewer than 32 samples a pixel is told as if they were
/// not stratified, so that a quarter of a pilot must not have fewer.
const MUTATIONS: f64 = 16.0;
const SAMPLES: u64 = 128;

/// What is printed as JSON.
#[derive(Serialize)]
struct Told {
    integrator: String,
    rounds: Interval,
    seconds: Interval,
    error: Interval,
    confidence: f64,
    pilots: usize,
    pilot_rounds: u64,
    pilot_seconds: f64,
}

/// Runs the sub-command.
pub fn run(args: &PredictArgs) -> Result<ExitCode, CliError> {
    let prepared = base(&args.scene, &args.render)?;
    let chains = prepared.job.integrator == IntegratorKind::Mlt;
    let [x0, y0, x1, y1] = prepared.scene.camera.crop;
    let pixels = (x1 - x0) as u64 * (y1 - y0) as u64;
    let options = crate::chain::MltOptions::default();
    let rounds = if chains {
        options
            .rounds_for(MUTATIONS, pixels)
            .next_power_of_two()
            .max(4)
    } else {
        SAMPLES
    };
    let bar = Bar::new("predicting", args.quiet);
    let (mut pilots, mut times) = (Vec::new(), Vec::new());
    for i in 0..args.pilots {
        for (k, rounds) in [rounds / 4, rounds].into_iter().enumerate() {
            // Far from the seeds that people choose.
            let seed = (args.seed ^ 0x9e37_79b9_0000_0000).wrapping_add(2 * i + k as u64);
            let (pilot, seconds) = render(args, rounds, seed)?;
            pilots.push(pilot);
            times.push((rounds as f64, seconds));
        }
        bar.update((i + 1) as f64 / args.pilots as f64);
    }
    bar.finish();
    let Some(forecast) = forecast(&pilots) else {
        let text = "the pilots found no light, so nothing can be predicted: expected more by --pilots, or a scene that is lit";
        return Err(CliError::Usage(text.into()));
    };
    // The first render of a process finds cold caches.
    let clock = Clock {
        pace: Pace::of(&times[2.min(times.len())..]),
        generation: chains.then_some(options.rounds_per_generation),
    };
    let told = conclude(args, &prepared, &forecast, &clock, chains);
    let told = Told {
        pilot_rounds: rounds,
        pilot_seconds: times.iter().map(|t| t.1).sum(),
        ..told
    };
    if args.json {
        println!(
            "{}",
            serde_json::to_string(&told).map_err(|e| CliError::Internal(e.to_string()))?
        );
    } else {
        print(args, &told, chains);
    }
    Ok(ExitCode::SUCCESS)
}

/// Rounds to seconds, with a new seeding for each generation.
struct Clock {
    pace: Pace,
    generation: Option<u32>,
}

impl Clock {
    fn seconds(&self, rounds: f64) -> f64 {
        let starts = self
            .generation
            .map_or(1.0, |g| (rounds / f64::from(g)).ceil().max(1.0));
        self.pace.start * starts + self.pace.each * rounds
    }

    fn rounds(&self, seconds: f64) -> f64 {
        let once = self.pace.work(seconds);
        let again = self
            .generation
            .map_or(0.0, |g| self.pace.start / f64::from(g));
        // Starts of further generations come off what one start leaves.
        (once * self.pace.each / (self.pace.each + again))
            .max(1.0)
            .floor()
    }
}

fn conclude(
    args: &PredictArgs,
    prepared: &Prepared,
    forecast: &Forecast,
    clock: &Clock,
    chains: bool,
) -> Told {
    let (rounds, error) = match (args.target_error, args.time_limit) {
        (Some(target), _) => {
            let rounds = forecast.rounds_for(
                target,
                if chains {
                    1
                } else {
                    crate::integrator::FIRST_LOOK
                },
            );
            (rounds, forecast.error_after(rounds.value))
        }
        (_, limit) => {
            let rounds = clock.rounds(limit.unwrap_or_default().as_secs_f64());
            (Interval::exact(rounds), forecast.error_after(rounds))
        }
    };
    Told {
        integrator: format!("{:?}", prepared.job.integrator).to_lowercase(),
        rounds,
        seconds: rounds.map(|r| clock.seconds(r)),
        error,
        confidence: CONFIDENCE,
        pilots: forecast.pilots,
        pilot_rounds: 0,
        pilot_seconds: 0.0,
    }
}

fn print(args: &PredictArgs, t: &Told, chains: bool) {
    let what = if chains { "rounds" } else { "samples a pixel" };
    let whole = |v: f64| format!("{v:.0}");
    match args.target_error {
        Some(target) => println!(
            "{} to an error of {} with {}, after {} {what}; expected error there {}",
            bounds(t.seconds, time),
            percent(target),
            t.integrator,
            bounds(t.rounds, whole),
            percent(t.error.value)
        ),
        None => println!(
            "error {} after {} with {}, {} {what}",
            bounds(t.error, percent),
            time(t.seconds.value),
            t.integrator,
            digits(t.rounds.value)
        ),
    }
    if !args.quiet {
        eprintln!(
            "{} pilots of {} and {} {what}, {}; the interval holds with {:.0} %",
            t.pilots,
            t.pilot_rounds / 4,
            t.pilot_rounds,
            time(t.pilot_seconds),
            100.0 * t.confidence
        );
    }
}

/// A pilot with its wall time.
fn render(args: &PredictArgs, rounds: u64, seed: u64) -> Result<(Pilot, f64), CliError> {
    let mut words = vec![args.scene.display().to_string()];
    words.extend(args.render.iter().cloned());
    for (name, value) in [("--rounds", rounds), ("--seed", seed)] {
        words.extend([name.to_owned(), value.to_string()]);
    }
    let parsed = parse(&words)?;
    let prepared = Prepared::new(&parsed)?;
    let rendered = engine::render(&parsed, &prepared, &Quiet)?;
    let report =
        serde_json::to_value(&rendered.report).map_err(|e| CliError::Internal(e.to_string()))?;
    let number = |at: &str| report.pointer(at).and_then(serde_json::Value::as_f64);
    let error = number("/error/relative").unwrap_or(f64::NAN);
    Ok((
        Pilot { rounds, error },
        number("/wall_seconds").unwrap_or(0.0).max(1e-6),
    ))
}
