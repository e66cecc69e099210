//! What light-tracing splats have added up, and the image they make with camera samples.

use super::{CameraSums, Rendered};
use crate::film::{Bins, Crop, Film, Malformed, PixelErrors, Reader};
use crate::film::{SpectralFilm, SquareBuffer, Squares, WideBuffer, WideSpectralBuffer, Writer};
use std::io;

/// A thread's light-tracing splats.
pub(super) type Buffers = (WideBuffer, SquareBuffer, Option<WideSpectralBuffer>);

/// Exact sums of light-tracing splats.
pub struct LightSums {
    film: Film,
    squares: Squares,
    spectra: Option<SpectralFilm>,
}

impl LightSums {
    /// Black.
    pub(super) fn new(crop: Crop, bins: Option<Bins>) -> Self {
        Self {
            film: Film::new(crop),
            squares: Squares::new(crop),
            spectra: bins.map(|b| SpectralFilm::new(crop, b)),
        }
    }

    /// Adds a thread's splats.
    pub(super) fn absorb(&mut self, (mut colors, squares, spectral): Buffers) {
        self.film.absorb_wide(&mut colors);
        self.squares.merge(squares.squares());
        if let (Some(f), Some(mut b)) = (&mut self.spectra, spectral) {
            f.absorb_wide(&mut b);
        }
    }

    /// Adds other sums of the same image.
    pub(super) fn merge(&mut self, other: &Self) {
        self.film.merge(&other.film);
        self.squares.merge(&other.squares);
        if let (Some(a), Some(b)) = (&mut self.spectra, &other.spectra) {
            a.merge(b);
        }
    }

    /// Writes the sums.
    pub(super) fn save(&self, w: &mut Writer) -> io::Result<()> {
        self.film.save(w)?;
        self.squares.save(w)?;
        self.spectra.as_ref().map_or(Ok(()), |s| s.save(w))
    }

    /// What [`Self::save`] wrote beside these camera samples.
    pub(super) fn read(r: &mut Reader, camera: &CameraSums) -> Result<Self, Malformed> {
        let crop = camera.crop;
        let bins = camera.spectra.as_ref().map(|s| s.0);
        Ok(Self {
            film: Film::read(r, crop)?,
            squares: Squares::read(r, crop)?,
            spectra: bins.map(|b| SpectralFilm::read(r, crop, b)).transpose()?,
        })
    }
}

/// Camera samples and splats as one image. What a sample gives its own pixel from both sides is taken for independent:
/// of all the samples that may splat there it is one.
pub(super) fn sampled(
    camera: &CameraSums,
    light: Option<&LightSums>,
    target_met: bool,
) -> Rendered {
    let mut errors = PixelErrors {
        variance: camera.variance(),
        freedom: camera.freedom(),
    };
    let (mut image, mut spectrum) = (camera.image(), camera.spectrum());
    if let Some(light) = light {
        // Light sub-paths: every camera sample also traced one towards the whole image.
        let samples = camera.whole_samples();
        let splats = light.film.to_xyz(samples.recip());
        let variance = light.squares.variance(samples, splats.iter().map(|p| p[1]));
        // Every sample of the image could have splatted anywhere.
        errors.add(&variance, u64::MAX);
        for (p, s) in image.iter_mut().zip(splats) {
            for c in 0..3 {
                p[c] += s[c];
            }
        }
        if let (Some(sums), Some(film)) = (&mut spectrum, &light.spectra) {
            for (a, b) in sums.iter_mut().zip(film.to_values(samples.recip())) {
                *a += b as f64;
            }
        }
    }
    Rendered {
        image,
        spectrum,
        samples: camera.samples as u64,
        errors,
        target_met,
    }
}
