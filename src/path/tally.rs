//! Counts of what was done and of what went wrong. One per thread, summed at the end.

use serde::Serialize;
use std::ops::AddAssign;

/// A value that cannot be, or that had to be dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A NaN in a contribution or ratio.
    Nan,
    /// A negative contribution or ratio.
    Negative,
    /// An infinite contribution or ratio.
    Infinite,
    /// A path was made whose density comes out as zero.
    ZeroDensity,
}

/// Counters of one thread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// Closest-hit queries.
    pub rays_closest: u64,
    /// Visibility queries.
    pub rays_visibility: u64,
    /// Hits whose recomputation fell just outside the named triangle and was put on its edge. Benign.
    pub hits_clamped: u64,
    /// See [`Fault::Nan`].
    pub fault_nan: u64,
    /// See [`Fault::Negative`].
    pub fault_negative: u64,
    /// See [`Fault::Infinite`].
    pub fault_infinite: u64,
    /// See [`Fault::ZeroDensity`].
    pub fault_zero_density: u64,
}

impl Tally {
    /// Counts a fault.
    #[cold]
    pub fn fault(&mut self, f: Fault) {
        match f {
            Fault::Nan => self.fault_nan += 1,
            Fault::Negative => self.fault_negative += 1,
            Fault::Infinite => self.fault_infinite += 1,
            Fault::ZeroDensity => self.fault_zero_density += 1,
        }
    }

    /// True if `v` is a finite number ≥ 0; otherwise the fault is counted.
    #[inline]
    pub fn check(&mut self, v: f64) -> bool {
        if (0.0..f64::INFINITY).contains(&v) {
            return true;
        }
        self.fault(if v.is_nan() {
            Fault::Nan
        } else if v < 0.0 {
            Fault::Negative
        } else {
            Fault::Infinite
        });
        false
    }

    /// All counters, for a file.
    pub fn words(&self) -> [u64; 7] {
        [
            self.rays_closest,
            self.rays_visibility,
            self.hits_clamped,
            self.fault_nan,
            self.fault_negative,
            self.fault_infinite,
            self.fault_zero_density,
        ]
    }

    /// The counters that [`Self::words`] gave.
    pub fn of_words(words: [u64; 7]) -> Self {
        let [closest, visibility, clamped, nan, negative, infinite, zero] = words;
        Self {
            rays_closest: closest,
            rays_visibility: visibility,
            hits_clamped: clamped,
            fault_nan: nan,
            fault_negative: negative,
            fault_infinite: infinite,
            fault_zero_density: zero,
        }
    }

    /// What was counted since `before`.
    pub fn since(&self, before: &Self) -> Self {
        Self {
            rays_closest: self.rays_closest - before.rays_closest,
            rays_visibility: self.rays_visibility - before.rays_visibility,
            hits_clamped: self.hits_clamped - before.hits_clamped,
            fault_nan: self.fault_nan - before.fault_nan,
            fault_negative: self.fault_negative - before.fault_negative,
            fault_infinite: self.fault_infinite - before.fault_infinite,
            fault_zero_density: self.fault_zero_density - before.fault_zero_density,
        }
    }

    /// Faults that must not happen: the run then ends with the integrity exit code.
    pub fn impossible(&self) -> u64 {
        self.fault_nan + self.fault_negative + self.fault_infinite + self.fault_zero_density
    }
}

impl AddAssign for Tally {
    fn add_assign(&mut self, o: Self) {
        self.rays_closest += o.rays_closest;
        self.rays_visibility += o.rays_visibility;
        self.hits_clamped += o.hits_clamped;
        self.fault_nan += o.fault_nan;
        self.fault_negative += o.fault_negative;
        self.fault_infinite += o.fault_infinite;
        self.fault_zero_density += o.fault_zero_density;
    }
}
