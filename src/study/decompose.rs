//! What of an error is noise, which more work takes away, and what is bias, which stays.
//!
//! Images x of independent seeds, each of some work w, have variance ∝ 1/w in every pixel. Their mean M weighted by w has
//! variance v/W with W = Σw and, without bias, v = Σ w (x − M)² / (n − 1). The reference r is itself a mean of parts
//! whose spread tells its variance u. So the mean over the pixels of (M − r)² − v/W − u is the squared bias, without the
//! noise of either; it may come out below 0.

use super::interval::{CONFIDENCE, Interval, Mean};
use serde::Serialize;

/// An image of the setting that is judged.
pub struct Sample<'a> {
    /// Luminance of each pixel.
    pub luminance: &'a [f64],
    /// Work that went into it, in any unit: its variance is inversely proportional to this.
    pub work: f64,
    /// Samples of one number are left out together when the spread is told; each number has the same work.
    pub repeat: usize,
}

/// What the images should converge to.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Independent images of equal work, whose mean is the reference; one if nothing is known but that.
    pub parts: Vec<Vec<f64>>,
    /// Where there is one part alone: the mean over its pixels of their variance, if that is known.
    pub variance: f64,
}

impl Truth {
    /// Luminance of the reference.
    pub fn luminance(&self) -> Vec<f64> {
        mean_without(&self.parts, None)
    }

    /// Mean over the pixels of the reference's variance, from the spread of its parts.
    pub fn noise(&self) -> f64 {
        self.noise_without(None)
    }

    fn noise_without(&self, left_out: Option<usize>) -> f64 {
        let of: Vec<&Vec<f64>> = kept(&self.parts, left_out);
        let k = of.len() as f64;
        if self.parts.len() < 2 || of.len() < 2 {
            return self.variance;
        }
        let mean = mean_without(&self.parts, left_out);
        let square = |p: &&Vec<f64>| {
            p.iter()
                .zip(&mean)
                .map(|(a, b)| (a - b).powi(2))
                .sum::<f64>()
        };
        of.iter().map(square).sum::<f64>() / (k - 1.0) / k / mean.len() as f64
    }

    /// Mean of the luminance, with the spread between the parts.
    fn mean(&self) -> Mean {
        let means: Vec<f64> = self.parts.iter().map(|p| average(p)).collect();
        Mean {
            // The noise of a reference that has no parts is not known; it is taken for exact.
            freedom: if means.len() > 1 {
                means.len() as f64 - 1.0
            } else {
                f64::INFINITY
            },
            ..Mean::of(&means)
        }
    }
}

/// Noise and bias of a setting, relative to the reference's mean luminance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parts {
    /// Mean squared noise of an image of one unit of work.
    pub variance: f64,
    /// Mean signed difference.
    pub bias: Interval,
    /// Mean squared bias of the pixels; the bounds are Student's t over repeats and over parts of the reference.
    pub floor_square: Interval,
    /// It is told from 0, at a level that holds for all settings of a page together.
    pub told: bool,
}

/// Settings on a page, about: by each of them alone every other page would call an unbiased setting biased.
const SETTINGS: f64 = 20.0;

impl Parts {
    /// Relative root-mean-square error that no amount of work takes away, where it is told from 0.
    pub fn floor(&self) -> Option<Interval> {
        self.told.then(|| self.floor_square.map(f64::sqrt))
    }
}

/// Tells noise from bias. `None` for fewer than two images.
pub fn decompose(samples: &[Sample], truth: &Truth) -> Option<Parts> {
    if samples.len() < 2 {
        return None;
    }
    let mean = average(&truth.luminance());
    let scale = (mean * mean).recip();
    let variance = spread(samples, None)? * scale;
    let square =
        |s: Option<usize>, r: Option<usize>| squared_bias(samples, s, truth, r).map(|v| v * scale);
    let value = square(None, None)?;
    let mut repeats: Vec<usize> = samples.iter().map(|s| s.repeat).collect();
    repeats.sort_unstable();
    repeats.dedup();
    let without: Vec<f64> = repeats
        .iter()
        .filter_map(|r| square(Some(*r), None))
        .collect();
    let own = if repeats.len() > 1 && without.len() == repeats.len() {
        Mean::jackknife(value, &without)
    } else {
        Mean::of(&[value])
    };
    let reference = if truth.parts.len() > 2 {
        let without: Vec<f64> = (0..truth.parts.len())
            .filter_map(|k| square(None, Some(k)))
            .collect();
        Mean {
            value: 0.0,
            ..Mean::jackknife(value, &without)
        }
    } else {
        Mean {
            value: 0.0,
            variance: 0.0,
            freedom: f64::INFINITY,
        }
    };
    let signed: Vec<f64> = repeats
        .iter()
        .map(|r| {
            let of = samples.iter().filter(|s| s.repeat == *r);
            let all: f64 = of.clone().map(|s| s.work).sum();
            of.map(|s| s.work * average(s.luminance)).sum::<f64>() / all
        })
        .collect();
    let bias = Mean::of(&signed)
        .minus(truth.mean())
        .interval()
        .map(|b| b / mean);
    let floor = own.minus(reference);
    // Šidák.
    let all = CONFIDENCE.powf(1.0 / SETTINGS);
    Some(Parts {
        variance,
        bias,
        floor_square: floor.interval(),
        told: floor.interval_of(all).low > 0.0,
    })
}

