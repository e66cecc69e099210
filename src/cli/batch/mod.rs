//! `metrolux batch`: many renders that nobody watches.

mod board;
mod dry;
mod entry;
mod expand;
mod queue;
mod sheet;
mod store;
mod table;
mod text;
mod unique;
mod values;
mod work;

use super::CliError;
use super::parse::{duration, positive_count, threads};
use super::signals::Signals;
use super::voice::{Level, Voice, VoiceArgs};
use crate::output::Events;
use board::{Board, bars};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;
use store::Store;
use work::Ground;

/// Render many images that a file lists.
///
/// Skips what is done and unchanged, goes on with what was cut, and never replaces an image but by a finished one. The
/// same command begins a batch, goes on with it after whatever stopped it, and renders again what has changed. What is
/// done, checkpoints, the log (log.jsonl) and a page with all images (index.html) are kept in the folder JOBS.batch. Exit
/// code: 75 if a signal stopped it, else that of the worst job (1, 4, 2, 3, 0).
#[derive(Args, Debug)]
pub struct BatchArgs {
    /// List of jobs: [[job]] tables with scene, output and options of render; see docs/jobs.md
    #[arg(value_name = "JOBS.toml")]
    pub file: PathBuf,
    /// Renders at a time; they share the threads
    #[arg(short, long, value_name = "J", default_value = "1", value_parser = positive_count)]
    pub jobs: usize,
    /// Go on after a job that failed
    #[arg(short, long)]
    pub keep_going: bool,
    /// Try a job again so often if it failed for a reason that may pass
    #[arg(long, value_name = "R", default_value_t = 0)]
    pub retry: u32,
    /// Say what would be done and about how long it takes, and stop
    #[arg(short = 'n', long)]
    pub dry_run: bool,
    /// Folder for what is kept, in the place of JOBS.batch
    #[arg(long, value_name = "DIR")]
    pub state: Option<PathBuf>,
    /// Time between checkpoints of a job
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "5m")]
    pub every: Duration,
    /// Worker threads of all renders together; one per core if not given
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,
    #[command(flatten)]
    pub voice: VoiceArgs,
    /// No progress, no table, no messages but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Runs the sub-command.
pub fn run(args: &BatchArgs) -> Result<ExitCode, CliError> {
    let voice = Voice::new(&args.voice, args.quiet)?;
    let ended = prepare(args, &voice);
    let (voice, ended) = match ended {
        Ok((_, store, jobs)) if args.dry_run => {
            let code = dry::run(args, &store, &jobs, &voice);
            (voice, Ok(code))
        }
        Ok((voice, store, jobs)) => {
            let ended = work(args, &voice, &store, &jobs);
            (voice, ended)
        }
        Err(e) => (voice, Err(e)),
    };
    Ok(voice.conclude(ended))
}

/// Reads the jobs and opens the folder, unless nothing is to be done but to tell.
fn prepare(args: &BatchArgs, voice: &Voice) -> Result<(Voice, Store, Vec<expand::Job>), CliError> {
    let file = std::path::absolute(&args.file);
    let file = file.map_err(|e| CliError::Usage(format!("{}: {e}", args.file.display())))?;
    let base = file.parent().unwrap_or(Path::new("/"));
    let jobs = expand::jobs(&args.file, base)?;
    let folder = match &args.state {
        Some(folder) => folder.clone(),
        None => file.with_extension("batch"),
    };
    if args.dry_run {
        return Ok((voice.clone(), Store::at(&folder, base), jobs));
    }
    let store = Store::open(&folder, base)?;
    let log = Events::to_file(&store.file("log.jsonl"))?;
    let voice = voice.clone().also_to(log).above(bars(voice));
    Ok((voice, store, jobs))
}

fn work(
    args: &BatchArgs,
    voice: &Voice,
    store: &Store,
    jobs: &[expand::Job],
) -> Result<u8, CliError> {
    let version = env!("CARGO_PKG_VERSION");
    let told = json!({ "version": version, "file": args.file, "jobs": jobs.len() });
    voice.event("batch", &told);
    let signals = Signals::catch()?;
    let board = Board::new(voice, jobs.len());
    let ground = Ground {
        store,
        voice,
        signals: &signals,
        board: &board,
        every: args.every,
        retry: args.retry,
    };
    let sheet = |outcomes: &[Option<work::Outcome>]| sheet::write(args, store, jobs, outcomes);
    let outcomes = queue::run(args, &ground, jobs, &sheet)?;
    board.finish();
    sheet(&outcomes)?;
    let outcomes: Vec<work::Outcome> = outcomes
        .into_iter()
        .map(|o| o.unwrap_or_else(work::Outcome::not_begun))
        .collect();
    if !args.quiet {
        table::print(jobs, &outcomes);
    }
    let page = store.file("index.html");
    voice.say(Level::Note, &page.display().to_string());
    let stopped = signals.stop().is_some();
    if stopped {
        voice.insist(Level::Note, "stopped by a signal: the same command goes on");
    }
    Ok(table::code(&outcomes, stopped))
}
