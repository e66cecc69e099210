//! Digital nets in base 2, scrambled: points that fill squares and intervals evenly, however many are taken.
//!
//! The first 2^m points of a pair, and every block of 2^m after them, lie one each in the 2^m boxes of any cut of the square
//! into boxes 2^−a by 2^−b, a + b = m ((0,2)-sequence: Sobol' 1967). A point is the exclusive or of the columns that the bits
//! of its number choose, and a shift. Columns are scrambled by random triangular matrices (Matoušek 1998); with a uniform
//! shift the variance of a mean over points is then that of Owen's nested scrambling: n^(−3/2) where an edge divides the
//! square, never more than that of independent points but for a factor (Owen 1997). Each point alone is exactly uniform,
//! whatever the columns are.
//!
//! Between pairs numbers are permuted within blocks, by another triangular matrix, so that one pair says nothing of another.

use super::Rng;
use crate::real::{Convert, Vec2};

/// n points of a pair leave this times n^(−3/2) of one point's variance where a straight edge divides the square, in the mean
/// over edges: found with 20 000 random ones, for n = 8, 32 and 128.
pub const EDGE: f64 = 0.675;

/// Coordinates: pairs first.
const COORDINATES: usize = 8;

/// What a coordinate, or two, are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Pair {
    /// The point on the raster.
    Raster = 0,
    /// The point on the lens.
    Lens = 2,
    /// The point on a light.
    Light = 4,
}

/// What a single coordinate is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Single {
    /// The wavelength.
    Wavelength = 6,
    /// Which light.
    Choice = 7,
}

/// Scrambled columns of all coordinates. Points of one net with different shifts are independent enough for neighbours: the
/// covariance of their means is 0.
#[derive(Clone, Debug)]
pub struct Net {
    columns: [[u32; 32]; COORDINATES],
}

impl Net {
    /// Scrambled by `rng`.
    pub fn new(rng: &mut Rng) -> Self {
        let mut columns = [[0; 32]; COORDINATES];
        for (first, width) in [(0, 2), (2, 2), (4, 2), (6, 1), (7, 1)] {
            // Bit j of a number changes itself and bits below.
            let numbers: [u32; 32] = std::array::from_fn(|j| 1 << j | rng.next_u32() & low(j));
            for (k, of) in columns[first..first + width].iter_mut().enumerate() {
                let plain = if k == 0 { mirrored() } else { pascal() };
                // Digit d of a coordinate, bit 31 − d, changes itself and finer ones.
                let digits: [u32; 32] = std::array::from_fn(|b| 1 << b | rng.next_u32() & low(b));
                *of = numbers.map(|n| apply(&digits, apply(&plain, n)));
            }
        }
        Self { columns }
    }
}

/// Bits below bit `j`.
fn low(j: usize) -> u32 {
    (1 << j) - 1
}

/// A matrix over bits, by columns, times a number.
#[inline]
fn apply(columns: &[u32; 32], mut number: u32) -> u32 {
    let mut sum = 0;
    while number != 0 {
        sum ^= columns[number.trailing_zeros() as usize];
        number &= number - 1;
    }
    sum
}

/// A number's bits behind the point in reverse (van der Corput).
fn mirrored() -> [u32; 32] {
    std::array::from_fn(|j| 1 << (31 - j))
}

/// Pascal's triangle modulo 2: the other coordinate of the pair.
fn pascal() -> [u32; 32] {
    let mut columns = [1 << 31; 32];
    for j in 1..32 {
        columns[j] = columns[j - 1] ^ columns[j - 1] >> 1;
    }
    columns
}

/// One shift of a net: the points of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    net: &'a Net,
    shift: [u32; COORDINATES],
    /// What follows the bits of a single coordinate.
    tail: f64,
}

impl<'a> Points<'a> {
    /// Shifted by `rng`.
    pub fn new(net: &'a Net, rng: &mut Rng) -> Self {
        Self {
            net,
            shift: std::array::from_fn(|_| rng.next_u32()),
            tail: f64::from(rng.next_u32() >> 12) / f64::from(1 << 20),
        }
    }

    /// Coordinates of point `i` of a pair, multiples of 2⁻²⁴ in [0, 1). After 2³² points the same ones come again.
    #[inline]
    pub fn pair(&self, which: Pair, i: u64) -> glam::Vec2 {
        let k = which as usize;
        glam::Vec2::new(self.at(k, i), self.at(k + 1, i))
    }

