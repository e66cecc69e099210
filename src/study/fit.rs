//! Curves of error against work: their slope, and the work a given error takes.
//!
//! An unbiased estimator's relative error is √(V/w), a line of slope −1/2 in logarithms. Where the measured slope lies
//! within one standard error of −1/2 it is taken to be that; else the line found is followed, and what it says beyond the
//! measured range is marked. (Within the whole interval would be too generous: the choice would cost coverage. But where
//! the slope is hardly known, what a free one says of times beyond is nothing.) A setting with a floor F follows V/w + F²
//! instead.

use super::interval::{CONFIDENCE, Interval, t_quantile};
use serde::{Deserialize, Serialize};

/// A slope whose interval is ± this or wider is hardly known: a line of two or three levels near a long start.
const HARDLY: f64 = 0.25;

/// A line through ln error over ln work.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Points it goes through.
    pub points: usize,
    /// Slope found, with its interval.
    pub slope: Interval,
    /// Slope used: −1/2 where that is within a standard error, or within an interval that hardly tells a slope.
    pub used: f64,
    /// Mean of ln work.
    x: f64,
    /// Mean of ln error.
    y: f64,
    /// Σ (ln work − mean)².
    sxx: f64,
    /// Standard deviation of a point about the line, in ln error.
    pub scatter: f64,
    freedom: f64,
    /// Least and most work measured.
    pub range: [f64; 2],
}

/// How much it takes to reach an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reach {
    /// Work, or seconds.
    pub needed: Interval,
    /// It lies outside what was measured.
    pub extrapolated: bool,
}

/// Fits points (work, relative error). `None` unless at least three points of two different works are finite and above 0.
pub fn fit(points: &[(f64, f64)]) -> Option<Fit> {
    let good = |(w, e): &&(f64, f64)| *w > 0.0 && *e > 0.0 && w.is_finite() && e.is_finite();
    let of: Vec<(f64, f64)> = points
        .iter()
        .filter(good)
        .map(|(w, e)| (w.ln(), e.ln()))
        .collect();
    let n = of.len() as f64;
    let (x, y) = (
        of.iter().map(|p| p.0).sum::<f64>() / n,
        of.iter().map(|p| p.1).sum::<f64>() / n,
    );
    let sxx: f64 = of.iter().map(|p| (p.0 - x).powi(2)).sum();
    if of.len() < 3 || sxx < 1e-9 {
        return None;
    }
    let free = of.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / sxx;
    let scatter = |slope: f64, freedom: f64| {
        let off = of.iter().map(|p| (p.1 - y - slope * (p.0 - x)).powi(2));
        (off.sum::<f64>() / freedom).sqrt()
    };
    let se = scatter(free, n - 2.0) / sxx.sqrt();
    let half = t_quantile(n - 2.0, CONFIDENCE) * se;
    let off = (free + 0.5).abs();
    let fixed = off <= se.max(1e-9) || (half > HARDLY && off <= half);
    let (used, freedom) = if fixed {
        (-0.5, n - 1.0)
    } else {
        (free, n - 2.0)
    };
    let ends = |f: fn(f64, f64) -> f64, from| of.iter().map(|p| p.0).fold(from, f).exp();
    Some(Fit {
        points: of.len(),
        slope: Interval::around(free, half),
        used,
        x,
        y,
        sxx,
        scatter: scatter(used, freedom),
        freedom,
        range: [
            ends(f64::min, f64::INFINITY),
            ends(f64::max, f64::NEG_INFINITY),
        ],
    })
}

impl Fit {
    /// Error at some work, with the interval of the line there (not of a single image).
    pub fn error_at(&self, work: f64) -> Interval {
        let d = work.ln() - self.x;
        Interval::around(self.y + self.used * d, self.half(d)).map(f64::exp)
    }

