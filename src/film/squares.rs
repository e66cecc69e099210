//! Second moments of light-tracing splats, for the variance of what they give each pixel.
//!
//! Sample m splats L_mi onto pixel i. With M samples the image is Σ_m L_mi/M and its variance
//! (Σ_m L²_mi/M − (Σ_m L_mi/M)²)/M: the splats of one sample are added before they are squared.

use super::{Crop, Filter, Malformed, Reader, Writer};
use glam::Vec2;
use std::io;

/// Units of a sum: 2⁴⁰ of them make 1. A splat is below 2⁴⁰, its square below 2⁸⁰, so 2⁷ of the very largest fit.
const ONE: f64 = 1_099_511_627_776.0;

/// Exact sums of squares, in any order: integers that never wrap.
#[derive(Clone, Debug)]
pub struct Squares {
    crop: Crop,
    sums: Vec<i128>,
}

impl Squares {
    /// All 0.
    pub fn new(crop: Crop) -> Self {
        let sums = vec![0; crop.pixels()];
        Self { crop, sums }
    }

    /// Adds other sums.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!(self.crop, other.crop, "sums cover the same pixels");
        for (a, b) in self.sums.iter_mut().zip(&other.sums) {
            *a = a.saturating_add(*b);
        }
    }

    /// Variance of the mean over `samples` of them, of each pixel; `means` are the pixels' mean luminances.
    pub fn variance(&self, samples: f64, means: impl Iterator<Item = f64>) -> Vec<f64> {
        let each = self.sums.iter().zip(means);
        each.map(|(&s, m)| ((s as f64 / ONE / samples - m * m) / (samples - 1.0).max(1.0)).max(0.0))
            .collect()
    }

    /// Writes the sums.
    pub fn save(&self, w: &mut Writer) -> io::Result<()> {
        w.integers(self.sums.iter().copied())
    }

    /// Sums that [`Self::save`] wrote.
    pub fn read(r: &mut Reader, crop: Crop) -> Result<Self, Malformed> {
        let sums = r.integers(crop.pixels())?.collect();
        Ok(Self { crop, sums })
    }
}

/// A thread's sums of squares.
#[derive(Clone, Debug)]
pub struct SquareBuffer {
    filter: Filter,
    squares: Squares,
    /// What the sample in hand gives: pixel, luminance.
    open: Vec<(u32, f64)>,
}

impl SquareBuffer {
    /// All 0.
    pub fn new(crop: Crop, filter: Filter) -> Self {
        Self {
            filter,
            squares: Squares::new(crop),
            open: Vec::new(),
        }
    }

    /// A splat of luminance `y`, one that [`super::WideBuffer::splat`] took.
    pub fn splat(&mut self, raster: Vec2, y: f64) {
        let (crop, open) = (self.squares.crop, &mut self.open);
        self.filter.for_pixels(raster, |px, py, h| {
            if let Some(i) = crop.index(px, py) {
                open.push((i as u32, y * h as f64));
            }
        });
    }

    /// The sample is over.
    pub fn close(&mut self) {
        if self.open.len() > 1 {
            // Stable, so that a pixel's splats are added in their order.
            self.open.sort_by_key(|s| s.0);
        }
        for one in self.open.chunk_by(|a, b| a.0 == b.0) {
            let y: f64 = one.iter().map(|s| s.1).sum();
            let sum = &mut self.squares.sums[one[0].0 as usize];
            *sum = sum.saturating_add((y * y * ONE).round_ties_even() as i128);
        }
        self.open.clear();
    }

    /// What it has added up.
    pub fn squares(&self) -> &Squares {
        &self.squares
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{FilterKind, FilterSettings};

    #[test]
    fn splats_of_one_sample_are_added_first() {
        let kind = FilterKind::Box;
        let radius = [0.5; 2];
        let filter = Filter::new(&FilterSettings { kind, radius });
        let crop = Crop::from([0, 0, 2, 1]);
        let mut b = SquareBuffer::new(crop, filter);
        let (left, right) = (Vec2::new(0.5, 0.5), Vec2::new(1.5, 0.5));
        // Samples of the left pixel: 3, 0, 1; of the right one: 5, 0, 0.
        b.splat(left, 1.0);
        b.splat(right, 5.0);
        b.splat(left, 2.0);
        b.close();
        b.close();
        let mut other = b.clone();
        other.squares.sums.fill(0);
        other.splat(left, 1.0);
        other.close();
        b.squares.merge(&other.squares);
        let v = b.squares.variance(3.0, [4.0 / 3.0, 5.0 / 3.0].into_iter());
        // Sample variances 7/3 and 25/3, over 3 samples.
        assert!((v[0] - 7.0 / 9.0).abs() < 1e-11, "{v:?}");
        assert!((v[1] - 25.0 / 9.0).abs() < 1e-11, "{v:?}");
    }
}
