//! Checkpoints, parts and signals of one render.

use super::CliError;
use super::identity::Identity;
use super::preview::Preview;
use super::render_args::{RenderArgs, ResumeArg};
use super::signals::Signals;
use super::voice::{Level, Voice};
use super::watch::{Develop, Watcher};
use crate::film::{Malformed, Shards};
use crate::integrator::{Standing, State};
use crate::output::{ImageError, RunFile, write_run};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// It did all it was to do.
    Finished,
    /// This signal stopped it.
    Stopped(i32),
}

/// Keeps one render.
pub struct Keep<'a> {
    args: &'a RenderArgs,
    /// Images to write when asked for on the way.
    outputs: &'a [PathBuf],
    signals: &'a Signals,
    voice: &'a Voice,
    identity: Option<Identity>,
    start: Option<State>,
    /// Where that came from.
    source: Option<PathBuf>,
    last: Instant,
    /// Times that the image so far had been asked for when it was last looked at.
    shown: usize,
    /// A run that ends sooner than this needs no checkpoint at its end.
    trifle: Duration,
    /// Shows images on the way.
    pub preview: Option<Preview>,
    /// How it ended.
    pub ended: Ended,
    /// What could not be written at the end.
    failed: Option<CliError>,
}

/// Signals are looked at this often, about, with a checkpoint to write and without: stretches between have a price where
/// images are large.
const PATIENCE: [Duration; 2] = [Duration::from_secs(5), Duration::from_secs(10)];

/// How long a stretch of a run with checkpoints is at most.
fn stretch(every: Duration) -> Duration {
    PATIENCE[0].min(every / 2)
}

/// A checkpoint is due after so long a time without one: another stretch would go beyond the interval, and a kill at its end
/// would cost more than that.
fn due(since: Duration, every: Duration) -> bool {
    since + stretch(every) > every
}

impl<'a> Keep<'a> {
    /// For a render with these arguments, which writes these images.
    ///
    /// # Errors
    /// A checkpoint that is in the way, or none where one is required.
    pub fn new(
        args: &'a RenderArgs,
        outputs: &'a [PathBuf],
        signals: &'a Signals,
        voice: &'a Voice,
    ) -> Result<Self, CliError> {
        if let Some(file) = &args.checkpoint {
            let there = file.exists();
            if there && args.resume.is_none() {
                return Err(CliError::Usage(format!(
                    "{} is there already: expected --resume to go on from it, or another name",
                    file.display()
                )));
            }
            if !there && args.resume == Some(ResumeArg::Require) && args.extend.is_empty() {
                return Err(CliError::Usage(format!(
                    "{} is not there, and --resume=require asks for it",
                    file.display()
                )));
            }
        }
        Ok(Self {
            args,
            outputs,
            signals,
            voice,
            identity: None,
            start: None,
            source: None,
            last: Instant::now(),
            shown: signals.shows(),
            trifle: Duration::ZERO,
            preview: None,
            ended: Ended::Finished,
            failed: None,
        })
    }

    /// A run that ends within this time is not written at its end: making it again is cheaper.
    pub fn sparing(mut self, trifle: Duration) -> Self {
        self.trifle = trifle;
        self
    }

    /// What could not be written when the render ended.
    pub fn result(self) -> Result<Ended, CliError> {
        match self.failed {
            Some(e) => Err(e),
            None => Ok(self.ended),
        }
    }

    fn save(&mut self, file: &Path, run: &mut dyn Standing) -> Result<(), CliError> {
        let begun = Instant::now();
        let label = self.identity.as_ref().map(Identity::label);
        write_run(file, &label.unwrap_or_default(), &mut |w| run.save(w))?;
        self.last = Instant::now();
        let bytes = std::fs::metadata(file).map_or(0, |m| m.len());
        let seconds = begun.elapsed().as_secs_f64();
        let file = file.display().to_string();
        let told = json!({ "file": file, "bytes": bytes, "seconds": seconds });
        self.voice.event("checkpoint", &told);
        Ok(())
    }

    fn complain(&self, e: &CliError) {
        let text = format!("{e}; the render goes on");
        self.voice.insist(Level::Warning, &text);
    }

    /// Files to go on from.
    fn sources(&self) -> &'a [PathBuf] {
        match &self.args.checkpoint {
            Some(file) if file.exists() => std::slice::from_ref(file),
            _ => &self.args.extend,
        }
    }
}

