//! Who may stop a run between two rounds, and keep what it has.

use super::{MltResult, Rendered, State};
use crate::film::{Malformed, Shards, Writer};
use std::io;
use std::time::Duration;

/// What an integrator gave.
pub enum Outcome {
    /// Path tracing and bidirectional path tracing.
    Sampled(Rendered),
    /// Metropolis light transport.
    Mlt(Box<MltResult>),
}

/// A run between two rounds.
pub trait Standing {
    /// Writes all that the run needs to go on: what [`State::read`] reads.
    fn save(&mut self, w: &mut Writer) -> io::Result<()>;
    /// The image so far.
    fn outcome(&mut self) -> Outcome;
}

/// Asked between rounds whether a run goes on.
pub trait Keeper {
    /// The parts of the work to do.
    fn shards(&self) -> Shards {
        Shards::default()
    }

    /// How long to work at most, about, before asking again; `None` for as long as it likes.
    fn patience(&self) -> Option<Duration> {
        None
    }

    /// The state to start from.
    fn begin(&mut self) -> Option<State> {
        None
    }

    /// The run stands between two rounds; `finished` if it has done all it was to do. True if it may go on.
    fn between(&mut self, run: &mut dyn Standing, finished: bool) -> bool;
}

/// Lets every run go on to its end.
pub struct Nobody;

impl Keeper for Nobody {
    fn between(&mut self, _run: &mut dyn Standing, _finished: bool) -> bool {
        true
    }
}

/// A run that nobody keeps has nothing to go wrong with.
pub(super) fn unkept<T>(run: Result<T, Malformed>) -> T {
    run.unwrap_or_else(|e| unreachable!("nothing was read: {e}"))
}
