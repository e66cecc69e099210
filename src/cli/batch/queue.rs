//! The jobs of a batch in their order, on one or several sets of threads.

use super::BatchArgs;
use super::expand::Job;
use super::work::{Ground, How, Outcome, Shelf, run as work};
use crate::cli::CliError;
use crate::cli::engine::threads;
use crate::cli::voice::Level;
use rayon::ThreadPool;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The page is written so often on the way, at most.
const REFRESH: Duration = Duration::from_secs(60);

/// What to do with all outcomes so far.
type Refresh<'a> = &'a (dyn Fn(&[Option<Outcome>]) -> Result<(), CliError> + Sync);

/// Does all jobs, or those until one fails or a signal stops it.
///
/// # Errors
/// Threads that cannot be started.
pub fn run(
    args: &BatchArgs,
    ground: &Ground,
    jobs: &[Job],
    refresh: Refresh,
) -> Result<Vec<Option<Outcome>>, CliError> {
    let all = match args.threads.unwrap_or(0) {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let workers = args.jobs.min(jobs.len());
    let share = |k: usize| (all / workers + usize::from(k < all % workers)).max(1);
    let pools: Vec<ThreadPool> = (0..workers)
        .map(|k| threads(share(k)))
        .collect::<Result<_, _>>()?;
    let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    let found = Mutex::new((vec![None; jobs.len()], Instant::now()));
    let worker = |pool: &ThreadPool| {
        let mut shelf = Shelf::default();
        while ground.signals.stop().is_none() && !failed.load(Ordering::Relaxed) {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = jobs.get(number) else {
                return;
            };
            let outcome = work(ground, number, job, pool, &mut shelf);
            let bad = !matches!(outcome.how, How::Cut) && outcome.code != 0;
            failed.fetch_or(bad && !args.keep_going, Ordering::Relaxed);
            let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
            found.0[number] = Some(outcome);
            if found.1.elapsed() >= REFRESH {
                if let Err(e) = refresh(&found.0) {
                    ground.voice.insist(Level::Warning, &e.to_string());
                }
                found.1 = Instant::now();
            }
        }
    };
    std::thread::scope(|scope| {
        let (first, others) = pools.split_first().expect("a batch has a job");
        let worker = &worker;
        for pool in others {
            scope.spawn(move || worker(pool));
        }
        worker(first);
    });
    let found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok(found.0)
}