/// Mean over the pixels of v, of the samples but one repeat.
fn spread(samples: &[Sample], left_out: Option<usize>) -> Option<f64> {
    let of: Vec<&Sample> = samples
        .iter()
        .filter(|s| Some(s.repeat) != left_out)
        .collect();
    if of.len() < 2 {
        return None;
    }
    let m = weighted(&of);
    let sum: f64 = of
        .iter()
        .map(|s| {
            let off = s.luminance.iter().zip(&m).map(|(x, m)| (x - m).powi(2));
            s.work * off.sum::<f64>()
        })
        .sum();
    Some(sum / (of.len() as f64 - 1.0) / m.len() as f64)
}

fn squared_bias(
    samples: &[Sample],
    repeat: Option<usize>,
    truth: &Truth,
    part: Option<usize>,
) -> Option<f64> {
    let of: Vec<&Sample> = samples
        .iter()
        .filter(|s| Some(s.repeat) != repeat)
        .collect();
    let all: f64 = of.iter().map(|s| s.work).sum();
    let noise = spread(samples, repeat)? / all;
    let m = weighted(&of);
    let r = mean_without(&truth.parts, part);
    let square = m.iter().zip(&r).map(|(m, r)| (m - r).powi(2)).sum::<f64>() / m.len() as f64;
    Some(square - noise - truth.noise_without(part))
}

/// Mean image of the samples, weighted by work.
fn weighted(of: &[&Sample]) -> Vec<f64> {
    let all: f64 = of.iter().map(|s| s.work).sum();
    let mut mean = vec![0.0; of[0].luminance.len()];
    for s in of {
        for (m, x) in mean.iter_mut().zip(s.luminance) {
            *m += x * (s.work / all);
        }
    }
    mean
}

fn kept(parts: &[Vec<f64>], left_out: Option<usize>) -> Vec<&Vec<f64>> {
    let keep = |(i, _): &(usize, &Vec<f64>)| Some(*i) != left_out;
    parts
        .iter()
        .enumerate()
        .filter(keep)
        .map(|(_, p)| p)
        .collect()
}

fn mean_without(parts: &[Vec<f64>], left_out: Option<usize>) -> Vec<f64> {
    let of = kept(parts, left_out);
    let sum = |i: usize| of.iter().map(|p| p[i]).sum::<f64>() / of.len() as f64;
    (0..of[0].len()).map(sum).collect()
}

/// Mean of some values.
pub fn average(v: &[f64]) -> f64 {
    v.iter().sum::<f64>() / v.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of mean 1 with a pattern of bias and uniform noise of variance 1/(12·work).
    fn images(seed: u64, works: &[f64], bias: f64, pixels: usize) -> Vec<Vec<f64>> {
        let mut rng = crate::sampling::Rng::new(seed, 1000, 0, 0);
        works
            .iter()
            .map(|w| {
                (0..pixels)
                    .map(|i| {
                        let side = if i % 2 == 0 { bias } else { -bias };
                        1.0 + side + (rng.next_f64() - 0.5) / w.sqrt()
                    })
                    .collect()
            })
            .collect()
    }

    fn parts(bias: f64, noisy_reference: bool, seed: u64) -> Parts {
        let works: Vec<f64> = (0..20).map(|i| 2f64.powi(i % 5)).collect();
        let x = images(seed, &works, bias, 4096);
        let samples: Vec<Sample> = x
            .iter()
            .zip(&works)
            .enumerate()
            .map(|(i, (l, w))| Sample {
                luminance: l,
                work: *w,
                repeat: i / 5,
            })
            .collect();
        let truth = if noisy_reference {
            Truth {
                parts: images(seed + 1, &[8.0; 4], 0.0, 4096),
                variance: 0.0,
            }
        } else {
            Truth {
                parts: vec![vec![1.0; 4096]],
                variance: 0.0,
            }
        };
        decompose(&samples, &truth).expect("enough images")
    }

    #[test]
    fn noise_and_bias_are_told_apart() {
        for noisy in [false, true] {
            let p = parts(0.1, noisy, 1);
            // 19·4096 squares of a uniform, each with a relative deviation of 0.9: five deviations are 1.6 %.
            assert!((p.variance * 12.0 - 1.0).abs() < 0.016, "{p:?}");
            let floor = p.floor().expect("a bias of 10 % is seen");
            assert!(floor.low < 0.1 && 0.1 < floor.high, "{floor:?}");
            assert!(floor.high - floor.low < 0.02, "{floor:?}");
            // The pattern has no mean: the signed difference is 0. Four repeats of 31·4096 pixels' work and a reference of
            // 32·4096 leave 9e-4; twice 3.2 of that is the interval, which may come out twice as long.
            assert!(p.bias.low < 0.0 && 0.0 < p.bias.high, "{p:?}");
            assert!(p.bias.high - p.bias.low < 0.012, "{p:?}");
        }
    }

    /// Without bias the interval of its square holds 0 in 95 of 100 cases; of 100 seeds 88 are the least that a binomial
    /// leaves with probability 0.999.
    #[test]
    fn no_bias_is_no_floor() {
        let inside = (0..100).filter(|s| {
            let f = parts(0.0, true, 100 + 2 * s).floor_square;
            f.low <= 0.0 && 0.0 <= f.high
        });
        let inside = inside.count();
        assert!(inside >= 88, "{inside}");
    }
}
