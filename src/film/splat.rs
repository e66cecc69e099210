//! A thread's sums of bounded splats: 64-bit fixed point over the whole crop.
//!
//! A Markov chain adds f/τ · weight, where the weights of one step sum to 1 and f/τ is bounded by the choice of τ
//! (`TARGET_MIX`). So a pixel's sum is at most [`LARGEST`]·(steps since the last flush), whatever path the chain took,
//! and 64 bits hold it exactly as long as [`SplatBuffer::is_full`] is heeded.

use super::{Crop, Fault, Filter};
use glam::{Vec2, Vec4};

/// Units of the integers: 2³² of them make 1. A splat is rounded to the nearest unit, an error below 1.2·10⁻¹⁰.
const ONE: f64 = 4_294_967_296.0;

/// Largest X, Y or Z of a splat before its weight: 2⁸. The mixed target gives at most 3.3, luminance alone 187.
pub const LARGEST: f32 = 256.0;

/// Σ weights at which a buffer must be flushed, and the largest single weight: 2²¹. An i64 in units of 2⁻³² holds 2³¹;
/// 2²¹ · 2⁸ is a quarter of that, so a last splat of the largest weight and a filter that peaks at 2 still fit.
const FULL: f64 = 2_097_152.0;

/// Below this a splat fits [`round_small`], whatever the filter: 2⁴⁸, and no filter peaks at 2³.
const SMALL: f64 = 281_474_976_710_656.0;

/// Exact thread-local sums of X, Y, Z.
#[derive(Clone, Debug)]
pub struct SplatBuffer {
    crop: Crop,
    filter: Filter,
    pixels: Vec<Pixel>,
    load: f64,
}

/// X, Y, Z, so that a pixel never straddles two cache lines, and how much of Y has been settled (see `GroupFilm`).
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
struct Pixel([i64; 4]);

impl Pixel {
    #[inline(always)]
    fn add(&mut self, v: [i64; 4]) {
        for (sum, v) in self.0.iter_mut().zip(v) {
            *sum += v;
        }
    }
}

impl SplatBuffer {
    /// A black buffer.
    pub fn new(crop: Crop, filter: Filter) -> Self {
        Self {
            crop,
            filter,
            pixels: vec![Pixel::default(); crop.pixels()],
            load: 0.0,
        }
    }

    /// The pixels it covers.
    pub fn crop(&self) -> Crop {
        self.crop
    }

    /// Adds `xyz · weight · h` to every pixel whose filter covers the raster point. `weight` ≥ 0 may exceed 1 (a chain
    /// that stood still collects its weight). Adds nothing on a fault.
    #[inline]
    pub fn splat(&mut self, raster: Vec2, xyz: [f32; 3], weight: f32) -> Result<(), Fault> {
        let [x, y, z] = xyz;
        let value = Vec4::new(x, y, z, weight);
        let fits = value.cmpge(Vec4::ZERO)
            & value.cmple(Vec4::new(LARGEST, LARGEST, LARGEST, FULL as f32));
        if !(fits.all() & raster.is_finite()) {
            return Err(fault(raster, xyz, weight));
        }
        self.load += weight as f64;
        let scale = weight as f64 * ONE;
        let v = [x, y, z, 0.0].map(|v| v as f64 * scale);
        if x.max(y).max(z) as f64 * scale < SMALL {
            self.spread(raster, v, round_small);
        } else {
            self.spread(raster, v, |v| v.round_ties_even() as i64);
        }
        Ok(())
    }

    /// Adds `v` · h, each rounded by `round`, to the pixels around a raster point.
    #[inline(always)]
    fn spread(&mut self, raster: Vec2, v: [f64; 4], round: impl Fn(f64) -> i64) {
        let Self {
            crop,
            filter,
            pixels,
            ..
        } = self;
        if filter.is_unit_box() {
            if let Some(i) = crop.index(raster.x.floor() as i64, raster.y.floor() as i64) {
                pixels[i].add(v.map(round));
            }
            return;
        }
        filter.for_rows(raster, |y, first, hx, hy| {
            let (skip, i, n) = crop.stretch(first, hx.len(), y);
            for (pixel, h) in pixels[i..i + n].iter_mut().zip(&hx[skip..]) {
                let h = (hy * h) as f64;
                pixel.add(v.map(|v| round(v * h)));
            }
        });
    }

    /// Reads a word of each row of pixels that a splat at `raster` will add to. Asked of several splats before the first is
    /// added, the waits for memory overlap.
    #[inline]
    pub fn touch(&self, raster: Vec2) -> i64 {
        let rows = self.filter.rows(raster.y);
        let x = raster.x.floor() as i64;
        let word = |y| {
            let i = self.crop.index(x, y);
            i.map_or(0, |i| self.pixels[i].0[0])
        };
        rows.fold(0, |sum, y| sum ^ word(y))
    }

    /// The sums are near what they can hold: absorb the buffer before the next splat.
    #[inline]
    pub fn is_full(&self) -> bool {
        self.load >= FULL
    }

    /// Hands what each pixel's Y has grown by since the last call to `f`, in units of 2⁻³².
    pub(super) fn settle(&mut self, mut f: impl FnMut(usize, i64)) {
        for (i, p) in self.pixels.iter_mut().enumerate() {
            let [_, y, _, settled] = p.0;
            if y != settled {
                f(i, y - settled);
                p.0[3] = y;
            }
        }
    }

