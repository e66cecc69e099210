//! `metrolux study`: what accuracy costs in time, as a page.

use super::CliError;
use super::bar::Bar;
use super::outlet::{print, tell};
use super::parse::{duration, positive_count};
use super::render_args::{self, RenderArgs};
use super::signals::Signals;
use super::study_run::{Runner, base, shares};
use crate::scene::IntegratorKind;
use crate::study::axes::{Axis, AxisName, Ground, axis};
use crate::study::page::{Study, write};
use crate::study::record::{Clock, Store};
use crate::study::schedule::{Cost, Schedule, schedule};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Show what accuracy costs in time: error against time for integrators, mutations, refinements, backends …
///
/// Renders the scene with each setting at doubling budgets and several seeds, holds every image against a reference, and
/// writes DIR/index.html, study.json and study.csv. Says beforehand what it will do and how long that takes. A point that
/// is done lies in DIR/points and is not rendered again: an interrupted study goes on where it stopped, and a longer one
/// uses what a shorter one found. Options after `--` go to every render: metrolux study SCENE -o DIR -- --resolution 128x128
#[derive(Args, Debug)]
pub struct StudyArgs {
    /// pbrt-v4 scene file
    pub scene: PathBuf,
    /// Folder to write to
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// The truth, as an image; if its pixels' standard errors are in a channel `error`, they are allowed for
    #[arg(long, value_name = "REF.exr", conflicts_with = "reference_time")]
    pub reference: Option<PathBuf>,
    /// Render the reference for this long; two fifths of the budget unless given
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub reference_time: Option<Duration>,
    /// Integrator of the reference; auto takes mlt where the scene has specular surfaces, else what a pilot finds better
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = ["auto", "mlt", "bdpt", "pt"])]
    pub reference_integrator: String,
    /// Time for everything, the reference included; with --clock cpu it is counted by that clock
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "60s")]
    pub budget: Duration,
    /// Images of every setting and budget, each with a seed of its own
    #[arg(long, value_name = "R", value_parser = positive_count, default_value = "4")]
    pub repeat: usize,
    /// What to vary; may be given several times. As much as the budget allows unless given, integrators first
    #[arg(long, value_enum, value_name = "NAME")]
    pub axis: Vec<AxisName>,
    /// What time is measured by
    #[arg(long, value_enum, default_value = "wall")]
    pub clock: Clock,
    /// Say what would be done, and stop
    #[arg(long)]
    pub dry_run: bool,
    /// No progress, no messages but errors
    #[arg(short, long)]
    pub quiet: bool,
    /// Options of `metrolux render` for every image
    #[arg(last = true, value_name = "RENDER OPTIONS")]
    pub render: Vec<String>,
}

/// Seconds a point should last at least at its highest budget, for an axis to be taken in by default.
const WORTH_WHILE: f64 = 0.4;
/// Part of the budget for the reference where no time is given for it.
const REFERENCE_PART: f64 = 0.4;
/// What is kept free of the budget: clocks and guesses err, and the page takes its time.
const RESERVE: f64 = 0.1;

/// What will be rendered.
pub struct Plan {
    /// Axes with their settings.
    pub axes: Vec<Axis>,
    /// Options of each different setting.
    pub settings: Vec<Vec<String>>,
    /// Rounds.
    pub schedule: Schedule,
    /// What each setting costs.
    pub costs: Vec<Cost>,
    /// Axes there was no time for.
    pub left_out: Vec<AxisName>,
}

/// Runs the sub-command.
pub fn run(args: &StudyArgs) -> Result<ExitCode, CliError> {
    let start = Instant::now();
    let store = Store::open(&args.output)?;
    let prepared = base(&args.scene, &args.render, "study")?;
    let kinds = prepared.job.integrator;
    let ground = Ground {
        integrator: match kinds {
            IntegratorKind::Mlt => "mlt",
            IntegratorKind::Bdpt => "bdpt",
            IntegratorKind::Pt => "pt",
        },
        shares: shares(&args.scene, &args.render, &prepared)?,
        max_depth: prepared.scene.settings.max_depth,
        lanes: prepared.job.plan.lanes,
    };
    if !args.quiet {
        let warnings = &prepared.scene.warnings;
        warnings
            .iter()
            .for_each(|w| tell(format_args!("warning: {w}")));
    }
    let signals = Signals::catch()?;
    let mut runner = Runner::new(args, &store, &prepared, (start, &signals));
    let given = match (&args.reference, args.reference_time) {
        (Some(_), _) => 0.0,
        (_, Some(t)) => t.as_secs_f64(),
        _ => REFERENCE_PART * args.budget.as_secs_f64(),
    };
    // A reference whose time is given comes on top of nothing: the budget is for everything.
    let plan = make_plan(args, &ground, &mut runner, given)?;
    if !args.quiet || args.dry_run {
        announce(args, &plan, given, start.elapsed());
    }
    if args.dry_run {
        return Ok(ExitCode::SUCCESS);
    }
    let bar = Bar::new("studying", args.quiet);
    let reference = runner.reference(&prepared, given, &bar)?;
    let mut study = Study::new(
        args.clock,
        &plan.axes,
        &plan.settings,
        reference,
        runner.facts(&prepared),
    );
    let done = runner.points(&plan, &mut study, &bar, |study| write(study, &store));
    bar.finish();
    let done = done?;
    write(&study, &store)?;
    if done.left_out > 0 {
        tell(format_args!(
            "warning: {} images were left out to stay within the budget: this was slower than the pilots; the same command \
             goes on",
            done.left_out
        ));
    }
    if let Some(line) = study.doubt() {
        tell(format_args!("warning: {line}"));
    }
    print(crate::study::words::report(&study).trim_end_matches('\n'))?;
    if !args.quiet {
        let page = store.file("index.html");
        tell(format_args!(
            "{} after {:.0} s",
            page.display(),
            start.elapsed().as_secs_f64()
        ));
    }
    Ok(if done.stopped {
        ExitCode::from(75)
    } else {
        ExitCode::SUCCESS
    })
}

