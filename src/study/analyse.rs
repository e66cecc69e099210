//! From points to answers: a setting's curve, noise, bias, floor and efficiency.

use super::decompose::{Parts, Sample, average, decompose};
use super::fit::{Fit, Pace, Reach, fit};
use super::flip::{auto_gain, flip};
use super::interval::{Interval, Mean};
use super::metrics::compare;
use super::record::{Clock, Point};
use super::reference::{Reference, luminances};
use crate::output::Image;
use serde::Serialize;

/// Relative errors whose price is told.
pub const TARGETS: [f64; 4] = [0.1, 0.05, 0.02, 0.01];

/// Errors of one image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Relative root-mean-square error in luminance against the reference as it is.
    pub rel_rms: f64,
    /// The same with the reference's own noise taken out; `None` where that leaves nothing.
    pub rel_rms_net: Option<f64>,
    /// Mean signed difference, relative.
    pub bias: f64,
    /// relMSE, ε = 0.01.
    pub rel_mse: f64,
    /// Veach's relative l1.
    pub l1: f64,
    /// Veach's relative l2.
    pub l2: f64,
    /// Veach's relative l∞.
    pub l_inf: f64,
    /// MAPE, ε = 0.01.
    pub mape: f64,
    /// Mean ꟻLIP, both images brightened alike.
    pub flip: f64,
}

/// A point with its errors.
#[derive(Clone, Debug, Serialize)]
pub struct Judged {
    /// The point.
    #[serde(flatten)]
    pub point: Point,
    /// Level of its budget, 0 the lowest.
    pub level: usize,
    /// Its errors.
    pub errors: Errors,
    /// Luminance of its pixels.
    #[serde(skip)]
    pub luminance: Vec<f32>,
}

impl Judged {
    /// Judges an image of the reference's size.
    pub fn new(point: Point, level: usize, image: &Image, reference: &Reference) -> Self {
        let c = compare(image, &reference.image).expect("one size");
        let net = c.rel_rms.powi(2) - reference.noise().powi(2);
        // Below half the reference's noise the difference is mostly that of two estimates.
        let told = net > 0.25 * reference.noise().powi(2);
        let errors = Errors {
            rel_rms: c.rel_rms,
            rel_rms_net: told.then(|| net.sqrt()),
            bias: c.bias,
            rel_mse: c.rel_mse,
            l1: c.l1,
            l2: c.l2,
            l_inf: c.l_inf,
            mape: c.mape,
            flip: flip(image, &reference.image, auto_gain(&reference.image)).expect("one size"),
        };
        let luminance = luminances(image).into_iter().map(|v| v as f32).collect();
        Self {
            point,
            level,
            errors,
            luminance,
        }
    }
}

/// What the points of a setting say together.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Summary {
    /// Rounds to seconds.
    pub pace: Pace,
    /// The curve of `rel_rms_net` against rounds.
    pub fit: Option<Fit>,
    /// Noise and bias.
    pub parts: Option<Parts>,
    /// Seconds to reach each of [`TARGETS`]; `None` where it never does, as far as can be told.
    pub reach: [Option<Reach>; TARGETS.len()],
    /// 1/(squared relative error · seconds) at the highest level.
    pub efficiency: Option<Interval>,
    /// What the renders claim over what was found, geometric mean of the points.
    pub claim: Option<Interval>,
}

/// Sums up the points of a setting.
pub fn summarise(points: &[&Judged], reference: &Reference, clock: Clock) -> Summary {
    if points.is_empty() {
        return Summary::default();
    }
    let work = |j: &Judged| j.point.rounds as f64;
    let times: Vec<(f64, f64)> = points
        .iter()
        .map(|j| (work(j), j.point.seconds(clock)))
        .collect();
    let pace = Pace::of(&times);
    let curve = points
        .iter()
        .filter_map(|j| j.errors.rel_rms_net.map(|e| (work(j), e)));
    let fit = fit(&curve.collect::<Vec<_>>());
    let luminance: Vec<Vec<f64>> = points
        .iter()
        .map(|j| j.luminance.iter().map(|v| f64::from(*v)).collect())
        .collect();
    let samples: Vec<Sample> = points
        .iter()
        .zip(&luminance)
        .map(|(j, l)| Sample {
            luminance: l,
            work: work(j),
            repeat: j.point.repeat,
        })
        .collect();
    let parts = decompose(&samples, &reference.truth);
    let floor = parts.and_then(|p| p.floor());
    let reach = TARGETS.map(|e| {
        let reach = match (floor, parts, fit) {
            (Some(f), Some(p), Some(fit)) => fit.work_above(e, p.variance, f.value.powi(2)),
            (_, _, Some(fit)) => fit.work_for(e),
            _ => None,
        }?;
        let needed = reach.needed.map(|w| pace.seconds(w));
        Some(Reach { needed, ..reach })
    });
    let most = points.iter().map(|j| work(j)).fold(0.0, f64::max);
    let efficiency = fit.map(|f| {
        let e = f.error_at(most);
        let of = |e: f64| 1.0 / (e * e * pace.seconds(most));
        Interval {
            value: of(e.value),
            low: of(e.high),
            high: of(e.low),
        }
    });
    let claims: Vec<f64> = points
        .iter()
        .filter_map(|j| Some((j.point.claimed? / j.errors.rel_rms_net?).ln()))
        .filter(|v| v.is_finite())
        .collect();
    let claim = (claims.len() > 1).then(|| Mean::of(&claims).interval().map(f64::exp));
    Summary {
        pace,
        fit,
        parts,
        reach,
        efficiency,
        claim,
    }
}

