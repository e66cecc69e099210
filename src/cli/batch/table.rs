//! The last word of a batch: a line a job, and one code for all.

use super::expand::Job;
use super::work::{How, Outcome};
use crate::study::words::{percent, time};
use std::io::Write;

/// How a job came out, in a word.
pub fn word(how: &How) -> &'static str {
    match how {
        How::Rendered => "rendered",
        How::Resumed => "resumed",
        How::Unchanged => "unchanged",
        How::Failed(_) => "failed",
        How::Cut => "cut",
        How::NotBegun => "not begun",
    }
}

/// The longest name that has a column of its own width, characters.
const WIDEST: usize = 40;

/// Prints the table to stdout.
pub fn print(jobs: &[Job], outcomes: &[Outcome]) {
    let length = |j: &Job| j.name.chars().count();
    let width = jobs.iter().map(length).max().unwrap_or(0).clamp(3, WIDEST);
    let mut text = format!(
        "{:<width$}  {:<9}  {:>8}  {:>7}\n",
        "job", "", "time", "error"
    );
    for (job, o) in jobs.iter().zip(outcomes) {
        let done = matches!(o.how, How::Rendered | How::Resumed | How::Unchanged);
        let took = if done { time(o.seconds) } else { String::new() };
        let error = o.error.filter(|_| done).map_or(String::new(), percent);
        let mut aside = match (&o.how, o.code) {
            (How::Failed(why), _) => why.clone(),
            (_, 3) => "faults were counted".into(),
            _ => String::new(),
        };
        if o.retries > 0 {
            aside = format!("{aside} (tried again: {})", o.retries);
        }
        let line = format!(
            "{:<width$}  {:<9}  {took:>8}  {error:>7}  {}",
            job.name,
            word(&o.how),
            aside.trim().replace('\n', " ")
        );
        text += line.trim_end();
        text.push('\n');
    }
    let count = |how: fn(&How) -> bool| outcomes.iter().filter(|o| how(&o.how)).count();
    let parts = [
        (count(|h| matches!(h, How::Rendered)), "rendered"),
        (count(|h| matches!(h, How::Resumed)), "resumed"),
        (count(|h| matches!(h, How::Unchanged)), "unchanged"),
        (count(|h| matches!(h, How::Failed(_))), "failed"),
        (count(|h| matches!(h, How::Cut)), "cut"),
        (count(|h| matches!(h, How::NotBegun)), "not begun"),
    ];
    let parts = parts.iter().filter(|p| p.0 > 0);
    let parts: Vec<String> = parts.map(|(n, what)| format!("{n} {what}")).collect();
    text += &format!("{} jobs: {}\n", jobs.len(), parts.join(", "));
    let _ = std::io::stdout().lock().write_all(text.as_bytes());
}

/// The exit code of a batch: 75 if a signal stopped it, since the same command then goes on; else that of the worst job.
pub fn code(outcomes: &[Outcome], stopped: bool) -> u8 {
    if stopped {
        return 75;
    }
    let codes = [1, 4, 2, 3];
    let worst = codes
        .into_iter()
        .find(|c| outcomes.iter().any(|o| o.code == *c));
    worst.unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_job_gives_the_code() {
        let of = |codes: &[u8], stopped| {
            let outcome = |code: &u8| Outcome {
                how: How::Rendered,
                code: *code,
                ..Outcome::not_begun()
            };
            let all: Vec<Outcome> = codes.iter().map(outcome).collect();
            code(&all, stopped)
        };
        assert_eq!(of(&[0, 0], false), 0);
        assert_eq!(of(&[0, 3, 2, 0], false), 2);
        assert_eq!(of(&[4, 2, 3], false), 4);
        assert_eq!(of(&[4, 1, 75], false), 1);
        assert_eq!(of(&[2, 75], true), 75);
        // Jobs that were not begun after one that failed.
        assert_eq!(of(&[2, 75], false), 2);
    }
}
