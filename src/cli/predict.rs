//! `metrolux predict`: how long a render will take to an error, or how far it gets in a time.

use super::CliError;
use super::bar::Bar;
use super::engine::Prepared;
use super::outlet::{print, tell};
use super::parse::{duration, positive};
use super::pilots::{Clock, Pilots, first_look};
use super::study::parse;
use super::study_run::base;
use crate::integrator::Progress;
use crate::scene::IntegratorKind;
use crate::study::interval::Interval;
use crate::study::predict::{CONFIDENCE, Forecast};
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
    let prepared = base(&args.scene, &args.render, "predict")?;
    let chains = prepared.job.integrator == IntegratorKind::Mlt;
    let mut words = vec![args.scene.display().to_string()];
    words.extend(args.render.iter().cloned());
    let mut wanted = parse(&words)?;
    wanted.seed = args.seed;
    let bar = Bar::new("predicting", args.quiet);
    let pilots = Pilots::of(&wanted, args.pilots, &|done| bar.update(done));
    bar.finish();
    let pilots = pilots?;
    let Some(forecast) = pilots.forecast() else {
        let text = "the pilots found no light, so nothing can be predicted: expected more by --pilots, or a scene that is lit";
        return Err(CliError::Usage(text.into()));
    };
    let clock = pilots.clock();
    let told = conclude(args, &prepared, &forecast, &clock, chains);
    let told = Told {
        pilot_rounds: pilots.rounds,
        pilot_seconds: pilots.times.iter().map(|t| t.1).sum(),
        ..told
    };
    if args.json {
        let text = serde_json::to_string(&told);
        print(text.map_err(|e| CliError::Internal(e.to_string()))?)?;
    } else {
        answer(args, &told, chains)?;
    }
    Ok(ExitCode::SUCCESS)
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
            let rounds = forecast.rounds_for(target, first_look(chains));
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

fn answer(args: &PredictArgs, t: &Told, chains: bool) -> Result<(), CliError> {
    let what = if chains { "rounds" } else { "samples a pixel" };
    let whole = |v: f64| format!("{v:.0}");
    match args.target_error {
        Some(target) => print(format_args!(
            "{} to an error of {} with {}, after {} {what}; expected error there {}",
            bounds(t.seconds, time),
            percent(target),
            t.integrator,
            bounds(t.rounds, whole),
            percent(t.error.value)
        ))?,
        None => print(format_args!(
            "error {} after {} with {}, {} {what}",
            bounds(t.error, percent),
            time(t.seconds.value),
            t.integrator,
            digits(t.rounds.value)
        ))?,
    }
    if !args.quiet {
        tell(format_args!(
            "{} pilots of {} and {} {what}, {}; the interval holds with {:.0} %",
            t.pilots,
            t.pilot_rounds / 4,
            t.pilot_rounds,
            time(t.pilot_seconds),
            100.0 * t.confidence
        ));
    }
    Ok(())
}
