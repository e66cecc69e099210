//! RGB → smooth reflectance (Jakob & Hanika 2019): sigmoid of a quadratic in wavelength.

use super::{Lanes, Spectrum};
use crate::real::{Convert, Real};
use std::sync::LazyLock;

/// `s(c0·λ² + c1·λ + c2)` with `s(x) = 1/2 + x / (2·√(1 + x²))`, λ in nm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sigmoid {
    /// Quadratic coefficient.
    pub c0: f32,
    /// Linear coefficient.
    pub c1: f32,
    /// Constant.
    pub c2: f32,
}

impl Sigmoid {
    /// The reflectance `v` in 0..=1 at every wavelength: c2 = (v − ½) / √(v·(1 − v)), infinite at 0 and 1.
    #[inline]
    pub fn constant(v: f32) -> Self {
        Self {
            c0: 0.0,
            c1: 0.0,
            c2: (v - 0.5) / (v * (1.0 - v)).max(0.0).sqrt(),
        }
    }

    /// Value in 0..=1 at one wavelength.
    #[inline]
    pub fn at(&self, lambda: Real) -> Real {
        let x = (self.c0.real() * lambda + self.c1.real()) * lambda + self.c2.real();
        // Infinite coefficients stand for 0 and 1: at ±2⁶⁰ the sigmoid is exactly that, and x² still fits.
        const FAR: Real = (1u64 << 60) as Real;
        let x = x.clamp(-FAR, FAR);
        0.5 + x / (2.0 * (1.0 + x * x).sqrt())
    }

    /// Values at the wavelengths of `lanes`.
    #[inline]
    pub fn eval<const N: usize>(&self, lanes: &Lanes<N>) -> Spectrum<N> {
        Spectrum::from_fn(|i| self.at(lanes.lambda[i]))
    }
}

/// Nodes along each axis of the table.
pub(super) const RES: usize = 32;

/// Entries of the table: largest component, then its value, then the ratios of the other two.
pub(super) const ENTRIES: usize = 3 * RES * RES * RES;

/// The table of coefficients for linear sRGB.
///
/// A cell is addressed by the index of the largest component, its value z on a grid that is dense near 0 and 1
/// (see `z_nodes`), and the ratios x, y of the next two components to it, on uniform grids over 0..=1.
pub struct Rgb2Spec {
    z: [f32; RES],
    /// c0, c1, c2 and a spare; `[((max·RES + z)·RES + y)·RES + x]`.
    table: Vec<[f32; 4]>,
}

/// Values of the largest component at the nodes: a smoothstep of a smoothstep, as in the paper's supplement, since the
/// coefficients grow without bound towards 0 and 1. The first node stands at 1 % of the second instead of 0.
pub(super) fn z_nodes() -> [f64; RES] {
    let smooth = |x: f64| x * x * (3.0 - 2.0 * x);
    let mut z: [f64; RES] = std::array::from_fn(|k| smooth(smooth(k as f64 / (RES - 1) as f64)));
    z[0] = 0.01 * z[1];
    z
}