    /// Half the interval of the line at a distance from the mean of ln work.
    fn half(&self, d: f64) -> f64 {
        let lever = if self.used == -0.5 {
            0.0
        } else {
            d * d / self.sxx
        };
        let se = self.scatter * (1.0 / self.points as f64 + lever).sqrt();
        t_quantile(self.freedom, CONFIDENCE) * se
    }

    /// Work at which the line reaches an error; `None` if it does not fall.
    pub fn work_for(&self, error: f64) -> Option<Reach> {
        if self.used >= -1e-3 {
            return None;
        }
        let d = (error.ln() - self.y) / self.used;
        let end = self.range[1].ln() - self.x;
        if self.used < -0.5 && d > end {
            // Steeper than √work is a start that is left behind; from the last measurement on, −1/2 is all there is.
            let at_end = self.y + self.used * end;
            let further = self.x + end + 2.0 * (at_end - error.ln());
            let half = 2.0 * self.half(end);
            return Some(self.reach(Interval::around(further, half).map(f64::exp)));
        }
        let half = self.half(d) / self.used.abs();
        Some(self.reach(Interval::around(self.x + d, half).map(f64::exp)))
    }

    /// The same for a setting whose squared error is `variance`/work + `floor_square`. The interval takes the scatter of the
    /// points for that of the variance. `None` where the error lies below the floor.
    pub fn work_above(&self, error: f64, variance: f64, floor_square: f64) -> Option<Reach> {
        let left = error * error - floor_square;
        if left <= 0.0 {
            return None;
        }
        let half = 2.0 * self.half(0.0);
        let needed = Interval::around((variance / left).ln(), half).map(f64::exp);
        Some(self.reach(needed))
    }

    fn reach(&self, needed: Interval) -> Reach {
        // Doubling budgets leave no gap inside; a per cent for the rounding of the ends.
        let [least, most] = self.range;
        let inside = needed.value >= 0.99 * least && needed.value <= 1.01 * most;
        Reach {
            needed,
            extrapolated: !inside,
        }
    }
}

/// Pilots at most: after so many the last does at least 2⁵ times the first's work.
const PILOTS: usize = 6;

/// Seconds of a quick pilot.
const QUICK: f64 = 2.0;

/// Seconds that some work takes: a start that does not depend on it, and so much for each unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    /// Seconds before the first unit.
    pub start: f64,
    /// Seconds a unit.
    pub each: f64,
}

