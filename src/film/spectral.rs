//! Spectral bins: radiance per nm in equal slices of 360–830 nm, with the same exact sums as [`super::Film`].

use super::{Crop, Fault, Filter, Malformed, Reader, Writer, exact};
use glam::Vec2;
use std::io;

/// First and last wavelength of the simulation, nm.
const RANGE: [f64; 2] = [360.0, 830.0];

/// Units of the buffer's integers: 2³⁰ of them make 1.
const ONE: f64 = 1_073_741_824.0;

/// Bits that the film's units, 2⁻⁶⁴, are finer than the buffer's.
const FINER: u32 = 34;

/// Units of the film's integers: 2⁶⁴ of them make 1.
const FILM_ONE: f64 = 18_446_744_073_709_551_616.0;

/// Largest value of one lane per bin and unit weight: with the floor of `Target::Bins` f·nm/τ is at most 1/0.0075, and
/// a bin is at least 1 nm wide.
pub const LARGEST: f32 = 256.0;

/// Σ weights at which a buffer must be flushed, and the largest single weight: 2¹⁹. With 16 lanes in one bin that makes
/// 2¹⁹ · 2⁸ · 2⁴, a quarter of the 2³³ that fit; see [`super::SplatBuffer`].
const FULL: f64 = 524_288.0;

/// Equal slices of the simulated range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bins {
    /// How many, 1..=470.
    pub count: usize,
}

impl Bins {
    /// `count` slices, held within 1..=470 (one a nanometre).
    pub fn new(count: usize) -> Self {
        Self {
            count: count.clamp(1, 470),
        }
    }

    /// Width of a bin in nm.
    pub fn width(&self) -> f64 {
        (RANGE[1] - RANGE[0]) / self.count as f64
    }

    /// Centre of a bin in nm.
    pub fn center(&self, bin: usize) -> f64 {
        RANGE[0] + (bin as f64 + 0.5) * self.width()
    }

    /// The bin of a wavelength in nm; the ends belong to the outer bins.
    #[inline]
    pub fn index(&self, lambda: f32) -> usize {
        (((lambda as f64 - RANGE[0]) / self.width()) as usize).min(self.count - 1)
    }
}

/// The image's exact sums, one a bin and pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SpectralFilm {
    crop: Crop,
    bins: Bins,
    /// Units of 2⁻⁶⁴, `[pixel · bins + bin]`.
    sums: Vec<i128>,
}

impl SpectralFilm {
    /// A black film.
    pub fn new(crop: Crop, bins: Bins) -> Self {
        Self {
            crop,
            bins,
            sums: vec![0; crop.pixels() * bins.count],
        }
    }

    /// The slices.
    pub fn bins(&self) -> Bins {
        self.bins
    }

    /// The pixels it covers.
    pub fn crop(&self) -> Crop {
        self.crop
    }

    /// Adds a buffer's sums and clears it.
    pub fn absorb(&mut self, buffer: &mut SpectralBuffer) {
        assert_eq!((self.crop, self.bins), (buffer.crop, buffer.bins));
        for (a, b) in self.sums.iter_mut().zip(&mut buffer.sums) {
            *a += (*b as i128) << FINER;
            *b = 0;
        }
        buffer.load = 0.0;
    }

    /// Adds a wide buffer's sums and clears it.
    pub fn absorb_wide(&mut self, buffer: &mut WideSpectralBuffer) {
        self.merge(&buffer.film);
        buffer.film.sums.fill(0);
    }

    /// Adds another film's sums.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!((self.crop, self.bins), (other.crop, other.bins));
        for (a, b) in self.sums.iter_mut().zip(&other.sums) {
            *a = a.wrapping_add(*b);
        }
    }

    /// Writes the sums.
    pub fn save(&self, w: &mut Writer) -> io::Result<()> {
        w.integers(self.sums.iter().copied())
    }

    /// A film whose sums [`Self::save`] wrote.
    pub fn read(r: &mut Reader, crop: Crop, bins: Bins) -> Result<Self, Malformed> {
        let sums = r.integers(crop.pixels() * bins.count)?.collect();
        Ok(Self { crop, bins, sums })
    }

    /// Adds `value · h / width` to a wavelength's bin of every pixel whose filter covers the raster point.
    fn add(&mut self, filter: &Filter, raster: Vec2, lambda: f32, value: f64) {
        let scale = value / self.bins.width();
        let bin = self.bins.index(lambda);
        let Self { crop, bins, sums } = self;
        filter.for_pixels(raster, |x, y, h| {
            if let Some(i) = crop.index(x, y) {
                // A power of two: only bits below 2⁻⁶⁴ are lost, whatever the order.
                sums[i * bins.count + bin] +=
                    (scale * h as f64 * FILM_ONE).round_ties_even() as i128;
            }
        });
    }

    /// Radiance per nm times `scale`, `[pixel · bins + bin]`.
    pub fn to_values(&self, scale: f64) -> Vec<f32> {
        let k = scale / FILM_ONE;
        self.sums.iter().map(|&v| (v as f64 * k) as f32).collect()
    }
}