impl Summary {
    /// Expected error after some seconds.
    pub fn error_after(&self, seconds: f64) -> Option<Interval> {
        let work = self.pace.work(seconds);
        let f = self.fit.filter(|_| work > 0.0)?;
        Some(f.error_at(work))
    }
}

/// Indices of the (seconds, error) pairs that no other one beats in both, by growing time.
pub fn pareto(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| {
        let (a, b) = (points[*a], points[*b]);
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let mut best = f64::INFINITY;
    order.retain(|i| {
        let better = points[*i].1 < best;
        best = best.min(points[*i].1);
        better
    });
    order
}

/// Geometric mean with its interval; `None` for values that have no logarithm.
pub fn geometric(values: &[f64]) -> Option<Interval> {
    let logs: Vec<f64> = values.iter().map(|v| v.ln()).collect();
    let fine = !logs.is_empty() && logs.iter().all(|v| v.is_finite());
    fine.then(|| match logs.len() {
        1 => Interval::exact(logs[0]).map(f64::exp),
        _ => Mean::of(&logs).interval().map(f64::exp),
    })
}

/// Mean luminance of the reference.
pub fn brightness(reference: &Reference) -> f64 {
    average(&reference.truth.luminance())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_keeps_what_nothing_beats() {
        let points = [
            (1.0, 0.5),
            (2.0, 0.6),
            (2.0, 0.3),
            (4.0, 0.3),
            (8.0, 0.1),
            (0.5, 0.9),
        ];
        assert_eq!(pareto(&points), [5, 0, 2, 4]);
        assert!(pareto(&[]).is_empty());
    }

    /// Images of known noise and floor, by way of all that a page says of them.
    #[test]
    fn a_setting_with_a_floor_is_summed_up() {
        const PIXELS: usize = 4096;
        let mut rng = crate::sampling::Rng::new(9, 1000, 0, 0);
        let flat = |v: f32| vec![[v; 3]; PIXELS];
        let reference = Image {
            width: PIXELS,
            height: 1,
            rgb: flat(1.0),
        };
        let reference = Reference::of_file(reference, None, std::path::Path::new("ones.exr"));
        let judged: Vec<Judged> = (0..24)
            .map(|i| {
                let (level, repeat) = (i / 4, i % 4);
                let rounds = 1u64 << level;
                let mut noise =
                    || (rng.next_f64() - 0.5) * 12f64.sqrt() * 0.4 / (rounds as f64).sqrt();
                // 10 % of the light is missing.
                let rgb = (0..PIXELS).map(|_| [(0.9 + noise()) as f32; 3]).collect();
                let image = Image {
                    width: PIXELS,
                    height: 1,
                    rgb,
                };
                let point = Point {
                    command: Vec::new(),
                    scene_hash: String::new(),
                    rounds,
                    seed: 1,
                    repeat,
                    wall_seconds: 0.5 + 0.25 * rounds as f64,
                    cpu_seconds: 0.0,
                    threads: 1,
                    claimed: Some(0.4 / (rounds as f64).sqrt()),
                    faults: 0,
                };
                Judged::new(point, level, &image, &reference)
            })
            .collect();
        let all: Vec<&Judged> = judged.iter().collect();
        let s = summarise(&all, &reference, Clock::Wall);
        assert!((s.pace.start - 0.5).abs() < 1e-9 && (s.pace.each - 0.25).abs() < 1e-9);
        let parts = s.parts.expect("many images");
        let floor = parts.floor().expect("a floor of 10 %");
        // Relative to the reference's mean; 63·4096 samples of noise 0.4 leave 8e-4 of it.
        assert!(
            (floor.value - 0.1).abs() < 0.004 && floor.low < 0.1 && floor.high > 0.1,
            "{floor:?}"
        );
        assert!(parts.bias.low < -0.1 && -0.1 < parts.bias.high, "{parts:?}");
        assert!((parts.variance - 0.16).abs() < 0.005, "{parts:?}");
        // 10 % is the floor itself: 0.4²/(0.1² − 0.1²) is out of reach or far away; 5 % never.
        assert!(s.reach[1].is_none() && s.reach[0].is_none_or(|r| r.needed.value > 100.0));
        assert!(s.claim.expect("claims").value < 0.95);
        let e = s.error_after(0.5 + 0.25 * 32.0).expect("a curve");
        assert!((0.09..0.16).contains(&e.value), "{e:?}");
    }
}
