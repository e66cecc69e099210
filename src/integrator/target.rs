//! Stopping at an error: the estimate is looked at after 1, 2, 4, 8 … rounds and never between, so that the run does not
//! end at whichever of many looks happens to be low.

use super::Budget;
use crate::film::ErrorSummary;

/// When a render stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// The most it may do.
    pub budget: Budget,
    /// Relative error (see [`ErrorSummary`]) at which it is done.
    pub target_error: Option<f64>,
}

impl From<Budget> for Stop {
    fn from(budget: Budget) -> Self {
        Self {
            budget,
            target_error: None,
        }
    }
}

/// The looks of one render.
pub(super) struct Looks {
    target: Option<f64>,
    /// Rounds at which the next look is due.
    next: u64,
    /// The last look: rounds, and the relative error then.
    last: Option<(u64, f64)>,
}

impl Looks {
    /// No look yet; the first is after `first` rounds.
    pub(super) fn new(target: Option<f64>, first: u64) -> Self {
        Self {
            target,
            next: first,
            last: None,
        }
    }

    /// Goes on after `done` rounds. If a look was due then, it is due again.
    pub(super) fn after(mut self, done: u64) -> Self {
        while self.next < done {
            self.next = self.next.saturating_mul(2);
        }
        self
    }

    /// At most `more` rounds after `done` of them, and none past the next look.
    pub(super) fn until_next(&self, done: u64, more: u64) -> u64 {
        match self.target {
            Some(_) => more.min(self.next - done),
            None => more,
        }
    }

    /// After `done` rounds: looks if a look is due. True when the target is met.
    pub(super) fn met(&mut self, done: u64, error: impl FnOnce() -> ErrorSummary) -> bool {
        let Some(target) = self.target.filter(|_| done == self.next) else {
            return false;
        };
        let relative = error().relative;
        self.next = done.saturating_mul(2);
        self.last = Some((done, relative));
        relative <= target
    }

    /// Part of the way to the target after `done` rounds, as the last look has it: the error falls as 1/√rounds.
    pub(super) fn fraction(&self, done: u64) -> f64 {
        match (self.target, self.last) {
            (Some(target), Some((at, relative))) if relative > 0.0 => {
                (done as f64 / at as f64 * (target / relative).powi(2)).min(1.0)
            }
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_doubled_rounds_are_looked_at() {
        let mut looks = Looks::new(Some(0.1), 1);
        let (mut done, mut seen) = (0, Vec::new());
        loop {
            let more = looks.until_next(done, 3);
            assert!((1..=3).contains(&more));
            done += more;
            let met = looks.met(done, || {
                seen.push(done);
                ErrorSummary {
                    relative: 1.0 / done as f64,
                    black_pixels: 0,
                    degrees_of_freedom: 15,
                }
            });
            if met {
                break;
            }
        }
        assert_eq!((done, seen), (16, vec![1, 2, 4, 8, 16]));
        let mut looks = Looks::new(None, 1);
        assert_eq!(looks.until_next(0, 77), 77);
        assert!(!looks.met(1, || unreachable!("no target, no look")));
    }
}