/// A thread's exact sums of spectra of any size up to 2⁴⁰ per nm: light-tracing splats.
#[derive(Clone, Debug)]
pub struct WideSpectralBuffer {
    film: SpectralFilm,
    filter: Filter,
}

impl WideSpectralBuffer {
    /// A black buffer.
    pub fn new(crop: Crop, bins: Bins, filter: Filter) -> Self {
        Self {
            film: SpectralFilm::new(crop, bins),
            filter,
        }
    }

    /// As [`SpectralBuffer::splat`] with weight 1.
    pub fn splat(
        &mut self,
        raster: Vec2,
        lanes: impl Iterator<Item = (f32, f64)> + Clone,
    ) -> Result<(), Fault> {
        for (_, v) in lanes.clone() {
            if let Some(fault) = Fault::of(v, exact::LARGEST) {
                return Err(fault);
            }
        }
        if !raster.is_finite() {
            return Err(Fault::NotANumber);
        }
        for (lambda, v) in lanes {
            self.film.add(&self.filter, raster, lambda, v);
        }
        Ok(())
    }
}

/// A thread's exact sums over the whole crop.
#[derive(Clone, Debug)]
pub struct SpectralBuffer {
    crop: Crop,
    bins: Bins,
    filter: Filter,
    sums: Vec<i64>,
    load: f64,
}

impl SpectralBuffer {
    /// A black buffer.
    pub fn new(crop: Crop, bins: Bins, filter: Filter) -> Self {
        Self {
            crop,
            bins,
            filter,
            sums: vec![0; crop.pixels() * bins.count],
            load: 0.0,
        }
    }

    /// Adds a path's spectrum. `lanes` holds a wavelength and a value f·nm/τ each (`Lanes::nm`); the bin gets
    /// value · weight · h / width. Adds nothing on a fault.
    pub fn splat(
        &mut self,
        raster: Vec2,
        lanes: impl Iterator<Item = (f32, f32)> + Clone,
        weight: f32,
    ) -> Result<(), Fault> {
        let per_nm = 1.0 / self.bins.width();
        for (_, v) in lanes.clone() {
            if let Some(fault) = Fault::of(v as f64 * per_nm, LARGEST as f64) {
                return Err(fault);
            }
        }
        if let Some(fault) = Fault::of(weight as f64, FULL) {
            return Err(fault);
        }
        if !raster.is_finite() {
            return Err(Fault::NotANumber);
        }
        self.load += weight as f64;
        let Self {
            crop,
            bins,
            filter,
            sums,
            ..
        } = self;
        filter.for_pixels(raster, |x, y, h| {
            if let Some(i) = crop.index(x, y) {
                let scale = weight as f64 * per_nm * h as f64 * ONE;
                for (lambda, v) in lanes.clone() {
                    sums[i * bins.count + bins.index(lambda)] +=
                        (v as f64 * scale).round_ties_even() as i64;
                }
            }
        });
        Ok(())
    }

    /// Absorb the buffer before the next splat.
    pub fn is_full(&self) -> bool {
        self.load >= FULL
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::real::Convert;
    use crate::scene::spectrum::{Lanes, Target};
    use crate::scene::{FilterKind, FilterSettings};

    #[test]
    fn a_constant_spectrum_fills_every_bin_alike() {
        let crop = Crop::from([0, 0, 1, 1]);
        let bins = Bins::new(10);
        let filter = Filter::new(&FilterSettings {
            kind: FilterKind::Box,
            radius: [0.5; 2],
        });
        let mut buffer = SpectralBuffer::new(crop, bins, filter);
        let mut film = SpectralFilm::new(crop, bins);
        let n = 20_000;
        for i in 0..n {
            let l = Lanes::<4>::with(((i as f32 + 0.5) / n as f32).real(), Target::Bins);
            let nm = l.nm();
            // f = 2 at every wavelength, divided by a τ of 4 whose weight is handed back.
            let lanes =
                (0..4).map(|k| (l.lambda[k].single(), (2.0 * nm[k] / 4.0 / 470.0).single()));
            buffer.splat(Vec2::splat(0.5), lanes, 4.0).unwrap();
        }
        film.absorb(&mut buffer);
        for v in film.to_values(470.0 / n as f64) {
            // One sample more or less at a bin's end: 10 bins share 4n samples, and the sparsest holds 2 % of them.
            assert!((v - 2.0).abs() < 2.0 * 2e-3, "{v}");
        }
    }

    #[test]
    fn bins_tile_the_range() {
        let b = Bins::new(47);
        assert_eq!(b.width(), 10.0);
        assert_eq!(b.center(0), 365.0);
        assert_eq!((b.index(360.0), b.index(369.9), b.index(830.0)), (0, 0, 46));
        assert_eq!(Bins::new(0).count, 1);
    }
}
