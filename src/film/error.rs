//! How far an image may be from the truth, by its own account.

use serde::Serialize;

/// Variance of the luminance of every pixel of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelErrors {
    /// Squared standard error of Y, in the order of the image; infinite where too few samples say nothing of it.
    pub variance: Vec<f64>,
    /// Degrees of freedom of each, at least.
    pub freedom: u64,
}

/// An image's error in one line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorSummary {
    /// √(mean over the pixels of se²) / mean luminance: what the relative root-mean-square error of the pixels is
    /// expected to be. Its square times the squared mean is unbiased, and nothing is divided by a dark pixel.
    pub relative: f64,
    /// Pixels that nothing has reached. They count with error 0, so where they should be lit the estimate is too low.
    pub black_pixels: u64,
    /// Degrees of freedom of a pixel's standard error: `Y ± t·se` with Student's t of so many.
    pub degrees_of_freedom: u64,
}

impl PixelErrors {
    /// Adds the variances of an independent image that is added to this one; the fewer degrees of freedom stay.
    pub fn add(&mut self, variance: &[f64], freedom: u64) {
        self.freedom = self.freedom.min(freedom);
        for (a, b) in self.variance.iter_mut().zip(variance) {
            *a += b;
        }
    }

    /// Standard errors of Y times `scale`.
    pub fn standard(&self, scale: f64) -> Vec<f32> {
        let se = self.variance.iter().map(|v| (v.sqrt() * scale) as f32);
        se.collect()
    }

    /// The error of the image (XYZ) as one number. NaN if all of it is black.
    pub fn summary(&self, image: &[[f64; 3]]) -> ErrorSummary {
        assert_eq!(
            image.len(),
            self.variance.len(),
            "a variance for each pixel"
        );
        let n = image.len().max(1) as f64;
        let mean = image.iter().map(|p| p[1]).sum::<f64>() / n;
        let square = self.variance.iter().sum::<f64>() / n;
        let black = |(p, v): &(&[f64; 3], &f64)| p[1] == 0.0 && **v == 0.0;
        ErrorSummary {
            relative: square.sqrt() / mean,
            black_pixels: image.iter().zip(&self.variance).filter(black).count() as u64,
            degrees_of_freedom: self.freedom,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_is_its_definition() {
        let mut e = PixelErrors {
            variance: vec![1.0, 0.0, 0.0, 4.0],
            freedom: 15,
        };
        e.add(&[3.0, 0.0, 0.0, 0.0], 20);
        let s = e.summary(&[[9.0, 3.0, 0.0], [0.0; 3], [9.0, 1.0, 9.0], [0.0; 3]]);
        assert_eq!(s.relative, 2f64.sqrt());
        // The second alone: the last is black, but not certainly so.
        assert_eq!((s.black_pixels, s.degrees_of_freedom), (1, 15));
        assert_eq!(e.standard(0.5), [1.0, 0.0, 0.0, 1.0]);
        assert!(e.summary(&[[0.0; 3]; 4]).relative.is_infinite());
        e.variance.fill(0.0);
        assert!(e.summary(&[[0.0; 3]; 4]).relative.is_nan());
    }
}
