//! How long a render will take to an error, from short pilots.
//!
//! A render states a relative error e after R rounds; e²·R settles to a constant V of scene and settings. Pilots of other
//! seeds tell V, one value each, and their spread tells how far the render's own V may lie from their mean: Student's t in
//! ln V, with the variance of one more value added to that of the mean. A render with `--target-error` looks after 1, 2, 4,
//! 8 … rounds (from 16 on for samples), so it ends at the first power of two that is V/target² at least.

use super::interval::{Interval, Mean, t_quantile};
use serde::Serialize;

/// Probability with which a prediction is to hold.
pub const CONFIDENCE: f64 = 0.9;

/// What a pilot of some rounds stated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pilot {
    /// Rounds.
    pub rounds: u64,
    /// Relative error.
    pub error: f64,
}

/// V by the pilots.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Forecast {
    /// e²·R with the interval in which the render's own will lie.
    pub variance: Interval,
    /// Pilots it rests on.
    pub pilots: usize,
}

/// V from pilots; `None` for fewer than three that could tell their error.
///
/// Pilots of different lengths show a drift where rare bright paths are found only in time, or chains start far from where
/// they belong; what the drift would be over as many doublings again widens the interval on its side.
pub fn forecast(pilots: &[Pilot]) -> Option<Forecast> {
    let logs = |p: &[Pilot]| -> Vec<f64> {
        let each = p.iter().map(|p| (p.error * p.error * p.rounds as f64).ln());
        each.filter(|v| v.is_finite()).collect()
    };
    let longest = pilots.iter().map(|p| p.rounds).max()?;
    let (long, short): (Vec<Pilot>, Vec<Pilot>) = pilots.iter().partition(|p| p.rounds == longest);
    let (long, short) = (logs(&long), logs(&short));
    if long.len() < 3 {
        return None;
    }
    let m = Mean::of(&long);
    let n = long.len() as f64;
    let half = t_quantile(m.freedom, CONFIDENCE) * (m.variance * (n + 1.0)).sqrt();
    let drift = if short.len() < 3 {
        0.0
    } else {
        m.value - Mean::of(&short).value
    };
    let interval = Interval {
        value: m.value,
        low: m.value - half + drift.min(0.0),
        high: m.value + half + drift.max(0.0),
    };
    Some(Forecast {
        variance: interval.map(f64::exp),
        pilots: long.len(),
    })
}

impl Forecast {
    /// Rounds after which a render that looks at doubled rounds from `first` on ends.
    pub fn rounds_for(&self, target: f64, first: u64) -> Interval {
        let look = |v: f64| {
            let needed = (v / (target * target)).max(first as f64);
            2f64.powf(needed.log2().ceil())
        };
        self.variance.map(look)
    }

    /// Relative error after some rounds.
    pub fn error_after(&self, rounds: f64) -> Interval {
        self.variance.map(|v| (v / rounds).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pilots(rounds: u64, squares: &[f64]) -> Vec<Pilot> {
        let of = |v: &f64| Pilot {
            rounds,
            error: (v / rounds as f64).sqrt(),
        };
        squares.iter().map(of).collect()
    }

    #[test]
    fn looks_are_powers_of_two() {
        let f = forecast(&pilots(16, &[4.0; 5])).expect("enough");
        assert!((f.variance.value - 4.0).abs() < 1e-12 && (f.variance.high - 4.0).abs() < 1e-9);
        // 4/0.1² = 400.
        assert_eq!(f.rounds_for(0.1, 1), Interval::exact(512.0));
        assert_eq!(f.rounds_for(0.9, 16), Interval::exact(16.0));
        assert!((f.error_after(400.0).value - 0.1).abs() < 1e-12);
        assert!(forecast(&pilots(16, &[4.0; 2])).is_none());
        assert!(forecast(&pilots(16, &[4.0, f64::NAN, 0.0])).is_none());
    }

    #[test]
    fn a_drift_widens_its_own_side() {
        let mut all = pilots(4, &[1.0, 1.1, 0.9]);
        all.extend(pilots(16, &[2.0, 2.2, 1.8]));
        let f = forecast(&all).expect("enough");
        let still = forecast(&pilots(16, &[2.0, 2.2, 1.8])).expect("enough");
        assert_eq!(
            (f.variance.value, f.variance.low),
            (still.variance.value, still.variance.low)
        );
        assert!(
            (f.variance.high / still.variance.high - 2.0).abs() < 0.02,
            "{f:?}"
        );
    }

    /// Of 2000 forecasts from five pilots of log-normal V, 90 of 100 hold the next V; a binomial's deviation is 0.7.
    #[test]
    fn forecasts_hold_as_often_as_they_say() {
        let mut rng = crate::sampling::Rng::new(5, 1000, 0, 0);
        let mut draw = || ((0..12).map(|_| rng.next_f64()).sum::<f64>() - 6.0) * 0.3;
        let inside = (0..2000)
            .filter(|_| {
                let v: Vec<f64> = (0..5).map(|_| draw().exp()).collect();
                let f = forecast(&pilots(8, &v)).expect("enough").variance;
                let next = draw().exp();
                f.low <= next && next <= f.high
            })
            .count();
        assert!((1740..=1860).contains(&inside), "{inside}");
    }
}