impl Watcher for Keep<'_> {
    fn begin(&mut self, identity: Identity) -> Result<(), CliError> {
        for file in self.sources() {
            let (found, state) = read_run(file)?;
            refuse_others(file, &found, &identity)?;
            match &mut self.start {
                None => self.start = Some(state),
                Some(s) => s.merge(state).map_err(|e| bad(file, e.0))?,
            }
        }
        if let Some(state) = &self.start {
            let (found, due) = (state.shards(), self.shards());
            if *found != due {
                let file = &self.sources()[0];
                return Err(bad(
                    file,
                    format!(
                        "holds parts {} of {}; expected {} of {}",
                        list(found.here().iter().copied()),
                        found.of(),
                        list(due.here().iter().copied()),
                        due.of()
                    ),
                ));
            }
        }
        self.source = self.sources().first().cloned();
        self.identity = Some(identity);
        self.last = Instant::now();
        Ok(())
    }

    fn shards(&self) -> Shards {
        let part = self.args.shard;
        part.map_or_else(Shards::default, |(k, n)| Shards::one(k, n))
    }

    fn patience(&self) -> Option<Duration> {
        let every = self.args.every;
        let patience = match self.args.checkpoint {
            Some(_) => stretch(every),
            None => PATIENCE[1],
        };
        let shown = self.preview.as_ref().map(|_| Preview::patience());
        Some(shown.map_or(patience, |p| p.min(patience)))
    }

    fn malformed(&self, e: Malformed) -> CliError {
        match &self.source {
            Some(file) => bad(file, e.0),
            None => CliError::Internal(e.0),
        }
    }

    fn take_state(&mut self) -> Option<State> {
        self.start.take()
    }

    fn between(&mut self, run: &mut dyn Standing, develop: Develop, finished: bool) -> bool {
        let stop = self.signals.stop().filter(|_| !finished);
        let shows = self.signals.shows();
        let show = shows > std::mem::replace(&mut self.shown, shows);
        let due = due(self.last.elapsed(), self.args.every);
        let whole = finished && self.last.elapsed() >= self.trifle;
        if let Some(file) = &self.args.checkpoint
            && (whole || stop.is_some() || show || due)
            && let Err(e) = self.save(file, run)
        {
            if finished || stop.is_some() {
                self.failed = Some(e);
            } else {
                // The last good checkpoint is still there, and there may be room again later.
                self.complain(&e);
                self.last = Instant::now();
            }
        }
        if finished && self.args.shard.is_some() && self.failed.is_none() {
            for file in self.outputs {
                if let Err(e) = self.save(file, run) {
                    self.failed = Some(e);
                }
            }
        }
        if let Some(signal) = stop {
            self.ended = Ended::Stopped(signal);
            return false;
        }
        if !finished && let Some(preview) = self.preview.as_mut().filter(|p| p.due()) {
            preview.show(self.voice, || develop(run.outcome()).image);
        }
        if show && !finished && self.args.shard.is_none() {
            let image = develop(run.outcome());
            for file in self.outputs.iter().filter(|_| image.report.begun()) {
                if let Err(e) = image.write(file, self.args.exposure) {
                    self.complain(&e);
                }
            }
        }
        true
    }
}

/// Numbers of parts as a person counts them.
pub fn list(parts: impl Iterator<Item = u32>) -> String {
    let all: Vec<String> = parts.map(|p| (p + 1).to_string()).collect();
    all.join(", ")
}

/// A file that does not hold what it should.
pub fn bad(file: &Path, reason: String) -> CliError {
    CliError::Output(ImageError::Bad {
        path: file.into(),
        reason,
    })
}

/// Reads a checkpoint or part: what it is of, and the run.
///
/// # Errors
/// A file that is none, or damaged.
pub fn read_run(file: &Path) -> Result<(Identity, State), CliError> {
    let read = RunFile::read(file)?;
    understand(&read).map_err(|e| bad(file, e))
}

/// What a whole file says.
///
/// # Errors
/// A reason, if that is nothing.
pub fn understand(file: &RunFile) -> Result<(Identity, State), String> {
    let identity = Identity::of_label(file.label())?;
    let state = State::read(&mut file.run()).map_err(|e| e.0)?;
    identity.check(&state)?;
    Ok((identity, state))
}

/// That a file is of the render `here`.
///
/// # Errors
/// What differs.
pub fn refuse_others(file: &Path, found: &Identity, here: &Identity) -> Result<(), CliError> {
    let differences = here.differences(found);
    if differences.is_empty() {
        return Ok(());
    }
    let what = differences.join("; ");
    Err(bad(file, format!("is of another render: {what}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks after stretches as long as they may be, from any beginning: two checkpoints are never further apart than the
    /// interval, nor closer than half of it.
    #[test]
    fn no_more_than_an_interval_lies_between_two_checkpoints() {
        for every in [1, 3, 999, 5_000, 9_999, 60_000, 300_000].map(Duration::from_millis) {
            for first in 0..100 {
                let mut since = every * first / 100;
                while !due(since, every) {
                    since += stretch(every);
                }
                assert!(since <= every, "{since:?} of {every:?}");
                assert!(since * 2 > every, "{since:?} of {every:?}");
            }
        }
    }
}
