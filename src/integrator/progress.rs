//! How long a render may go on, and who is told how far it is.

use crate::film::Malformed;
use std::time::{Duration, Instant};

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// Samples or mutations for each pixel of the crop.
    PerPixel(f64),
    /// Rounds: all chains' fixed number of steps, or one sample a pixel.
    Rounds(u64),
    /// Wall time; stops at the end of the round that passes it.
    Time(Duration),
}

/// Hears how far a render is.
pub trait Progress: Sync {
    /// `done` runs from 0 to 1.
    fn update(&self, done: f64);
    /// The same for the building of the acceleration structure, before the render.
    fn building(&self, _done: f64) {}
}

/// Hears nothing.
pub struct Quiet;

impl Progress for Quiet {
    fn update(&self, _done: f64) {}
}

/// Decides round by round.
pub struct Clock {
    start: Instant,
    limit: Option<Duration>,
    rounds: Option<u64>,
    stretch: u64,
    /// Longest stretch, seconds.
    patience: Option<f64>,
    /// Rounds and seconds of earlier runs that this one goes on from.
    before: (u64, f64),
}

impl Clock {
    /// A clock that starts now. `rounds_for` turns a number per pixel into rounds.
    pub fn new(budget: Budget, rounds_for: impl Fn(f64) -> u64) -> Self {
        let (limit, rounds) = match budget {
            Budget::PerPixel(n) => (None, Some(rounds_for(n))),
            Budget::Rounds(r) => (None, Some(r)),
            Budget::Time(t) => (Some(t), None),
        };
        Self {
            start: Instant::now(),
            limit,
            rounds,
            stretch: 1,
            patience: None,
            before: (0, 0.0),
        }
    }

    /// Goes on from `done` rounds that took `seconds`.
    pub fn after(mut self, done: u64, seconds: f64) -> Self {
        self.before = (done, seconds);
        self
    }

    /// Stretches last at most about so long.
    pub fn with_patience(mut self, patience: Option<Duration>) -> Self {
        self.patience = patience.map(|p| p.as_secs_f64());
        self
    }

    /// Seconds spent, those of earlier runs included.
    pub fn spent(&self) -> f64 {
        self.before.1 + self.start.elapsed().as_secs_f64()
    }

    /// That `done` rounds are not more than were asked for.
    pub(super) fn check(&self, done: u64) -> Result<(), Malformed> {
        match self.rounds {
            Some(r) if done > r => Err(Malformed(format!(
                "has {done} rounds, more than the {r} asked for"
            ))),
            _ => Ok(()),
        }
    }

    /// Do at least so many rounds at once, while there is room for them: where each stretch has a price of its own.
    pub fn in_stretches(mut self, rounds: u64) -> Self {
        self.stretch = rounds.max(1);
        self
    }

    /// How many rounds to do at once after `done` of them: few enough to keep the time limit and the progress bar
    /// honest, at most `most`. 0 when it is time to stop; at least one round is always made.
    pub fn next(&self, done: u64, most: u64) -> u64 {
        let most = most.min(self.bearable(done));
        if let Some(r) = self.rounds {
            let fine = r.div_ceil(100).max(self.stretch);
            return (r - done.min(r)).min(most).min(fine);
        }
        let limit = self.limit.unwrap_or(Duration::ZERO).as_secs_f64();
        let spent = self.spent();
        if done == 0 {
            return 1;
        }
        if spent >= limit {
            return 0;
        }
        let each = spent / done as f64;
        (((limit - spent) / each / 4.0) as u64)
            .clamp(1, most.max(1))
            .min(((0.5 / each) as u64 + 1).max(self.stretch))
    }

    /// Most rounds at once that try nobody's patience.
    fn bearable(&self, done: u64) -> u64 {
        let Some(patience) = self.patience else {
            return u64::MAX;
        };
        match done - self.before.0.min(done) {
            0 => 1,
            here => {
                let each = self.start.elapsed().as_secs_f64() / here as f64;
                ((patience / each) as u64).max(1)
            }
        }
    }

    /// Part of the budget that is used after `done` rounds.
    pub fn fraction(&self, done: u64) -> f64 {
        let f = match (self.rounds, self.limit) {
            (Some(r), _) => done as f64 / r.max(1) as f64,
            (_, Some(l)) => self.spent() / l.as_secs_f64().max(1e-9),
            _ => 1.0,
        };
        f.min(1.0)
    }
}
