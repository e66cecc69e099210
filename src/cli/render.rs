//! `metrolux render`.

use super::bar::Bar;
use super::engine::{self, Prepared};
use super::keep::{Ended, Keep};
use super::render_args::RenderArgs;
use super::{CliError, replay, report};
use std::process::ExitCode;

/// Runs the sub-command.
pub fn run(args: &RenderArgs) -> Result<ExitCode, CliError> {
    let prepared = Prepared::new(args)?;
    if !args.quiet {
        let warnings = &prepared.scene.warnings;
        let wrongs = prepared.job.plan.wrongs();
        let all = warnings.iter().chain(&wrongs);
        all.for_each(|w| eprintln!("warning: {w}"));
        eprintln!("{}", prepared.job.plan.short());
    }
    let outputs = &prepared.job.outputs;
    let written = outputs.iter().chain(&args.stats);
    for o in written.chain(&args.record_rays) {
        crate::output::check_writable(o)?;
    }
    let bar = Bar::new("rendering", args.quiet);
    let mut keep = Keep::new(args, outputs)?;
    let rendered = engine::render_watched(args, &prepared, &bar, &mut keep);
    bar.finish();
    let rendered = rendered?;
    let ended = keep.result()?;
    let code = stopped(args, ended);
    // A part is written where it is known whether it is whole; the image of a render that goes on later is not.
    if args.shard.is_none() && !(code.is_some() && args.checkpoint.is_some()) {
        for o in outputs {
            rendered.write(o, args.exposure)?;
        }
    }
    let report = &rendered.report;
    if let Some(path) = &args.stats {
        report::write_json(path, report)?;
    }
    if !args.quiet {
        eprintln!("{}", report.summary());
        if let Some(line) = report.error_line() {
            eprintln!("{line}");
        }
    }
    let checked = report.disagreement();
    if let Some(found) = checked.filter(|c| !args.quiet || c.wrong() > 0) {
        found.lines().iter().for_each(|l| eprintln!("{l}"));
    }
    if checked.is_some_and(|c| c.wrong() > 0) {
        eprintln!("error: a backend missed a primitive or named one that is not there");
        return Ok(ExitCode::from(3));
    }
    let impossible = report.faults_impossible();
    if impossible > 0 {
        eprintln!(
            "error: {impossible} impossible values were met; see the fault counters in the stats"
        );
        for site in report.fault_sites() {
            eprintln!("{}", replay::told(site));
        }
        return Ok(ExitCode::from(3));
    }
    Ok(code.map_or(ExitCode::SUCCESS, ExitCode::from))
}

/// The exit code of a render that a signal stopped, with a line that says what there is.
fn stopped(args: &RenderArgs, ended: Ended) -> Option<u8> {
    let Ended::Stopped(signal) = ended else {
        return None;
    };
    let (what, code) = match (&args.checkpoint, args.shard) {
        (Some(file), _) => (format!("--resume goes on from {}", file.display()), 75),
        (None, Some(_)) => ("nothing was written".into(), 128 + signal),
        (None, None) => ("the image so far was written".into(), 128 + signal),
    };
    eprintln!("stopped by a signal: {what}");
    Some(code as u8)
}
