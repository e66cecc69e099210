//! The progress bar: on a terminal only, with an estimate of the time left.

use crate::integrator::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// A bar of 1000 ticks.
pub struct Bar(ProgressBar);

impl Bar {
    /// A visible bar if stderr is a terminal and `quiet` is not asked for.
    pub fn new(what: &str, quiet: bool) -> Self {
        let bar = ProgressBar::new(1000);
        if quiet || !std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let style = ProgressStyle::with_template(
            "{msg} [{bar:32}] {percent:>3} %  {elapsed} so far, {eta} to go",
        )
        .expect("the template is fixed");
        bar.set_style(style.progress_chars("=> "));
        bar.set_message(what.to_owned());
        bar.enable_steady_tick(std::time::Duration::from_millis(250));
        Self(bar)
    }

    /// Says what is being done now.
    pub fn say(&self, what: &str) {
        self.0.set_message(what.to_owned());
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

impl Progress for Bar {
    fn update(&self, done: f64) {
        self.0.set_position((done * 1000.0) as u64);
    }
}