    /// Hands each non-zero pixel's integers (units of 2⁻³²) to `f` and clears the buffer.
    pub(super) fn drain(&mut self, mut f: impl FnMut(usize, [i64; 3])) {
        for (i, p) in self.pixels.iter_mut().enumerate() {
            let [x, y, z, _] = p.0;
            if x | y | z != 0 {
                f(i, [x, y, z]);
                *p = Pixel::default();
            }
        }
        self.load = 0.0;
    }
}

/// What is wrong with a splat that is not taken.
#[cold]
fn fault(raster: Vec2, xyz: [f32; 3], weight: f32) -> Fault {
    let over = |v: f32, largest: f64| Fault::of(v as f64, largest);
    let value = xyz.iter().find_map(|&v| over(v, LARGEST as f64));
    match value.or(over(weight, FULL)) {
        Some(f) => f,
        None if raster.is_finite() => Fault::TooLarge,
        None => Fault::NotANumber,
    }
}

/// To the nearest integer, ties to even, for |v| < 2⁵¹: 1.5·2⁵² + v is a double whose last bit is worth 1.
#[inline(always)]
fn round_small(v: f64) -> i64 {
    const MAGIC: f64 = 6_755_399_441_055_744.0;
    (v + MAGIC).to_bits().wrapping_sub(MAGIC.to_bits()) as i64
}

#[cfg(test)]
mod tests {
    use super::super::{Film, FixedWeight};
    use super::*;
    use crate::scene::{FilterKind, FilterSettings};

    fn buffer(kind: FilterKind, r: f32) -> SplatBuffer {
        SplatBuffer::new(
            Crop::from([2, 1, 8, 6]),
            Filter::new(&FilterSettings {
                kind,
                radius: [r, r],
            }),
        )
    }

    #[test]
    fn order_and_flushing_do_not_matter() {
        let kind = FilterKind::Mitchell {
            b: 1.0 / 3.0,
            c: 1.0 / 3.0,
        };
        let w = FixedWeight::new(0.7231).unwrap();
        let run = |order: &mut dyn Iterator<Item = u32>, every: usize| {
            let mut b = buffer(kind, 2.0);
            let mut film = Film::new(b.crop());
            for (n, i) in order.enumerate() {
                let p = Vec2::new(1.0 + (i % 77) as f32 * 0.1, (i % 53) as f32 * 0.13);
                let s = 1.0 / (1.0 + i as f32);
                b.splat(p, [s, 3.0 * s, 0.1], s).unwrap();
                if n % every == 0 {
                    film.absorb_weighted(&mut b, w);
                }
            }
            film.absorb_weighted(&mut b, w);
            film
        };
        let a = run(&mut (0..500), 7);
        assert_eq!(a, run(&mut (0..500).rev(), 1));
        assert_eq!(a, run(&mut (0..500).map(|i| i * 77 % 500), 1000));
        assert_ne!(a, run(&mut (1..500), 7));
    }

    #[test]
    fn both_ways_of_rounding_agree() {
        let mut v = 1e-3;
        while v < SMALL * 8.0 {
            for v in [v, v.floor() + 0.5, v.floor() + 1.5] {
                for v in [v, -v] {
                    assert_eq!(round_small(v), v.round_ties_even() as i64, "{v}");
                }
            }
            v *= 1.37;
        }
    }

    #[test]
    fn ten_million_adds_lose_nothing() {
        let mut b = buffer(FilterKind::Box, 0.5);
        let mut film = Film::new(b.crop());
        let n = 10_000_000u32;
        // 0.1f32 is not a binary fraction: the sum is n times its rounding to 2⁻³², exactly.
        let unit = (0.1f32 as f64 * ONE).round_ties_even() / ONE;
        for _ in 0..n {
            b.splat(Vec2::new(3.5, 2.5), [0.1, 1.0, 0.0], 1.0).unwrap();
            if b.is_full() {
                film.absorb(&mut b);
            }
        }
        film.absorb(&mut b);
        let v = film.to_xyz(1.0)[6 + 1];
        assert_eq!(v, [unit * n as f64, n as f64, 0.0]);
        assert_eq!(film.total(), v);
    }

    #[test]
    fn a_full_buffer_of_the_largest_splats_does_not_overflow() {
        let mut b = buffer(FilterKind::Box, 0.5);
        let mut film = Film::new(b.crop());
        for _ in 0..2 {
            b.splat(Vec2::new(3.5, 2.5), [LARGEST; 3], FULL as f32 * 0.999)
                .unwrap();
        }
        assert!(b.is_full());
        film.absorb(&mut b);
        let expect = 2.0 * LARGEST as f64 * (FULL as f32 * 0.999) as f64;
        assert_eq!(film.to_xyz(1.0)[7], [expect; 3]);
    }

    #[test]
    fn faults_are_told_apart_and_points_outside_are_fine() {
        let mut b = buffer(FilterKind::Box, 0.5);
        let p = Vec2::new(3.5, 2.5);
        assert_eq!(b.splat(p, [f32::NAN; 3], 1.0), Err(Fault::NotANumber));
        assert_eq!(b.splat(p, [-1.0; 3], 1.0), Err(Fault::Negative));
        assert_eq!(b.splat(p, [1e9; 3], 1.0), Err(Fault::TooLarge));
        assert_eq!(b.splat(p, [1.0; 3], f32::NAN), Err(Fault::NotANumber));
        assert_eq!(b.splat(p, [1.0; 3], -0.5), Err(Fault::Negative));
        b.splat(Vec2::new(-3.0, 1e9), [1.0; 3], 1.0).unwrap();
        b.drain(|_, _| panic!("nothing was added"));
    }
}
