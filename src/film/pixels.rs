//! Sums of camera samples. A pixel's samples are its own, taken in order by whoever owns the pixel, so plain f64 does.

use super::{Crop, Fault};

/// Running sums of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSum {
    /// Σ w·XYZ.
    pub xyz: [f64; 3],
    /// Σ (w·Y)², for the variance of the pixel's mean.
    pub y2: f64,
    /// Samples taken, black ones and faulty ones included.
    pub samples: u64,
}

impl PixelSum {
    /// Adds one sample with its filter weight (see `Filter::sample`). A fault counts as a black sample.
    pub fn add(&mut self, xyz: [f32; 3], weight: f32) -> Result<(), Fault> {
        self.samples += 1;
        for v in xyz {
            if let Some(fault) = Fault::of(v as f64, f32::MAX as f64) {
                return Err(fault);
            }
        }
        if !weight.is_finite() {
            return Err(Fault::NotANumber);
        }
        let v = xyz.map(|v| v as f64 * weight as f64);
        for (sum, v) in self.xyz.iter_mut().zip(v) {
            *sum += v;
        }
        self.y2 += v[1] * v[1];
        Ok(())
    }

    /// Mean XYZ; 0 without samples. Divided by the number of samples, not by Σ w: unbiased.
    pub fn mean(&self) -> [f64; 3] {
        let n = self.samples.max(1) as f64;
        self.xyz.map(|v| v / n)
    }

    /// Variance of the mean of Y, from the sample variance; 0 with fewer than two samples.
    pub fn variance_of_mean(&self) -> f64 {
        if self.samples < 2 {
            return 0.0;
        }
        let n = self.samples as f64;
        let mean = self.xyz[1] / n;
        ((self.y2 / n - mean * mean) / (n - 1.0)).max(0.0)
    }
}

/// One [`PixelSum`] a pixel, row-major. Split it by rows to hand pixels to threads.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelSums {
    /// The pixels it covers.
    pub crop: Crop,
    /// Sums.
    pub pixels: Vec<PixelSum>,
}

impl PixelSums {
    /// No samples yet.
    pub fn new(crop: Crop) -> Self {
        Self {
            crop,
            pixels: vec![PixelSum::default(); crop.pixels()],
        }
    }

    /// Mean XYZ of each pixel times `scale`.
    pub fn to_xyz(&self, scale: f64) -> Vec<[f64; 3]> {
        self.pixels
            .iter()
            .map(|p| p.mean().map(|v| v * scale))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_variance_of_known_samples() {
        let mut p = PixelSum::default();
        for y in [1.0, 2.0, 3.0, 4.0] {
            p.add([0.5, y, 2.0], 1.0).unwrap();
        }
        assert_eq!(p.mean(), [0.5, 2.5, 2.0]);
        // Sample variance 5/3, over 4 samples.
        assert!((p.variance_of_mean() - 5.0 / 12.0).abs() < 1e-15);
        assert_eq!(p.add([f32::NAN, 1.0, 1.0], 1.0), Err(Fault::NotANumber));
        assert_eq!(p.mean()[1], 2.0);
        assert_eq!(PixelSum::default().mean(), [0.0; 3]);
    }
}
