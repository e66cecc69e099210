//! How somebody watches a render: between the engine, which knows scene and image, and an integrator, which knows rounds.

use super::CliError;
use super::engine::Rendered;
use super::identity::Identity;
use super::lab::Lab;
use crate::film::{Malformed, Shards};
use crate::integrator::{Keeper, Outcome, Standing, State};
use crate::path::Tally;
use std::time::Duration;

/// Makes the picture of sums.
pub type Develop<'a> = &'a dyn Fn(Outcome) -> Rendered;

/// Somebody who may stop a render, keep its state and go on with it.
pub trait Watcher {
    /// The scene stands; this is what the render is of.
    ///
    /// # Errors
    /// A state to go on from that is of another render.
    fn begin(&mut self, identity: Identity) -> Result<(), CliError>;

    /// The parts of the work to do.
    fn shards(&self) -> Shards {
        Shards::default()
    }

    /// See [`Keeper::patience`].
    fn patience(&self) -> Option<Duration> {
        None
    }

    /// The state to start from, if there is one.
    fn take_state(&mut self) -> Option<State> {
        None
    }

    /// See [`Keeper::between`].
    fn between(&mut self, _run: &mut dyn Standing, _develop: Develop, _finished: bool) -> bool {
        true
    }

    /// The state does not go with the render, for this reason.
    fn malformed(&self, e: Malformed) -> CliError {
        CliError::Usage(e.0)
    }
}

/// Nobody.
pub struct Unwatched;

impl Watcher for Unwatched {
    fn begin(&mut self, _identity: Identity) -> Result<(), CliError> {
        Ok(())
    }
}

/// A watcher as an integrator sees it.
pub struct Watched<'a> {
    /// Who watches.
    pub watcher: &'a mut (dyn Watcher + Send),
    /// Makes pictures.
    pub lab: &'a Lab,
}

impl Keeper for Watched<'_> {
    fn shards(&self) -> Shards {
        self.watcher.shards()
    }

    fn patience(&self) -> Option<Duration> {
        self.watcher.patience()
    }

    fn begin(&mut self) -> Option<State> {
        self.watcher.take_state()
    }

    fn between(&mut self, run: &mut dyn Standing, finished: bool) -> bool {
        let develop = |outcome| self.lab.develop(outcome, &Tally::default());
        self.watcher.between(run, &develop, finished)
    }
}
