//! What the chains did.

use crate::film;
use crate::mutation::Strategy;
use crate::path::{Fault, Tally};
use std::ops::AddAssign;

/// One strategy's record.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrategyStats {
    /// Times it was chosen.
    pub proposed: u64,
    /// Times it made a path that carries light.
    pub constructed: u64,
    /// Times its proposal was accepted.
    pub accepted: u64,
}

/// Counters of chains.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChainStats {
    /// By strategy, in the order of [`Strategy::ALL`].
    pub strategies: [StrategyStats; Strategy::ALL.len()],
    /// Rays and faults.
    pub tally: Tally,
    /// Most rejections in a row of one chain.
    pub longest_stay: u64,
}

impl ChainStats {
    /// Steps made.
    pub fn steps(&self) -> u64 {
        self.strategies.iter().map(|s| s.proposed).sum()
    }
}

impl AddAssign for ChainStats {
    fn add_assign(&mut self, o: Self) {
        for (a, b) in self.strategies.iter_mut().zip(o.strategies) {
            a.proposed += b.proposed;
            a.constructed += b.constructed;
            a.accepted += b.accepted;
        }
        self.tally += o.tally;
        self.longest_stay = self.longest_stay.max(o.longest_stay);
    }
}

impl From<film::Fault> for Fault {
    fn from(f: film::Fault) -> Self {
        match f {
            film::Fault::NotANumber => Self::Nan,
            film::Fault::Negative => Self::Negative,
            film::Fault::TooLarge => Self::Infinite,
        }
    }
}
