//! The progress bar: on a terminal only, with an estimate of the time left.

use crate::integrator::Progress;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};

/// A bar of 1000 ticks.
pub struct Bar {
    bar: ProgressBar,
    /// What it said before an acceleration structure was built; there is something only meanwhile.
    before: Mutex<Option<String>>,
}

impl Bar {
    /// A visible bar if stderr is a terminal and `quiet` is not asked for.
    pub fn new(what: &str, quiet: bool) -> Self {
        let bar = ProgressBar::new(1000);
        if quiet || !std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        Self::dressed(bar, what)
    }

    /// A bar among others, below those that are there.
    pub fn among(bars: &MultiProgress, what: &str) -> Self {
        Self::dressed(bars.add(ProgressBar::new(1000)), what)
    }

    /// A bar among others, above the last.
    pub fn above_last(bars: &MultiProgress, what: &str) -> Self {
        Self::dressed(bars.insert_from_back(1, ProgressBar::new(1000)), what)
    }

    /// Leaves the others, which forget it.
    pub fn leave(&self, bars: &MultiProgress) {
        bars.remove(&self.bar);
    }

    fn dressed(bar: ProgressBar, what: &str) -> Self {
        let style = ProgressStyle::with_template(
            "{msg} [{bar:32}] {percent:>3} %  {elapsed} so far, {eta} to go",
        )
        .expect("the template is fixed");
        bar.set_style(style.progress_chars("=> "));
        bar.set_message(what.to_owned());
        bar.enable_steady_tick(std::time::Duration::from_millis(250));
        Self {
            bar,
            before: Mutex::new(None),
        }
    }

    /// Says what is being done now.
    pub fn say(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Progress for Bar {
    fn update(&self, done: f64) {
        let mut before = self.before.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(what) = before.take() {
            self.bar.set_message(what);
            self.bar.reset();
        }
        self.bar.set_position((done * 1000.0) as u64);
    }

    fn building(&self, done: f64) {
        let mut before = self.before.lock().unwrap_or_else(PoisonError::into_inner);
        if before.is_none() {
            *before = Some(self.bar.message());
            self.bar.set_message("building");
        }
        self.bar.set_position((done * 1000.0) as u64);
    }
}
