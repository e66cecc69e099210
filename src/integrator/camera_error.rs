//! Variance of what camera samples give a pixel, from the samples themselves.

use super::CameraSums;
use super::camera_pass::BLOCK;

/// Whole blocks from which a pixel's variance is taken.
const ENOUGH: u64 = 4;

/// Side of the tiles whose pixels are taken together where they have too few samples of their own.
const TILE: usize = 8;

/// Σ v, Σ v² and number of samples.
type Moments = [f64; 3];

impl CameraSums {
    /// Variance of each pixel's mean luminance. Samples are stratified: those of a block of consecutive ones lie evenly
    /// over the pixel, and the sums of blocks vary less than those of independent samples would. Blocks are taken as
    /// independent of each other, which overstates the variance, since they too fill each other's gaps; a pixel of fewer
    /// than [`ENOUGH`] whole blocks has its samples taken so, which overstates it more. A pixel of fewer than two samples takes its tile's moments, or the image's, for its
    /// own: the differences between those pixels then count as noise, which overstates it too.
    pub fn variance(&self) -> Vec<f64> {
        let mut all = self.variance_of_all();
        let here = self.shards.portion();
        if here < 1.0 {
            // A pixel is here with that probability and counts for 1/here pixels: (v + m²)/here − m², which the pixels
            // that are here tell in the mean.
            for (i, v) in all.iter_mut().enumerate() {
                let m = self.sums[i][1] / counts_for(self.count(i));
                *v = if self.has(i) {
                    (*v + m * m * (1.0 - here)) / (here * here)
                } else {
                    0.0
                };
            }
        }
        all
    }

    /// As if no pixel were missing.
    fn variance_of_all(&self) -> Vec<f64> {
        let width = self.crop.width();
        let counts: Vec<u64> = (0..self.sums.len()).map(|i| self.count(i)).collect();
        let own = |i: usize| -> Moments { [self.sums[i][1], self.sums[i][3], counts[i] as f64] };
        let tiles_across = width.div_ceil(TILE);
        let tile = |i: usize| i / width / TILE * tiles_across + i % width / TILE;
        let mut tiles: Vec<Moments> = Vec::new();
        let mut all = Moments::default();
        if counts.iter().any(|n| *n < 2) {
            tiles = vec![
                Moments::default();
                self.sums.len().div_ceil(width).div_ceil(TILE) * tiles_across
            ];
            for i in 0..self.sums.len() {
                for k in 0..3 {
                    tiles[tile(i)][k] += own(i)[k];
                    all[k] += own(i)[k];
                }
            }
        }
        (0..self.sums.len())
            .map(|i| {
                let n = counts[i] as f64;
                let blocks = counts[i] / BLOCK;
                if blocks >= ENOUGH {
                    let [_, sum, _, _, square, open] = self.sums[i];
                    // n mean values are the sum of n/BLOCK blocks, whole or not.
                    let all = of_one([sum - open, square, blocks as f64]);
                    return all / (BLOCK as f64 * n);
                }
                if counts[i] >= 2 {
                    return of_one(own(i)) / n;
                }
                let near = tiles[tile(i)];
                let moments = if near[2] >= 2.0 { near } else { all };
                // Below one sample a pixel, a sample comes with the part `samples` as its probability and counts for
                // 1/samples pixels: E[v²]/samples − E[v]².
                let [sum, square, taken] = moments;
                if taken < 2.0 {
                    f64::INFINITY
                } else if self.samples < 1.0 {
                    (square / taken / self.samples - (sum / taken).powi(2)).max(0.0)
                } else {
                    of_one(moments)
                }
            })
            .collect()
    }
}

fn counts_for(n: u64) -> f64 {
    n.max(1) as f64
}

/// Sample variance.
fn of_one([sum, square, n]: Moments) -> f64 {
    ((square - sum * sum / n) / (n - 1.0)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::camera_pass::R2;
    use super::super::camera_pass::tests::passed;
    use super::*;
    use crate::sampling::Rng;
    use glam::Vec2;

    /// `mean` samples a pixel of 64 × 64 pixels, each giving the luminance `f`.
    fn pass(mean: f64, f: impl Fn(Vec2, &mut Rng) -> f64 + Sync) -> CameraSums {
        passed(64, &[mean], 1, f)
    }

    /// Samples uniform in [0, 1), of variance 1/12, in 64 × 64 pixels.
    #[test]
    fn the_variance_is_right_in_the_mean_for_any_number_of_samples() {
        for mean in [0.25, 0.5, 1.0, 1.5, 2.0, 16.0, 100.0] {
            let v = pass(mean, |_, rng| rng.next_f64()).variance();
            let found = v.iter().sum::<f64>() / v.len() as f64;
            let expected = if mean < 1.0 {
                // 0 with probability 1 − mean, else a sample over `mean`.
                1.0 / 3.0 / mean - 0.25
            } else if mean == 1.5 {
                // Half the pixels have one sample, the others two.
                0.75 / 12.0
            } else {
                1.0 / 12.0 / mean
            };
            // The square of a uniform has a relative standard deviation of 0.9; of at least 1024 samples its mean has
            // 2.8 %. Five of them.
            assert!(
                (found / expected - 1.0).abs() < 0.14,
                "{mean}: {found} {expected}"
            );
        }
    }

    /// An edge through every pixel, which stratified samples find at the same place again and again: what is stated lies
    /// above the true variance, and well below that of independent samples.
    #[test]
    fn an_edge_is_not_taken_for_noise() {
        let n = 128.0;
        let pass = pass(n, |raster, _| (raster.x.fract() > 0.37) as u8 as f64);
        let pixels = pass.sums.len() as f64;
        let stated = pass.variance().iter().sum::<f64>() / pixels;
        let off = |s: &[f64; 6]| (s[1] / n - 0.63).powi(2);
        let found = pass.sums.iter().map(off).sum::<f64>() / pixels;
        // What blocks of the sequence say of themselves, from the sequence alone, over evenly spaced shifts.
        let shifts = 2000;
        let of_shift = |k: i32| {
            let start = (k as f64 + 0.5) / shifts as f64;
            let beyond = |i: u64| ((start + i as f64 * R2[0]).fract() > 0.37) as u8 as f64;
            let sums = |b: u64| (b * BLOCK..(b + 1) * BLOCK).map(beyond).sum::<f64>();
            let blocks: Vec<f64> = (0..n as u64 / BLOCK).map(sums).collect();
            let mean = blocks.iter().sum::<f64>() / blocks.len() as f64;
            let squares = blocks.iter().map(|s| (s - mean).powi(2)).sum::<f64>();
            squares / (blocks.len() - 1) as f64 / (BLOCK as f64 * n)
        };
        let expected = (0..shifts).map(of_shift).sum::<f64>() / shifts as f64;
        assert!(found < stated, "{found:e} {stated:e}");
        // A pixel's 15 degrees of freedom give a relative deviation of √(2/15); 4096 of them one of 0.6 %. Five of them.
        assert!(
            (stated / expected - 1.0).abs() < 0.03,
            "{stated:e} {expected:e}"
        );
        // Independent samples would have this, and the blocks must tell.
        assert!(expected < 0.37 * 0.63 / n, "{expected:e}");
    }
}