impl Pace {
    /// Through points (work, seconds), each weighted by 1/seconds²: a clock errs in proportion.
    pub fn of(points: &[(f64, f64)]) -> Self {
        let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|(w, t)| f(*w, *t)).sum::<f64>();
        let (s, sw, sww) = (
            sum(&|_, t| 1.0 / (t * t)),
            sum(&|w, t| w / (t * t)),
            sum(&|w, t| w * w / (t * t)),
        );
        let (st, swt) = (sum(&|_, t| 1.0 / t), sum(&|w, t| w / t));
        let det = s * sww - sw * sw;
        let (start, each) = if det > 1e-9 * s * sww {
            ((st * sww - swt * sw) / det, (s * swt - sw * st) / det)
        } else {
            (0.0, swt / sww)
        };
        if start >= 0.0 && each > 0.0 {
            Self { start, each }
        } else {
            // Times that grow faster than the work, or fall: the clock was disturbed. All of it is taken to be work.
            Self {
                start: 0.0,
                each: swt / sww,
            }
        }
    }

    /// Work of the next pilot, given work and seconds of those made; `None` when they tell the pace: they have lasted `least`
    /// seconds together, and the last took twice as long as the first, so that what work costs stands out of the start.
    pub fn next_pilot(made: &[(f64, f64)], least: f64) -> Option<f64> {
        let (Some(&(_, first)), Some(&(work, last))) = (made.first(), made.last()) else {
            return Some(1.0);
        };
        let lasted = made.iter().map(|(_, t)| t).sum::<f64>();
        let told = made.len() >= 2 && lasted >= least && last >= 2.0 * first;
        // A start does not hide the work of quick ones for long.
        let hidden = last < 2.0 * first && last < QUICK;
        let growth = if hidden { 8.0 } else { 2.0 };
        let next = work * (least / last).clamp(growth, 64.0);
        (!told && made.len() < PILOTS).then(|| next.floor())
    }

    /// Seconds for some work.
    pub fn seconds(&self, work: f64) -> f64 {
        self.start + self.each * work
    }

    /// Work done in some seconds; 0 if they do not get past the start.
    pub fn work(&self, seconds: f64) -> f64 {
        ((seconds - self.start) / self.each).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(rng: &mut crate::sampling::Rng) -> f64 {
        // Sum of 12 uniforms: near normal, of variance 1.
        (0..12).map(|_| rng.next_f64()).sum::<f64>() - 6.0
    }

    fn points(slope: f64, scatter: f64, seed: u64) -> Vec<(f64, f64)> {
        let mut rng = crate::sampling::Rng::new(seed, 1000, 0, 0);
        (0..20)
            .map(|i| {
                let w = 2f64.powi(i % 5);
                (w, 0.3 * w.powf(slope) * (scatter * noise(&mut rng)).exp())
            })
            .collect()
    }

    /// A start of a second, work of a hundredth: pilots go on until the work is seen.
    #[test]
    fn pilots_go_on_until_work_stands_out_of_the_start() {
        let mut made = Vec::new();
        while let Some(work) = Pace::next_pilot(&made, 0.5) {
            made.push((work, 1.0 + 0.01 * work));
        }
        let works: Vec<f64> = made.iter().map(|p| p.0).collect();
        assert_eq!(works, [1.0, 8.0, 64.0, 512.0]);
        // Without a start as many as fill the time.
        made.clear();
        while let Some(work) = Pace::next_pilot(&made, 0.5) {
            made.push((work, 0.01 * work));
        }
        assert_eq!(made.last(), Some(&(50.0, 0.5)));
        // Long ones only double.
        made.clear();
        while let Some(work) = Pace::next_pilot(&made, 0.5) {
            made.push((work, 3.0 + work));
        }
        let works: Vec<f64> = made.iter().map(|p| p.0).collect();
        assert_eq!(works, [1.0, 2.0, 4.0, 8.0]);
        // A clock that stands still ends it too.
        made.clear();
        while let Some(work) = Pace::next_pilot(&made, 0.5) {
            made.push((work, 1.0));
        }
        assert_eq!(made.len(), PILOTS);
    }

    /// Two levels a factor of three apart, four noisy images each: a free slope would be wild.
    #[test]
    fn a_slope_that_is_hardly_known_is_the_one_of_noise() {
        let errors = [0.75, 0.38, 0.5, 0.36, 0.45, 0.3, 0.48, 0.42];
        let works = [1.0, 1.0, 1.0, 1.0, 3.0, 3.0, 3.0, 3.0];
        let of: Vec<(f64, f64)> = works.into_iter().zip(errors).collect();
        let f = fit(&of).expect("a line");
        let half = 0.5 * (f.slope.high - f.slope.low);
        assert!(half > HARDLY && (f.slope.value + 0.5).abs() > half / 3.0);
        assert_eq!(f.used, -0.5);
        // Far from it the slope is followed, however wide.
        let steep: Vec<(f64, f64)> = of.iter().map(|(w, e)| (*w, e * w)).collect();
        assert_ne!(fit(&steep).expect("a line").used, -0.5);
    }

    #[test]
    fn an_exact_curve_is_found_exactly() {
        let f = fit(&points(-0.5, 0.0, 1)).expect("a line");
        assert!((f.slope.value + 0.5).abs() < 1e-12 && f.scatter < 1e-12);
        let r = f.work_for(0.1).expect("it falls");
        assert!(
            (r.needed.value - 9.0).abs() < 1e-9 && !r.extrapolated,
            "{r:?}"
        );
        let r = f.work_for(0.01).expect("it falls");
        assert!(
            (r.needed.value - 900.0).abs() < 1e-6 && r.extrapolated,
            "{r:?}"
        );
        assert!((f.error_at(900.0).value - 0.01).abs() < 1e-9);
        // 0.09/w + 0.04² at 5 %: w = 0.09/(0.0025 − 0.0016) = 100; never below 4 %.
        let r = f.work_above(0.05, 0.09, 0.0016).expect("above the floor");
        assert!((r.needed.value - 100.0).abs() < 1e-9);
        assert!(f.work_above(0.03, 0.09, 0.0016).is_none());
        let f = fit(&points(-0.3, 0.0, 1)).expect("a line");
        assert!((f.used + 0.3).abs() < 1e-12);
        // Slope −1 up to a work of 16, where the error is 0.3/16; half of that takes four times the work, not twice.
        let f = fit(&points(-1.0, 0.0, 1)).expect("a line");
        let r = f.work_for(0.3 / 32.0).expect("it falls");
        assert!(
            (r.needed.value - 64.0).abs() < 1e-6 && r.extrapolated,
            "{r:?}"
        );
        assert!((f.work_for(0.3 / 8.0).expect("it falls").needed.value - 8.0).abs() < 1e-9);
        assert!(fit(&points(-0.5, 0.0, 1)[..2]).is_none());
        assert!(fit(&[(1.0, 0.1), (1.0, 0.2), (1.0, 0.1)]).is_none());
        assert!(fit(&[(1.0, 0.1), (2.0, f64::NAN), (4.0, 0.0)]).is_none());
        assert!(
            fit(&points(0.0, 0.0, 1))
                .expect("a line")
                .work_for(0.1)
                .is_none()
        );
    }

    /// Of 200 noisy curves the intervals of slope and of the work for an error should hold the truth in 95 of 100 cases;
    /// near −1/2 the choice of the slope costs the work some of that. 177 is what a binomial of 95 % stays above with
    /// probability 0.9995; intervals too short by a third (81 %) are found in 99 of 100 cases.
    #[test]
    fn intervals_hold_as_often_as_they_say() {
        for slope in [-0.5, -0.45, -0.35] {
            let (mut slopes, mut works) = (0, 0);
            for seed in 0..200 {
                let f = fit(&points(slope, 0.2, seed)).expect("a line");
                let holds = |i: Interval, v: f64| u32::from(i.low <= v && v <= i.high);
                slopes += holds(f.slope, slope);
                let truth = (0.3f64 / 0.08).powf(-1.0 / slope);
                works += holds(f.work_for(0.08).expect("it falls").needed, truth);
            }
            println!("slope {slope}: {slopes} slopes, {works} works of 200");
            assert!(slopes >= 177 && works >= 177, "{slope}: {slopes} {works}");
        }
    }

    #[test]
    fn a_pace_has_a_start() {
        let p = Pace::of(&[(1.0, 0.6), (2.0, 0.7), (10.0, 1.5)]);
        assert!(
            (p.start - 0.5).abs() < 1e-9 && (p.each - 0.1).abs() < 1e-9,
            "{p:?}"
        );
        assert!((p.seconds(20.0) - 2.5).abs() < 1e-9 && (p.work(2.5) - 20.0).abs() < 1e-6);
        assert_eq!(p.work(0.1), 0.0);
        // One point: no start can be told.
        let p = Pace::of(&[(4.0, 2.0)]);
        assert_eq!((p.start, p.each), (0.0, 0.5));
        // Faster than proportional: no start below 0.
        let p = Pace::of(&[(1.0, 0.1), (2.0, 0.4)]);
        assert_eq!(p.start, 0.0);
        assert!(p.each > 0.1 && p.each < 0.2);
        let p = Pace::of(&[(1.0, 0.4), (2.0, 0.1)]);
        assert!(p.start == 0.0 && p.each > 0.05 && p.each < 0.4, "{p:?}");
    }
}
