//! What the chains did.

use crate::film::{self, Malformed, Reader, Writer};
use crate::mutation::Strategy;
use crate::path::{Fault, Tally};
use std::io;
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
    /// Most of its proposals that one chain rejected in a row, failed constructions counted.
    pub longest_run: u64,
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

    /// Writes the counters.
    pub fn save(&self, w: &mut Writer) -> io::Result<()> {
        for s in self.strategies {
            for v in [s.proposed, s.constructed, s.accepted, s.longest_run] {
                w.u64(v)?;
            }
        }
        save_tally(w, &self.tally)?;
        w.u64(self.longest_stay)
    }

    /// What [`Self::save`] wrote.
    pub fn read(r: &mut Reader) -> Result<Self, Malformed> {
        let mut all = Self::default();
        for s in &mut all.strategies {
            for v in [
                &mut s.proposed,
                &mut s.constructed,
                &mut s.accepted,
                &mut s.longest_run,
            ] {
                *v = counter(r)?;
            }
        }
        all.tally = read_tally(r)?;
        all.longest_stay = counter(r)?;
        Ok(all)
    }
}

/// Most that a counter read of a file may have reached, so that the counters of many files can be added.
const MOST: u64 = 1 << 60;

fn counter(r: &mut Reader) -> Result<u64, Malformed> {
    match r.u64()? {
        v if v <= MOST => Ok(v),
        v => Err(Malformed(format!("counts up to {v}"))),
    }
}

/// Writes the counters of a tally.
pub fn save_tally(w: &mut Writer, tally: &Tally) -> io::Result<()> {
    tally.words().into_iter().try_for_each(|v| w.u64(v))
}

/// What [`save_tally`] wrote.
pub fn read_tally(r: &mut Reader) -> Result<Tally, Malformed> {
    let mut words = [0; 7];
    for v in &mut words {
        *v = counter(r)?;
    }
    Ok(Tally::of_words(words))
}

impl AddAssign for ChainStats {
    fn add_assign(&mut self, o: Self) {
        for (a, b) in self.strategies.iter_mut().zip(o.strategies) {
            a.proposed += b.proposed;
            a.constructed += b.constructed;
            a.accepted += b.accepted;
            a.longest_run = a.longest_run.max(b.longest_run);
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
