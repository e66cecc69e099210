//! Means with their errors, and how far off a mean may be when many are looked at.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Probability that a correct program fails a test.
const ALPHA: f64 = 1e-3;

/// Two-sided limit of Student's t, by Šidák for `comparisons` at once.
pub fn threshold(comparisons: usize, freedom: f64) -> f64 {
    let each = -((-ALPHA).ln_1p() / comparisons as f64).exp_m1();
    StudentsT::new(0.0, 1.0, freedom)
        .unwrap()
        .inverse_cdf(1.0 - each / 2.0)
}

/// Running mean and variance (Welford).
#[derive(Clone, Copy, Default)]
pub struct Moments {
    n: f64,
    mean: f64,
    square: f64,
}

impl Moments {
    pub fn add(&mut self, v: f64) {
        self.n += 1.0;
        let d = v - self.mean;
        self.mean += d / self.n;
        self.square += d * (v - self.mean);
    }

    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Standard error of the mean.
    pub fn error(&self) -> f64 {
        (self.square / (self.n - 1.0) / self.n).sqrt()
    }
}