/// Takes in as many axes as there is time for, or those asked for.
fn make_plan(
    args: &StudyArgs,
    ground: &Ground,
    runner: &mut Runner,
    reference: f64,
) -> Result<Plan, CliError> {
    let chosen = !args.axis.is_empty();
    let names = if chosen {
        &args.axis[..]
    } else {
        &AxisName::ALL[..]
    };
    let budget = args.budget.as_secs_f64();
    let mut found: Option<Plan> = None;
    let (mut axes, mut settings, mut costs) =
        (Vec::new(), Vec::<Vec<String>>::new(), Vec::<Cost>::new());
    let mut left_out = Vec::new();
    let mut spent = 0.0;
    for name in names {
        let Some(axis) = axis(*name, ground) else {
            if chosen {
                let text = format!("--axis {}: nothing to vary in this scene", name.name());
                return Err(CliError::Usage(text));
            }
            continue;
        };
        if !left_out.is_empty() || axes.iter().any(|a: &Axis| a.name == *name) {
            left_out.extend((!chosen).then_some(*name));
            continue;
        }
        let (before, known) = (axes.clone(), settings.len());
        for s in &axis.settings {
            if !settings.contains(&s.args) {
                settings.push(s.args.clone());
                let (cost, took) = runner.cost(&s.args)?;
                costs.push(cost);
                spent += took;
            }
        }
        axes.push(axis);
        let left = (budget * (1.0 - RESERVE) - reference - spent).max(0.0);
        let found_now = schedule(&costs, args.repeat, left);
        let worth = |s: &Schedule| chosen || found.is_none() || s.longest >= WORTH_WHILE;
        match found_now.filter(worth) {
            Some(schedule) => {
                let left_out = Vec::new();
                let (axes, settings) = (axes.clone(), settings.clone());
                found = Some(Plan {
                    axes,
                    settings,
                    schedule,
                    costs: Vec::new(),
                    left_out,
                });
            }
            None if chosen || found.is_none() => {
                let enough = |s: &f64| schedule(&costs, args.repeat, *s).is_some();
                let least = (0..200)
                    .map(|k| 1.1f64.powi(k))
                    .find(enough)
                    .unwrap_or(f64::INFINITY);
                // Without a time of its own the reference takes its part of a longer budget too.
                let part = if reference > 0.0 && args.reference_time.is_none() {
                    REFERENCE_PART
                } else {
                    0.0
                };
                let given = if part > 0.0 { 0.0 } else { reference };
                let need = (least + given + spent) / (1.0 - RESERVE - part);
                return Err(CliError::Usage(format!(
                    "--budget {budget:.0}s is too short for {} settings with {} repeats: expected at least about {:.0}s \
                     (or fewer --repeat, or -- --resolution for smaller images)",
                    settings.len(),
                    args.repeat,
                    need.ceil()
                )));
            }
            None => {
                axes = before;
                settings.truncate(known);
                costs.truncate(known);
                left_out.push(*name);
            }
        }
    }
    let mut plan = found.ok_or_else(|| CliError::Usage("nothing to vary".into()))?;
    plan.costs.clone_from(&costs);
    // Pilots of axes that were left out have cost time too.
    let left = (budget * (1.0 - RESERVE) - reference - spent).max(0.0);
    if let Some(s) = schedule(&costs, args.repeat, left) {
        plan.schedule = s;
    }
    plan.left_out = left_out;
    Ok(plan)
}

/// What will be done and how long it takes.
fn announce(args: &StudyArgs, plan: &Plan, reference: f64, spent: Duration) {
    let s = &plan.schedule;
    for a in &plan.axes {
        let names: Vec<&str> = a.settings.iter().map(|s| s.name.as_str()).collect();
        tell(format_args!("{:<12} {}", a.name.name(), names.join(", ")));
    }
    match &args.reference {
        Some(file) => tell(format_args!("reference    {}", file.display())),
        None => tell(format_args!("reference    {reference:.1} s in four parts")),
    }
    let total = spent.as_secs_f64() + reference + s.seconds;
    tell(format_args!(
        "{} settings, {} images of up to {:.2} s; about {total:.0} s of the {:.0} s allowed",
        plan.settings.len(),
        s.images(),
        s.longest,
        args.budget.as_secs_f64()
    ));
    if !plan.left_out.is_empty() {
        let names: Vec<&str> = plan.left_out.iter().map(|n| n.name()).collect();
        tell(format_args!(
            "no time for {}: name them by --axis, or allow more by --budget",
            names.join(", ")
        ));
    }
}

/// The arguments of a render as clap reads them.
pub fn parse(words: &[String]) -> Result<RenderArgs, CliError> {
    render_args::parse(words)
        .map_err(|e| CliError::Usage(e.to_string().trim_start_matches("error: ").to_owned()))
}
