//! Estimates with intervals: Student's t, Welch's degrees of freedom, the jackknife.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Probability with which an interval of a study is to hold the truth.
pub const CONFIDENCE: f64 = 0.95;

/// A value and the bounds between which the truth lies with the stated confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Best estimate.
    pub value: f64,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
}

impl Interval {
    /// Known without error.
    pub fn exact(value: f64) -> Self {
        Self::around(value, 0.0)
    }

    /// `value` ± `half`.
    pub fn around(value: f64, half: f64) -> Self {
        let (low, high) = (value - half, value + half);
        Self { value, low, high }
    }

    /// Both bounds and the value through a function that grows.
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let (value, low, high) = (f(self.value), f(self.low), f(self.high));
        Self { value, low, high }
    }
}

/// The t of a two-sided interval of the given confidence. Infinite without a degree of freedom.
pub fn t_quantile(freedom: f64, confidence: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, freedom) {
        Ok(t) if freedom > 0.0 => t.inverse_cdf(0.5 + 0.5 * confidence),
        _ => f64::INFINITY,
    }
}

/// A mean of independent values, its variance and its degrees of freedom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Variance of the mean; 0 for fewer than two values, whose `freedom` is 0.
    pub variance: f64,
    /// Degrees of freedom of the variance.
    pub freedom: f64,
}

impl Mean {
    /// Of equally good values.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let value = values.iter().sum::<f64>() / n;
        let square = values.iter().map(|v| (v - value).powi(2)).sum::<f64>();
        Self {
            value,
            variance: if n > 1.0 { square / (n - 1.0) / n } else { 0.0 },
            freedom: n - 1.0,
        }
    }

    /// A value whose jackknife replicates, each with one of the equally large parts left out, are `without`.
    pub fn jackknife(value: f64, without: &[f64]) -> Self {
        let n = without.len() as f64;
        let mean = without.iter().sum::<f64>() / n;
        let square = without.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        Self {
            value,
            variance: square * (n - 1.0) / n,
            freedom: n - 1.0,
        }
    }

    /// This minus an independent one, with Welch's degrees of freedom.
    pub fn minus(self, other: Self) -> Self {
        let variance = self.variance + other.variance;
        let part = |m: Self| match m.variance {
            0.0 => 0.0,
            v => v * v / m.freedom,
        };
        let spread = part(self) + part(other);
        Self {
            value: self.value - other.value,
            variance,
            freedom: if spread > 0.0 {
                variance * variance / spread
            } else {
                self.freedom.max(other.freedom)
            },
        }
    }

    /// The interval of Student's t at [`CONFIDENCE`].
    pub fn interval(self) -> Interval {
        self.interval_of(CONFIDENCE)
    }

    /// That of another confidence.
    pub fn interval_of(self, confidence: f64) -> Interval {
        let t = t_quantile(self.freedom, confidence);
        // Without spread and without a degree of freedom the interval is everything.
        let half = t * self.variance.sqrt();
        let half = if half.is_nan() { f64::INFINITY } else { half };
        Interval::around(self.value, half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// scipy-free: tabulated t of two-sided 95 %.
    #[test]
    fn quantiles_are_the_tables() {
        for (freedom, t) in [(1.0, 12.706), (3.0, 3.182), (15.0, 2.131), (1e6, 1.960)] {
            assert!((t_quantile(freedom, 0.95) - t).abs() < 5e-4, "{freedom}");
        }
        assert_eq!(t_quantile(0.0, 0.95), f64::INFINITY);
    }

    #[test]
    fn a_mean_and_its_jackknife_agree() {
        let v = [1.0, 2.0, 4.0, 9.0];
        let m = Mean::of(&v);
        // numpy: v.var(ddof=1)/4 = 38/3/4
        assert_eq!((m.value, m.freedom), (4.0, 3.0));
        assert!((m.variance - 38.0 / 12.0).abs() < 1e-12);
        let without = v.map(|x| (16.0 - x) / 3.0);
        let j = Mean::jackknife(4.0, &without);
        assert!((j.variance - m.variance).abs() < 1e-12);
        assert!(Mean::of(&[3.0]).interval().high.is_infinite());
        let d = m.minus(Mean::of(&[1.0, 1.0]));
        assert_eq!((d.value, d.variance), (3.0, m.variance));
        assert!((d.freedom - 3.0).abs() < 1e-12);
    }
}
