//! Estimates with their errors, and families of comparisons between them.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Probability that a family of comparisons of a correct renderer fails.
pub const LEVEL: f64 = 0.01;

/// Probability with which a bias of the stated size is to be found.
const POWER: f64 = 0.9;

/// A mean with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub mean: f64,
    /// Variance of the mean.
    pub variance: f64,
    /// Degrees of freedom of the variance.
    pub freedom: f64,
}

impl Estimate {
    /// From independent values of equal distribution.
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let n = values.clone().count() as f64;
        assert!(n > 1.0, "one value says nothing of its error");
        let mean = values.clone().sum::<f64>() / n;
        let square = values.map(|v| (v - mean).powi(2)).sum::<f64>();
        Self {
            mean,
            variance: square / (n - 1.0) / n,
            freedom: n - 1.0,
        }
    }

    /// Known beforehand.
    pub fn exact(mean: f64) -> Self {
        Self {
            mean,
            variance: 0.0,
            freedom: f64::INFINITY,
        }
    }
}

/// Two estimates of what should be one number.
pub struct Pair {
    pub name: String,
    pub found: Estimate,
    pub reference: Estimate,
    /// Relative bias that has to be detectable here; infinite where only agreement is asked for.
    pub limit: f64,
}

/// Compares all pairs by Welch's t at the level that Šidák's correction leaves to each, so that all together fail a
/// correct renderer with probability [`LEVEL`]. Fails too where a bias of `limit` would be found with less than 90 %
/// probability: a test that passes because its reference is noise is no test. Returns the largest detectable bias.
pub fn agree(what: &str, pairs: &[Pair]) -> f64 {
    let each = 1.0 - (1.0 - LEVEL).powf(1.0 / pairs.len() as f64);
    let reach = Normal::standard().inverse_cdf(POWER);
    let mut wrong = Vec::new();
    let mut worst = 0.0f64;
    println!(
        "{what}: {} comparisons, each at level {each:.1e}",
        pairs.len()
    );
    for p in pairs {
        let (a, b) = (p.found, p.reference);
        let variance = a.variance + b.variance;
        if variance == 0.0 {
            if (a.mean - b.mean).abs() > 1e-6 * b.mean.abs() {
                wrong.push(format!("{}: {} is not {}", p.name, a.mean, b.mean));
            }
            continue;
        }
        let freedom =
            variance.powi(2) / (a.variance.powi(2) / a.freedom + b.variance.powi(2) / b.freedom);
        let critical = StudentsT::new(0.0, 1.0, freedom)
            .expect("positive degrees of freedom")
            .inverse_cdf(1.0 - each / 2.0);
        let se = variance.sqrt();
        let t = (a.mean - b.mean) / se;
        let detectable = (critical + reach) * se / b.mean.abs();
        let line = format!(
            "{}: {:.5e} against {:.5e}, t = {t:.2} (limit {critical:.2}), detects {:.2} %",
            p.name,
            a.mean,
            b.mean,
            detectable * 100.0
        );
        println!("  {line}");
        worst = worst.max(detectable);
        if t.abs() > critical {
            wrong.push(line);
        } else if detectable.is_nan() || detectable > p.limit {
            wrong.push(format!("{line}, which is more than {} %", p.limit * 100.0));
        }
    }
    assert!(wrong.is_empty(), "{what}:\n{}", wrong.join("\n"));
    worst
}
