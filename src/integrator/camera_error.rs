//! Variance of what camera samples give a pixel, from the samples themselves.

use super::CameraSums;
use super::pixel_sums::whole_blocks;

/// Side of the tiles whose pixels are taken together where they have too few samples of their own.
const TILE: usize = 8;

/// Σ v, Σ v² and number of samples.
type Moments = [f64; 3];

impl CameraSums {
    /// Variance of each pixel's mean luminance. Samples are stratified: those of a block of consecutive ones lie evenly
    /// over the pixel, and the sums of blocks vary less than those of independent samples would. Blocks are taken as
    /// independent of each other, which overstates the variance, since they too fill each other's gaps: by twice to three
    /// times where an edge divides the pixel, not at all where what is seen is noise. A pixel of fewer than two samples takes
    /// its tile's moments, or the image's, for its own: the differences between those pixels then count as noise, which
    /// overstates it too.
    pub fn variance(&self) -> Vec<f64> {
        let mut all = self.variance_of_all();
        let here = self.shards.portion();
        if here < 1.0 {
            // A pixel is here with that probability and counts for 1/here pixels: (v + m²)/here − m², which the pixels
            // that are here tell in the mean.
            for (i, v) in all.iter_mut().enumerate() {
                let m = self.sums[i].xyz[1] / counts_for(self.count(i));
                *v = if self.has(i) {
                    (*v + m * m * (1.0 - here)) / (here * here)
                } else {
                    0.0
                };
            }
        }
        all
    }

    /// Degrees of freedom of each pixel's variance, at least: its whole blocks but one, or the pixels of a tile but one.
    pub fn freedom(&self) -> u64 {
        let n = self.samples as u64;
        let of = |n: u64| match n {
            0 | 1 => (TILE * TILE) as u64 - 1,
            n => whole_blocks(n) - 1,
        };
        // Some pixels are one ahead.
        if self.samples > n as f64 {
            of(n).min(of(n + 1))
        } else {
            of(n)
        }
    }

    /// As if no pixel were missing.
    fn variance_of_all(&self) -> Vec<f64> {
        let width = self.crop.width();
        let counts: Vec<u64> = (0..self.sums.len()).map(|i| self.count(i)).collect();
        let own = |i: usize| moments(self.sums[i].whole(counts[i]).0);
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
                // Whole blocks are samples, where some pixel has less than two.
                for (k, m) in own(i).into_iter().enumerate() {
                    tiles[tile(i)][k] += m;
                    all[k] += m;
                }
            }
        }
        (0..self.sums.len())
            .map(|i| {
                let n = counts[i] as f64;
                if counts[i] >= 2 {
                    // n mean values are the sum of n/size blocks, whole or not.
                    let (blocks, size) = self.sums[i].whole(counts[i]);
                    return of_one(moments(blocks)) / (size as f64 * n);
                }
                let near = tiles[tile(i)];
                let [sum, square, taken] = if near[2] >= 2.0 { near } else { all };
                // Below one sample a pixel, a sample comes with the part `samples` as its probability and counts for
                // 1/samples pixels: E[v²]/samples − E[v]².
                if taken < 2.0 {
                    f64::INFINITY
                } else if self.samples < 1.0 {
                    (square / taken / self.samples - (sum / taken).powi(2)).max(0.0)
                } else {
                    of_one([sum, square, taken])
                }
            })
            .collect()
    }
}

fn counts_for(n: u64) -> f64 {
    n.max(1) as f64
}

fn moments(values: impl Iterator<Item = f64>) -> Moments {
    values.fold(Moments::default(), |[sum, square, n], v| {
        [sum + v, square + v * v, n + 1.0]
    })
}

/// Sample variance.
fn of_one([sum, square, n]: Moments) -> f64 {
    ((square - sum * sum / n) / (n - 1.0)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::camera_pass::tests::passed;
    use super::super::pixel_sums::PixelSums;
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
        let off = |s: &PixelSums| (s.xyz[1] / n - 0.63).powi(2);
        let found = pass.sums.iter().map(off).sum::<f64>() / pixels;
        // One sample lies in each of 128 columns, one of them divided: 81 lie beyond the edge with a probability of 0.64,
        // else 80. Each of the 8 blocks has 10 of them, and one block that of the divided column: a sample variance of 1/8
        // with the same probability.
        let (most, part) = (1.0 / (n * n), 0.64);
        let expected = [part * (1.0 - part) * most, part / 8.0 * 8.0 * most];
        // Relative deviations of a two-valued number over 4096 pixels: 0.9 % and 1.2 %. Five of them.
        for (v, e, limit) in [(found, expected[0], 0.046), (stated, expected[1], 0.06)] {
            assert!((v / e - 1.0).abs() < limit, "{v:e} {e:e}");
        }
        assert!(stated < 0.1 * 0.37 * 0.63 / n, "{stated:e}");
    }
}
