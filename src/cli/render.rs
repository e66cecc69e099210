//! `metrolux render`.

use super::bar::Bar;
use super::engine::{self, Prepared};
use super::render_args::RenderArgs;
use super::{CliError, report};
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
    let rendered = engine::render(args, &prepared, &bar);
    bar.finish();
    let rendered = rendered?;
    for o in outputs {
        rendered.write(o, args.exposure)?;
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
        return Ok(ExitCode::from(3));
    }
    Ok(ExitCode::SUCCESS)
}
