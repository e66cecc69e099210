//! What a batch would do, and about how long it takes.

use super::BatchArgs;
use super::expand::Job;
use super::store::{Store, settings};
use crate::cli::CliError;
use crate::cli::engine::Prepared;
use crate::cli::pilots;
use crate::cli::voice::{Level, Voice};
use crate::study::interval::Interval;
use crate::study::words::{bounds, time};
use std::collections::HashMap;
use std::io::Write;
use std::path::PathBuf;

/// What would be done with a job.
fn verdict(store: &Store, job: &Job) -> Result<&'static str, CliError> {
    let known = store.read(&job.name);
    let known = known.filter(|d| d.settings == settings(job) && d.is_there());
    if let Some(done) = known {
        if done.is_of_these_files() {
            return Ok("unchanged");
        }
        let hash = Prepared::new(&job.args)?.scene.hash;
        if format!("{hash:016x}") == done.scene_hash {
            return Ok("unchanged");
        }
    }
    Ok(if store.checkpoints(&job.name).is_empty() {
        "render"
    } else {
        "go on"
    })
}

/// Prints a line a job, and gives the exit code: that of a scene or option that is wrong.
pub fn run(args: &BatchArgs, store: &Store, jobs: &[Job], voice: &Voice) -> u8 {
    // Jobs of one table on one scene file are taken to be alike.
    let mut known: HashMap<(usize, PathBuf), Interval> = HashMap::new();
    let mut total = Interval::exact(0.0);
    let (mut left, mut code) = (0, 0);
    let length = |j: &Job| j.name.chars().count();
    let width = jobs.iter().map(length).max().unwrap_or(0).max(3);
    let mut out = std::io::stdout().lock();
    for job in jobs {
        let key = (job.entry, job.args.scene.clone());
        let found = verdict(store, job).and_then(|what| match known.get(&key) {
            _ if what == "unchanged" => Ok((what, None)),
            Some(took) => Ok((what, Some(*took))),
            None => {
                let mut wanted = job.args.clone();
                wanted.threads = args.threads;
                let took = pilots::seconds(&wanted)?;
                known.insert(key, took);
                Ok((what, Some(took)))
            }
        });
        let (what, took) = found.unwrap_or_else(|e| {
            voice.say(Level::Error, &format!("{}: {e}", job.name));
            code = code.max(e.code());
            ("fail", None)
        });
        let mut about = String::new();
        if let Some(took) = took {
            about = words(took);
            total = Interval {
                value: total.value + took.value,
                low: total.low + took.low,
                high: total.high + took.high,
            };
            left += 1;
        }
        let files: Vec<String> = job
            .args
            .output
            .iter()
            .map(|o| o.display().to_string())
            .collect();
        let line = format!(
            "{:<width$}  {what:<9}  {about:<10}  {}",
            job.name,
            files.join(" ")
        );
        let _ = writeln!(out, "{}", line.trim_end());
    }
    let _ = writeln!(
        out,
        "{left} of {} jobs to do, about {}",
        jobs.len(),
        words(total)
    );
    if known.len() < left {
        let text = "times are by pilots of the first job of each table and scene; what a checkpoint saves is not taken off";
        voice.say(Level::Note, text);
    }
    code
}

fn words(i: Interval) -> String {
    if i.low < i.high {
        bounds(i, time)
    } else {
        time(i.value)
    }
}
