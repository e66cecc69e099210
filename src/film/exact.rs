//! Exact sums: 128-bit fixed point per pixel and channel, so any order of additions gives the same bits.

use super::{Crop, Filter, Malformed, Reader, SplatBuffer, Writer};
use glam::Vec2;
use std::io;

/// Units of the film's integers: 2⁶⁴ of them make 1.
const ONE: f64 = 18_446_744_073_709_551_616.0;

/// Largest contribution a film takes: 2⁴⁰, which leaves room for 2²³ of that size in each channel of each pixel.
pub const LARGEST: f64 = 1_099_511_627_776.0;

/// Why a contribution was not added. Callers count these by kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fault {
    /// Not a number.
    NotANumber,
    /// Below zero where that cannot be.
    Negative,
    /// Infinite, or beyond what the sums can hold.
    TooLarge,
}

impl Fault {
    /// The fault of `v` as a tristimulus value that must lie in 0..=`limit`, if any.
    #[inline]
    pub fn of(v: f64, limit: f64) -> Option<Self> {
        if v >= 0.0 && v <= limit {
            None
        } else if v.is_nan() {
            Some(Self::NotANumber)
        } else if v < 0.0 {
            Some(Self::Negative)
        } else {
            Some(Self::TooLarge)
        }
    }
}

/// A non-negative factor that is a whole multiple of 2⁻³², below 2¹⁵, so that a product with a splat sum is exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedWeight(u64);

impl FixedWeight {
    /// 1.
    pub const ONE: Self = Self(1 << 32);

    /// The nearest such factor, or `None` outside 0..2¹⁵.
    pub fn new(w: f64) -> Option<Self> {
        (0.0..32768.0)
            .contains(&w)
            .then(|| Self((w * 4_294_967_296.0).round_ties_even() as u64))
    }

    /// The factor that is really applied.
    pub fn value(self) -> f64 {
        self.0 as f64 / 4_294_967_296.0
    }
}

/// The image's exact sums of X, Y, Z.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Film {
    crop: Crop,
    sums: Vec<[i128; 3]>,
}

impl Film {
    /// A black film.
    pub fn new(crop: Crop) -> Self {
        Self {
            crop,
            sums: vec![[0; 3]; crop.pixels()],
        }
    }

    /// The pixels it covers.
    pub fn crop(&self) -> Crop {
        self.crop
    }

    /// Adds a buffer's sums and clears it.
    pub fn absorb(&mut self, buffer: &mut SplatBuffer) {
        self.absorb_weighted(buffer, FixedWeight::ONE);
    }

    /// Adds a buffer's sums times a weight and clears it. Exact, so it does not matter how often a buffer is flushed.
    pub fn absorb_weighted(&mut self, buffer: &mut SplatBuffer, weight: FixedWeight) {
        assert_eq!(
            self.crop,
            buffer.crop(),
            "buffer and film cover the same pixels"
        );
        let w = weight.0 as i128;
        buffer.drain(|i, v| {
            for (sum, v) in self.sums[i].iter_mut().zip(v) {
                // |v| < 2⁶³ and w < 2⁴⁷: the product is below 2¹¹⁰ and in units of 2⁻⁶⁴.
                *sum += v as i128 * w;
            }
        });
    }

    /// Adds a wide buffer's sums and clears it.
    pub fn absorb_wide(&mut self, buffer: &mut WideBuffer) {
        assert_eq!(
            self.crop, buffer.film.crop,
            "buffer and film cover the same pixels"
        );
        self.merge(&buffer.film);
        buffer.film.sums.fill([0; 3]);
    }

    /// Adds another film's sums.
    pub fn merge(&mut self, other: &Film) {
        assert_eq!(self.crop, other.crop, "films cover the same pixels");
        for (a, b) in self.sums.iter_mut().zip(&other.sums) {
            for c in 0..3 {
                a[c] = a[c].wrapping_add(b[c]);
            }
        }
    }

    /// The sums times `scale`, row-major.
    pub fn to_xyz(&self, scale: f64) -> Vec<[f64; 3]> {
        let k = scale / ONE;
        self.sums.iter().map(|p| p.map(|v| v as f64 * k)).collect()
    }

    /// Sum over all pixels of X, Y, Z: the exact total, for averages.
    pub fn total(&self) -> [f64; 3] {
        std::array::from_fn(|c| self.sums.iter().map(|p| p[c]).sum::<i128>() as f64 / ONE)
    }

    /// Writes the sums.
    pub fn save(&self, w: &mut Writer) -> io::Result<()> {
        w.integers(self.sums.iter().flatten().copied())
    }

    /// A film whose sums [`Self::save`] wrote.
    pub fn read(r: &mut Reader, crop: Crop) -> Result<Self, Malformed> {
        let mut all = r.integers(3 * crop.pixels())?;
        let mut film = Self::new(crop);
        for s in film.sums.iter_mut().flatten() {
            *s = all.next().expect("as many as asked for");
        }
        Ok(film)
    }

