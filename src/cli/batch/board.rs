//! Progress of all jobs as one.

use crate::cli::bar::Bar;
use crate::cli::progress::Shown;
use crate::cli::voice::{ProgressArg, Voice};
use crate::integrator::Progress;
use indicatif::MultiProgress;
use std::collections::HashMap;
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};

/// The bars of a batch, where there are any.
pub fn bars(voice: &Voice) -> Option<MultiProgress> {
    let wanted = voice.progress == ProgressArg::Auto && !voice.is_quiet();
    (wanted && std::io::stderr().is_terminal()).then(MultiProgress::new)
}

/// How far a batch is.
pub struct Board<'a> {
    total: Shown<'a>,
    bars: Option<MultiProgress>,
    jobs: usize,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// Jobs that came to an end.
    ended: usize,
    /// Parts of those that are at work.
    live: HashMap<usize, f64>,
}

impl<'a> Board<'a> {
    /// So many jobs, none of them begun.
    pub fn new(voice: &'a Voice, jobs: usize) -> Self {
        let bars = voice.bars().cloned();
        let bar = bars
            .as_ref()
            .map(|b| Bar::among(b, &format!("0 of {jobs} jobs")));
        Self {
            total: Shown::with(voice, "rendering", bar),
            bars,
            jobs,
            state: Mutex::default(),
        }
    }

    /// A job that begins now.
    pub fn job<'b>(&'b self, number: usize, voice: &'b Voice, name: &str) -> JobBar<'b> {
        let bar = self.bars.as_ref().map(|b| Bar::above_last(b, name));
        JobBar {
            own: Shown::with(voice, "rendering", bar),
            board: self,
            number,
        }
    }

    /// A job has come to an end.
    pub fn ended(&self, number: usize) {
        self.change(|s| {
            s.live.remove(&number);
            s.ended += 1;
        });
    }

    /// Nothing more happens.
    pub fn finish(&self) {
        self.total.finish(false);
    }

    fn change(&self, f: impl FnOnce(&mut State)) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        f(&mut state);
        let live: f64 = state.live.values().sum();
        self.total
            .say(&format!("{} of {} jobs", state.ended, self.jobs));
        self.total
            .update((state.ended as f64 + live) / self.jobs as f64);
    }
}

/// Progress of one job.
pub struct JobBar<'a> {
    own: Shown<'a>,
    board: &'a Board<'a>,
    number: usize,
}

impl JobBar<'_> {
    /// Its bar goes.
    pub fn finish(&self, whole: bool) {
        self.own.finish(whole);
    }
}

impl Drop for JobBar<'_> {
    fn drop(&mut self) {
        self.own.finish(false);
        if let (Some(bars), Some(bar)) = (&self.board.bars, self.own.bar()) {
            bar.leave(bars);
        }
    }
}

impl Progress for JobBar<'_> {
    fn update(&self, done: f64) {
        self.own.update(done);
        self.board.change(|s| {
            s.live.insert(self.number, done);
        });
    }

    fn building(&self, done: f64) {
        self.own.building(done);
    }
}
