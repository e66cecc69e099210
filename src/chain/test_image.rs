//! Two-stage Metropolis (Veach 11.5.3): chains sample τ/I0 in place of τ, with I0 a coarse test image, so that dark pixels
//! get as many samples as bright ones; each splat is multiplied back by I0 at its own raster point.
//!
//! Any positive function of the raster point leaves the image unbiased, if it is fixed before the chains are seeded. This
//! one is made of a noisy image: a median over 3 × 3 pixels takes out single bright samples, a mean over 5 × 5 what noise
//! is left, and a floor keeps what was never seen from being sampled at any cost.

use crate::film::Crop;
use crate::real::Vec2;

/// Least I0 over the image's mean: a splat's weight per sample shrinks to a tenth at most.
const FLOOR: f64 = 0.1;
/// Largest I0 over the image's mean. A round of 64 steps then adds at most 2¹⁸ to a film that has room for 2²¹.
const CEILING: f64 = 4096.0;

/// I0, constant over each pixel, in units of its mean before floor and ceiling; what lies around the crop has the value of
/// the nearest pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct TestImage {
    crop: Crop,
    values: Vec<f32>,
}

impl TestImage {
    /// Of the luminance of each pixel of the crop, row by row. `None` if the image is black: then nothing is known.
    pub fn new(crop: Crop, luminance: &[f64]) -> Option<Self> {
        let smooth = filtered(crop, &filtered(crop, luminance, 1, median), 2, mean);
        let all = mean(&mut smooth.clone());
        if !(all > 0.0 && all.is_finite()) {
            return None;
        }
        let value = |v: &f64| (v / all).clamp(FLOOR, CEILING) as f32;
        Some(Self {
            crop,
            values: smooth.iter().map(value).collect(),
        })
    }

    /// I0 at a raster point.
    #[inline]
    pub fn at(&self, raster: Vec2) -> f64 {
        let c = &self.crop;
        let column = (raster.x.floor() as i64).clamp(c.x0 as i64, c.x1 as i64 - 1);
        let row = (raster.y.floor() as i64).clamp(c.y0 as i64, c.y1 as i64 - 1);
        let i = c.index(column, row).expect("held in the crop");
        self.values[i] as f64
    }
}

/// Replaces each pixel by `f` of those within `r` of it.
fn filtered(crop: Crop, v: &[f64], r: i64, f: fn(&mut [f64]) -> f64) -> Vec<f64> {
    let mut near = Vec::new();
    let mut out = Vec::with_capacity(v.len());
    for y in crop.y0 as i64..crop.y1 as i64 {
        for x in crop.x0 as i64..crop.x1 as i64 {
            near.clear();
            for j in y - r..=y + r {
                let inside = (x - r..=x + r).filter_map(|i| crop.index(i, j));
                near.extend(inside.map(|i| v[i]));
            }
            out.push(f(&mut near));
        }
    }
    out
}

fn median(v: &mut [f64]) -> f64 {
    v.sort_by(f64::total_cmp);
    v[v.len() / 2]
}

fn mean(v: &mut [f64]) -> f64 {
    v.iter().sum::<f64>() / v.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_image_is_positive_smooth_and_of_its_own_scale() {
        let crop = Crop::from([3, 5, 23, 25]);
        // Half of it black, half bright, and one pixel that noise made a million times as bright.
        let mut y: Vec<f64> = (0..400).map(|i| ((i % 20) / 10) as f64).collect();
        y[205] = 1e6;
        let i0 = TestImage::new(crop, &y).expect("not black");
        assert!(i0.values.iter().all(|v| (0.1..3.0).contains(v)));
        assert_eq!(i0.at(Vec2::new(5.5, 15.5)), FLOOR as f32 as f64);
        assert_eq!(i0.at(Vec2::new(8.5, 15.2)), FLOOR as f32 as f64);
        assert!((i0.at(Vec2::new(20.5, 9.5)) - 2.0).abs() < 0.1);
        let scaled = TestImage::new(crop, &y.iter().map(|v| v * 1024.0).collect::<Vec<_>>());
        assert_eq!(scaled.as_ref(), Some(&i0));
        // Beyond the border.
        assert_eq!(i0.at(Vec2::new(-7.0, 9.5)), i0.at(Vec2::new(3.0, 9.5)));
        assert_eq!(i0.at(Vec2::new(22.9, 26.0)), i0.at(Vec2::new(22.0, 24.9)));
        assert_eq!(TestImage::new(crop, &[0.0; 400]), None);
    }
}