    /// The raw integers in units of 2⁻⁶⁴, row-major.
    pub fn raw(&self) -> &[[i128; 3]] {
        &self.sums
    }
}

/// A thread's exact sums of contributions of any size up to 2⁴⁰: light-tracing splats.
#[derive(Clone, Debug)]
pub struct WideBuffer {
    film: Film,
    filter: Filter,
}

impl WideBuffer {
    /// A black buffer.
    pub fn new(crop: Crop, filter: Filter) -> Self {
        Self {
            film: Film::new(crop),
            filter,
        }
    }

    /// Adds `xyz · h` to every pixel whose filter covers the raster point. Adds nothing on a fault.
    pub fn splat(&mut self, raster: Vec2, xyz: [f64; 3]) -> Result<(), Fault> {
        for v in xyz {
            if let Some(fault) = Fault::of(v, LARGEST) {
                return Err(fault);
            }
        }
        if !raster.is_finite() {
            return Err(Fault::NotANumber);
        }
        let Film { crop, sums } = &mut self.film;
        self.filter.for_pixels(raster, |x, y, h| {
            if let Some(i) = crop.index(x, y) {
                for c in 0..3 {
                    sums[i][c] += to_fixed(xyz[c] * h as f64);
                }
            }
        });
        Ok(())
    }
}

/// The nearest multiple of 2⁻⁶⁴. Scaling by a power of two is exact, so only bits below 2⁻⁶⁴ are lost, whatever the order.
#[inline]
fn to_fixed(v: f64) -> i128 {
    (v * ONE).round_ties_even() as i128
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{FilterKind, FilterSettings};

    fn filter(kind: FilterKind, r: f32) -> Filter {
        Filter::new(&FilterSettings {
            kind,
            radius: [r, r],
        })
    }

    #[test]
    fn wide_sums_do_not_depend_on_order() {
        let crop = Crop::from([0, 0, 4, 4]);
        let splats: Vec<(Vec2, [f64; 3])> = (0..200)
            .map(|i| {
                let s = (i as f64 * 0.37).sin().abs();
                let size = 10f64.powi(i % 20 - 12);
                (
                    Vec2::new((i % 37) as f32 * 0.1, (i % 31) as f32 * 0.12),
                    [s * size, size, s],
                )
            })
            .collect();
        let run = |order: &mut dyn Iterator<Item = usize>| {
            let mut b = WideBuffer::new(crop, filter(FilterKind::Gaussian { sigma: 0.5 }, 1.5));
            for i in order {
                b.splat(splats[i].0, splats[i].1).unwrap();
            }
            let mut f = Film::new(crop);
            f.absorb_wide(&mut b);
            f
        };
        let a = run(&mut (0..200));
        assert_eq!(a, run(&mut (0..200).rev()));
        assert_eq!(a, run(&mut (0..200).map(|i| i * 77 % 200)));
        assert_ne!(a, run(&mut (1..200)));
    }

    #[test]
    fn faults_are_told_apart_and_add_nothing() {
        let crop = Crop::from([0, 0, 2, 2]);
        let mut b = WideBuffer::new(crop, filter(FilterKind::Box, 0.5));
        let p = Vec2::new(0.5, 0.5);
        assert_eq!(b.splat(p, [1.0, f64::NAN, 1.0]), Err(Fault::NotANumber));
        assert_eq!(b.splat(p, [1.0, -1.0, 1.0]), Err(Fault::Negative));
        assert_eq!(b.splat(p, [f64::INFINITY, 0.0, 1.0]), Err(Fault::TooLarge));
        assert_eq!(b.splat(p, [2.0 * LARGEST, 0.0, 1.0]), Err(Fault::TooLarge));
        assert_eq!(b.splat(Vec2::NAN, [1.0; 3]), Err(Fault::NotANumber));
        assert_eq!(b.film, Film::new(crop));
        b.splat(p, [1.0, 0.25, 1e-18]).unwrap();
        let mut f = Film::new(crop);
        f.absorb_wide(&mut b);
        let v = f.to_xyz(2.0)[0];
        assert_eq!(v[..2], [2.0, 0.5]);
        // 1e-18 is 18.4 quanta: held to half a quantum.
        assert!((v[2] / 2e-18 - 1.0).abs() < 0.5 / 18.0);
    }

    #[test]
    fn fixed_weights_round_and_bound() {
        assert_eq!(FixedWeight::new(1.0), Some(FixedWeight::ONE));
        assert!(FixedWeight::new(-1.0).is_none() && FixedWeight::new(4e4).is_none());
        assert!(FixedWeight::new(f64::NAN).is_none());
        let w = FixedWeight::new(0.3).unwrap().value();
        assert!((w - 0.3).abs() <= 2f64.powi(-33));
    }
}