    /// As [`Self::pair`], in the precision of transport.
    #[inline]
    pub fn square(&self, which: Pair, i: u64) -> Vec2 {
        self.pair(which, i).real()
    }

    /// Coordinate of point `i`, a multiple of 2⁻⁵² in [0, 1): as fine as a choice among many needs.
    #[inline]
    pub fn single(&self, which: Single, i: u64) -> f64 {
        (f64::from(self.digits(which as usize, i)) + self.tail) * (1.0 / (1u64 << 32) as f64)
    }

    #[inline]
    fn at(&self, k: usize, i: u64) -> f32 {
        (self.digits(k, i) >> 8) as f32 * (1.0 / (1 << 24) as f32)
    }

    #[inline]
    fn digits(&self, k: usize, i: u64) -> u32 {
        apply(&self.net.columns[k], i as u32) ^ self.shift[k]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use std::f64::consts::TAU;

    fn net(seed: u64) -> Net {
        Net::new(&mut Rng::new(seed, 900, 0, 0))
    }

    /// Every block of 2^m points has one in each box of every cut of the square into 2^m boxes, so every coordinate too.
    #[test]
    fn blocks_lie_one_in_each_box() {
        for seed in 0..20 {
            let net = net(seed);
            let points = Points::new(&net, &mut Rng::new(seed, 901, 0, 0));
            for pair in [Pair::Raster, Pair::Lens, Pair::Light] {
                for m in 0..8 {
                    for (a, block) in (0..=m).flat_map(|a| (0..3u64).map(move |b| (a, b))) {
                        let mut seen = vec![false; 1 << m];
                        for i in block << m..(block + 1) << m {
                            let p = points.pair(pair, i);
                            let (x, y) = (p.x * (1 << a) as f32, p.y * (1 << (m - a)) as f32);
                            let at = (x as usize) << (m - a) | y as usize;
                            assert!(!std::mem::replace(&mut seen[at], true), "{pair:?} {m} {a}");
                        }
                    }
                }
            }
            for which in [Single::Wavelength, Single::Choice] {
                for m in 0..8 {
                    let of = |i: u64| (points.single(which, i) * f64::from(1 << m)) as usize;
                    let mut cells: Vec<usize> = (0..1 << m).map(of).collect();
                    cells.sort_unstable();
                    assert!(cells.into_iter().eq(0..1 << m));
                }
            }
        }
    }

    /// The part of 2^m points of the raster that lie beyond an edge, for two nets and shifts of one seed.
    fn beyond(edge: impl Fn(glam::Vec2) -> bool, m: u32, seed: u64) -> [f64; 2] {
        [0, 1].map(|k| {
            let net = Net::new(&mut Rng::new(seed, 902, k, 0));
            let points = Points::new(&net, &mut Rng::new(seed, 903, k, 0));
            let n = 1 << m;
            let found = (0..n).filter(|i| edge(points.pair(Pair::Raster, *i)));
            found.count() as f64 / n as f64
        })
    }

    /// What [`EDGE`] says, within the noise of 20 000 edges.
    #[test]
    fn edges_are_resolved() {
        for m in [3, 5, 7] {
            let mut parts = Vec::new();
            for seed in 0..20_000 {
                let mut rng = Rng::new(seed, 904, 0, 0);
                let (at, along) = (rng.next_dvec2(), TAU * rng.next_f64());
                let normal = DVec2::from_angle(along);
                let [a, b] = beyond(|p| (p.as_dvec2() - at).dot(normal) > 0.0, m, seed);
                parts.push([(a - b).powi(2) / 2.0, a * (1.0 - b)]);
            }
            let runs = parts.len() as f64;
            let mean = |k: usize| parts.iter().map(|p| p[k]).sum::<f64>() / runs;
            let ratio = mean(0) / mean(1);
            let residuals = parts.iter().map(|p| (p[0] - ratio * p[1]).powi(2));
            let se = (residuals.sum::<f64>() / runs).sqrt() / runs.sqrt() / mean(1);
            let scale = f64::from(1 << m).powf(1.5);
            let (left, se) = (scale * ratio, scale * se);
            println!("{} points: {left:.3} ± {se:.3}", 1 << m);
            // EDGE is rounded to 0.005.
            assert!((left - EDGE).abs() < 4.0 * se + 0.005, "{left} ± {se}");
            assert!(se < 0.02 * EDGE, "{se}");
        }
    }
}
