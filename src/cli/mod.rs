//! The command line: typed arguments → resolved job → work. One file a sub-command.

// They panic on a closed pipe; `outlet` does not.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod bar;
mod batch;
mod bench_accel;
mod check_rays;
mod compare;
mod decide;
mod distinct;
mod engine;
mod error;
mod farm;
mod identity;
mod inspect;
mod instancing;
mod job;
mod keep;
mod lab;
mod layers;
mod manual;
mod merge;
mod mutate;
mod outlet;
mod parse;
mod pilots;
mod plan;
mod plan_measure;
mod plan_memory;
mod predict;
mod preview;
mod progress;
mod render;
mod render_args;
mod replay;
mod replay_text;
mod report;
mod signals;
mod study;
mod study_run;
mod tuning;
mod verify;
mod verify_paths;
mod voice;
mod watch;
mod while_running;

pub use error::CliError;
pub use merge::is_part;

use clap::{Parser, Subcommand};
use outlet::{Outlet, tell};
use std::process::ExitCode;

/// Metropolis light transport in path space, with spectra, on Embree.
#[derive(Parser, Debug)]
#[command(name = "metrolux", version, about, long_about = LONG, after_help = EXIT_CODES)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

const LONG: &str = "Renders pictures of scenes whose light is hard to find: a room lit through a door ajar, caustics \
under glass, a pool in the sun.\n\nReads pbrt-v4 scenes. Results go to files and stdout, progress and messages to stderr.";

const EXIT_CODES: &str = "Exit codes: 0 complete · 1 comparison failed or internal error · 2 usage or scene (do not \
retry) · 3 finished, but integrity counters tripped · 4 output not writable · 75 stopped by INT or TERM with a checkpoint \
to go on from; without --checkpoint 130 or 143";

#[derive(Subcommand, Debug)]
enum Command {
    /// Render a scene to EXR and PNG
    Render(Box<render_args::RenderArgs>),
    /// Tell what a scene calls for, why, and how it will be rendered
    Plan(Box<plan::PlanArgs>),
    /// Render many images that a file lists
    Batch(batch::BatchArgs),
    /// Add up the parts of a render that machines shared
    Merge(merge::MergeArgs),
    Job(farm::FarmArgs),
    /// Compare an image with a reference
    Compare(compare::CompareArgs),
    /// Make a step of a chain again and print every quantity in it
    Replay(Box<replay::ReplayArgs>),
    /// Run chains with everything recomputed from scratch and every ray asked of two backends
    Verify(Box<verify::VerifyArgs>),
    BenchAccel(bench_accel::BenchAccelArgs),
    CheckRays(check_rays::CheckRaysArgs),
    /// Show what accuracy costs in time, as a page
    Study(Box<study::StudyArgs>),
    /// Tell how long a render will take to an error
    Predict(Box<predict::PredictArgs>),
    /// Print shell completions
    Completions(manual::CompletionsArgs),
    /// Print a manual page (roff), or write all of them
    Man(manual::ManArgs),
}

/// Runs the command line and says how it went.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command {
        Command::Render(args) => render::run(&args),
        Command::Plan(args) => plan::run(&args),
        Command::Batch(args) => batch::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Job(args) => farm::run(&args),
        Command::Compare(args) => compare::run(&args, &mut Outlet::new())
            .map(ExitCode::from)
            .map_err(CliError::from),
        Command::Replay(args) => replay::run(&args, &mut Outlet::new()),
        Command::Verify(args) => verify::run(&args, &mut Outlet::new()),
        Command::BenchAccel(args) => bench_accel::run(&args, &mut Outlet::new()),
        Command::CheckRays(args) => check_rays::run(&args, &mut Outlet::new()),
        Command::Study(args) => study::run(&args),
        Command::Predict(args) => predict::run(&args),
        Command::Completions(args) => manual::completions(&args),
        Command::Man(args) => manual::man(&args),
    };
    match done {
        Ok(code) => code,
        Err(e) => {
            tell(format_args!("error: {e}"));
            e.exit_code()
        }
    }
}