impl Rgb2Spec {
    /// The one table.
    pub fn get() -> &'static Self {
        static TABLE: LazyLock<Rgb2Spec> =
            LazyLock::new(|| Rgb2Spec::decode(include_bytes!("data/rgb2spec.bin")));
        &TABLE
    }

    /// Reads the little-endian f32 triples that [`super::build_table`] writes.
    pub(super) fn decode(bytes: &[u8]) -> Self {
        assert_eq!(bytes.len(), ENTRIES * 12, "the coefficient table is whole");
        let f = |b: &[u8]| f32::from_le_bytes(b.try_into().expect("four bytes"));
        Self {
            z: z_nodes().map(|z| z as f32),
            table: bytes
                .chunks_exact(12)
                .map(|c| [f(&c[0..4]), f(&c[4..8]), f(&c[8..12]), 0.0])
                .collect(),
        }
    }

    /// Coefficients whose reflectance has linear sRGB `rgb` (each 0..=1) under D65. Exact for greys, 0 and 1 included;
    /// elsewhere trilinear between the nodes, and within 0.005 of `rgb` in
    /// every component.
    #[inline]
    pub fn fetch(&self, rgb: [f32; 3]) -> Sigmoid {
        let [r, g, b] = rgb;
        if r == g && g == b {
            return Sigmoid::constant(r);
        }
        let (max, z, px, py) = if r >= g && r >= b {
            (0, r, g, b)
        } else if g >= b {
            (1, g, b, r)
        } else {
            (2, b, r, g)
        };
        let to_grid = (RES - 1) as f32 / z;
        let (x, y) = (px * to_grid, py * to_grid);
        let (xi, yi) = ((x as usize).min(RES - 2), (y as usize).min(RES - 2));
        let zi = self.z[1..RES - 1].partition_point(|&v| v <= z);
        let fx = x - xi as f32;
        let fy = y - yi as f32;
        let fz = ((z - self.z[zi]) / (self.z[zi + 1] - self.z[zi])).max(0.0);
        let base = ((max * RES + zi) * RES + yi) * RES + xi;
        let at = |o: usize| self.table[base + o];
        let row = |o: usize| mix(at(o), at(o + 1), fx);
        let slab = |o: usize| mix(row(o), row(o + RES), fy);
        let [c0, c1, c2, _] = mix(slab(0), slab(RES * RES), fz);
        Sigmoid { c0, c1, c2 }
    }
}

#[inline]
fn mix(a: [f32; 4], b: [f32; 4], f: f32) -> [f32; 4] {
    std::array::from_fn(|i| a[i] + f * (b[i] - a[i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::spectrum::rgb_table::rgb_of;

    #[test]
    fn greys_are_exact() {
        let t = Rgb2Spec::get();
        for v in [0.0f32, 1e-6, 0.18, 0.5, 0.999, 1.0] {
            let s = t.fetch([v; 3]);
            for l in [360.0, 555.0, 830.0] {
                assert!((s.at(l) - v.real()).abs() < 2e-7, "{v}");
                assert!((v != 0.0 && v != 1.0) || s.at(l) == v.real());
            }
        }
    }

    #[test]
    fn table_gives_rgb_back() {
        let t = Rgb2Spec::get();
        let n = 12;
        let (mut worst, mut sum, mut count) = (0.0f64, 0.0, 0.0);
        let mut at = [0.0; 3];
        for i in 0..=n {
            for j in 0..=n {
                for k in 0..=n {
                    let rgb = [i, j, k].map(|v| v as f32 / n as f32);
                    let got = rgb_of(&t.fetch(rgb));
                    for c in 0..3 {
                        let e = (got[c] - rgb[c] as f64).abs();
                        if e > worst {
                            (worst, at) = (e, rgb);
                        }
                        sum += e;
                        count += 1.0;
                    }
                }
            }
        }
        // What the grid of 32 nodes leaves: under 1.3 steps of an 8-bit channel at worst, an eighth of one on average.
        assert!(worst < 0.005, "{worst} at {at:?}");
        assert!(sum / count < 5e-4, "{}", sum / count);
    }

    #[test]
    fn fetch_is_bounded_and_continuous_over_sectors() {
        let t = Rgb2Spec::get();
        // Just either side of r = g the two sectors' tables must agree.
        for (z, b) in [(0.8, 0.1), (0.3, 0.2), (0.05, 0.0), (0.95, 0.5)] {
            let a = t.fetch([z, z * 0.99999, b]);
            let c = t.fetch([z * 0.99999, z, b]);
            for l in [400.0, 500.0, 600.0, 700.0] {
                assert!((a.at(l) - c.at(l)).abs() < 2e-2, "{z} {b} {l}");
                assert!((0.0..=1.0).contains(&a.at(l)));
            }
        }
    }
}
