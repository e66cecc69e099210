//! Sums, standard errors and the comparison of many of them at once.

use statrs::distribution::{ContinuousCDF, Normal};

/// Probability that a test of many comparisons fails though all is well (the seeds are fixed, so this is about changes
/// to the order of random numbers).
const LEVEL: f64 = 1e-3;

/// Sums of a statistic that most samples do not touch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moments {
    sum: f64,
    square: f64,
    magnitude: f64,
}

impl Moments {
    pub(super) fn add(&mut self, v: f64) {
        self.add_sized(v, v.abs());
    }

    /// `size` ≥ |v|: what the sample moved in either direction.
    pub(super) fn add_sized(&mut self, v: f64, size: f64) {
        self.sum += v;
        self.square += v * v;
        self.magnitude += size;
    }

    pub(super) fn mean(&self, n: f64) -> f64 {
        self.sum / n
    }

    /// Variance of the mean of n samples.
    pub(super) fn variance(&self, n: f64) -> f64 {
        (self.square / n - self.mean(n).powi(2)).max(0.0) / (n - 1.0)
    }

    /// Mean of what was moved in either direction.
    pub(super) fn size(&self, n: f64) -> f64 {
        self.magnitude / n
    }

    /// Number of equal contributions that would be as noisy: a normal law may be assumed from some dozens on.
    pub(super) fn effective(&self) -> f64 {
        self.magnitude.powi(2) / self.square.max(f64::MIN_POSITIVE)
    }
}

/// Contributions below which a mean is not taken for normal. At 200 equal contributions the skewness of their sum,
/// 1/√200 = 0.07, moves the tail probability at z = 4.5 by a factor of about exp(0.07·4.5³/6) ≈ 3.
pub(super) const ENOUGH: f64 = 200.0;

/// One of the comparisons.
#[derive(Clone, Debug)]
pub(super) struct Compared {
    pub(super) what: String,
    /// Difference from what is expected.
    pub(super) difference: f64,
    /// Its standard error.
    pub(super) error: f64,
    /// What the difference is a part of.
    pub(super) scale: f64,
}

/// What came of many comparisons.
#[derive(Clone, Debug)]
pub(super) struct Verdict {
    /// |z| beyond which one of them fails.
    pub(super) limit: f64,
    pub(super) all: Vec<Compared>,
}

impl Verdict {
    /// Two-sided z-tests with Šidák's correction.
    pub(super) fn new(all: Vec<Compared>) -> Self {
        assert!(!all.is_empty(), "nothing was compared");
        let each = 1.0 - (1.0 - LEVEL).powf(1.0 / all.len() as f64);
        let limit = Normal::standard().inverse_cdf(1.0 - 0.5 * each);
        Self { limit, all }
    }

    /// Fails if one of the comparisons does, or if an error of `least` in `family` would go unseen.
    pub(super) fn judge(all: Vec<Compared>, family: &str, least: f64) {
        let v = Self::new(all);
        println!("{}", v.report());
        assert!(v.passes(), "{}", v.report());
        let found = v.detects(family);
        println!("detects {found}");
        assert!(found < least, "{found}");
    }

    fn z(c: &Compared) -> f64 {
        (c.difference / c.error).abs()
    }

    pub(super) fn passes(&self) -> bool {
        self.all.iter().all(|c| Self::z(c) <= self.limit)
    }

    /// Smallest relative error that is found with probability 97.5 % in the best-measured comparison whose name begins
    /// with `family`.
    pub(super) fn detects(&self, family: &str) -> f64 {
        self.all
            .iter()
            .filter(|c| c.what.starts_with(family))
            .map(|c| (self.limit + 1.96) * c.error / c.scale)
            .fold(f64::INFINITY, f64::min)
    }

    /// The worst comparisons, for a message.
    pub(super) fn report(&self) -> String {
        let mut worst: Vec<_> = self.all.iter().collect();
        worst.sort_by(|a, b| Self::z(b).total_cmp(&Self::z(a)));
        let lines: Vec<String> = worst
            .iter()
            .take(8)
            .map(|c| {
                format!(
                    "  {}: z = {:.2}, relative difference {:.4}, detectable {:.4}",
                    c.what,
                    Self::z(c),
                    c.difference / c.scale,
                    (self.limit + 1.96) * c.error / c.scale
                )
            })
            .collect();
        format!(
            "{} comparisons, limit {:.2}\n{}",
            self.all.len(),
            self.limit,
            lines.join("\n")
        )
    }
}
