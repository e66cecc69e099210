//! Pixel reconstruction filters: value, footprint, importance sampling.
//!
//! All are products of one function along x and one along y, each normalised to unit integral, so a pixel is a weighted
//! mean of radiance and a constant image keeps its value.

use crate::scene::{FilterKind, FilterSettings};
use glam::Vec2;

/// Bins of the sampling table along one axis.
const BINS: usize = 256;

/// Columns handled at a time; wider than any usual footprint.
const STRETCH: usize = 16;

/// A normalised pixel filter h; Σ over pixels of ∫ h = 1 each.
#[derive(Clone, Debug)]
pub struct Filter {
    axes: [Axis; 2],
    unit_box: bool,
}

#[derive(Clone, Debug)]
struct Axis {
    shape: Shape,
    radius: f32,
    /// 1 / ∫ shape.
    norm: f32,
    /// CDF of |h| at the bins' ends, `BINS + 1` values from 0 to 1; the density is constant inside a bin.
    cdf: Vec<f32>,
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    Box,
    Triangle,
    /// exp(−k·x²) − floor.
    Gaussian {
        k: f32,
        floor: f32,
    },
    /// Mitchell & Netravali 1988 over [−2, 2], stretched to the radius.
    Mitchell {
        b: f32,
        c: f32,
    },
}

impl Filter {
    /// The filter that a scene asks for. A radius that is not positive counts as half a pixel.
    pub fn new(settings: &FilterSettings) -> Self {
        let axes = settings.radius.map(|r| {
            let r = if r > 0.0 && r.is_finite() { r } else { 0.5 };
            Axis::new(settings.kind, r)
        });
        let unit_box = settings.kind == FilterKind::Box && axes.iter().all(|a| a.radius == 0.5);
        Self { axes, unit_box }
    }

    /// Half width and half height in pixels.
    pub fn radius(&self) -> [f32; 2] {
        [self.axes[0].radius, self.axes[1].radius]
    }

    /// The box of one pixel: every raster point touches exactly the pixel it lies in, with h = 1.
    #[inline]
    pub fn is_unit_box(&self) -> bool {
        self.unit_box
    }

    /// h(dx, dy) at an offset from the pixel's centre; may be negative (Mitchell).
    #[inline]
    pub fn evaluate(&self, dx: f32, dy: f32) -> f32 {
        self.axes[0].value(dx) * self.axes[1].value(dy)
    }

    /// An offset from the pixel's centre drawn in proportion to |h|, nearly, and its weight h/pdf (mean 1 exactly).
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (dx, wx) = self.axes[0].sample(u.x);
        let (dy, wy) = self.axes[1].sample(u.y);
        (Vec2::new(dx, dy), wx * wy)
    }

    /// The rows of pixels whose filter may not be 0 at height `y` of the raster.
    #[inline]
    pub fn rows(&self, y: f32) -> std::ops::Range<i64> {
        if self.unit_box {
            let y = y.floor() as i64;
            return y..y + 1;
        }
        self.axes[1].touched(y)
    }

    /// Calls `f(x, y, h)` for every image pixel whose filter is not 0 at the raster point.
    #[inline]
    pub fn for_pixels(&self, raster: Vec2, mut f: impl FnMut(i64, i64, f32)) {
        self.for_rows(raster, |y, first, hx, hy| {
            for (x, h) in (first..).zip(hx) {
                let h = hy * h;
                if h != 0.0 {
                    f(x, y, h);
                }
            }
        });
    }

    /// Calls `f(y, x, hx, hy)` for every row of image pixels whose filter is not 0 at the raster point: that of pixel
    /// (x + i, y) is `hx[i]·hy`.
    #[inline]
    pub fn for_rows(&self, raster: Vec2, mut f: impl FnMut(i64, i64, &[f32], f32)) {
        if self.unit_box {
            f(
                raster.y.floor() as i64,
                raster.x.floor() as i64,
                &[1.0],
                1.0,
            );
            return;
        }
        let (xs, ys) = (
            self.axes[0].touched(raster.x),
            self.axes[1].touched(raster.y),
        );
        // The columns' values serve every row; a stretch of columns at a time keeps them on the stack.
        let mut hx = [0.0f32; STRETCH];
        let mut first = xs.start;
        while first < xs.end {
            let last = xs.end.min(first + STRETCH as i64);
            for x in first..last {
                hx[(x - first) as usize] = self.axes[0].value(raster.x - (x as f32 + 0.5));
            }
            for y in ys.clone() {
                let hy = self.axes[1].value(raster.y - (y as f32 + 0.5));
                if hy != 0.0 {
                    f(y, first, &hx[..(last - first) as usize], hy);
                }
            }
            first = last;
        }
    }
}

impl Axis {
    fn new(kind: FilterKind, radius: f32) -> Self {
        let shape = match kind {
            FilterKind::Box => Shape::Box,
            FilterKind::Triangle => Shape::Triangle,
            FilterKind::Gaussian { sigma } => {
                let k = 0.5 / (sigma * sigma);
                Shape::Gaussian {
                    k,
                    floor: (-k * radius * radius).exp(),
                }
            }
            FilterKind::Mitchell { b, c } => Shape::Mitchell { b, c },
        };
        let mut axis = Self {
            shape,
            radius,
            norm: 1.0,
            cdf: Vec::new(),
        };
        // Simpson on each half bin; every shape is smooth inside the bins (their ends include 0 and ±radius/2).
        let width = 2.0 * radius as f64 / BINS as f64;
        let at = |x: f64| axis.value(x as f32) as f64;
        let mut signed = 0.0;
        let mut absolute = vec![0.0f64];
        for i in 0..BINS {
            let a = -(radius as f64) + i as f64 * width;
            let b = if i + 1 == BINS {
                radius as f64
            } else {
                a + width
            };
            // Pull the ends inside, where the value of a shape cut off at the radius is the inner one.
            let eps = 1e-6 * width;
            let v: [f64; 5] =
                std::array::from_fn(|j| at((a + (b - a) * j as f64 / 4.0).clamp(a + eps, b - eps)));
            let rule =
                |v: [f64; 5]| (v[0] + 4.0 * v[1] + 2.0 * v[2] + 4.0 * v[3] + v[4]) / 12.0 * (b - a);
            signed += rule(v);
            let last = absolute[i];
            absolute.push(last + rule(v.map(f64::abs)).max(1e-9));
        }
        let total = absolute[BINS];
        axis.cdf = absolute.iter().map(|v| (v / total) as f32).collect();
        axis.norm = match shape {
            // The closed forms where there are short ones.
            Shape::Box => 0.5 / radius,
            Shape::Triangle => 1.0 / (radius * radius),
            Shape::Mitchell { .. } => 2.0 / radius,
            Shape::Gaussian { .. } => (1.0 / signed) as f32,
        };
        axis
    }

    #[inline]
    fn value(&self, x: f32) -> f32 {
        let a = x.abs();
        if a > self.radius {
            return 0.0;
        }
        self.norm
            * match self.shape {
                Shape::Box => 1.0,
                Shape::Triangle => self.radius - a,
                Shape::Gaussian { k, floor } => ((-k * x * x).exp() - floor).max(0.0),
                Shape::Mitchell { b, c } => mitchell(2.0 * a / self.radius, b, c),
            }
    }

    fn sample(&self, u: f32) -> (f32, f32) {
        let i = self.cdf[1..BINS].partition_point(|&c| c <= u);
        let (lo, hi) = (self.cdf[i], self.cdf[i + 1]);
        let width = 2.0 * self.radius / BINS as f32;
        let f = ((u - lo) / (hi - lo)).clamp(0.0, 1.0);
        let x = -self.radius + (i as f32 + f) * width;
        let x = x.clamp(-self.radius, self.radius);
        (x, self.value(x) * width / (hi - lo))
    }

    /// Pixels whose centre lies within the radius of coordinate `p`.
    #[inline]
    fn touched(&self, p: f32) -> std::ops::Range<i64> {
        (p - 0.5 - self.radius).ceil() as i64..(p - 0.5 + self.radius).floor() as i64 + 1
    }
}

/// Equation 8 of Mitchell & Netravali 1988, 0 ≤ x ≤ 2; its integral over [−2, 2] is 1 for every B, C.
fn mitchell(x: f32, b: f32, c: f32) -> f32 {
    let p = if x <= 1.0 {
        ((12.0 - 9.0 * b - 6.0 * c) * x + (-18.0 + 12.0 * b + 6.0 * c)) * x * x + (6.0 - 2.0 * b)
    } else if x <= 2.0 {
        (((-b - 6.0 * c) * x + (6.0 * b + 30.0 * c)) * x + (-12.0 * b - 48.0 * c)) * x
            + (8.0 * b + 24.0 * c)
    } else {
        0.0
    };
    p / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    fn all() -> Vec<Filter> {
        let b = 1.0 / 3.0;
        [
            (FilterKind::Box, [0.5, 0.5]),
            (FilterKind::Box, [1.2, 0.7]),
            (FilterKind::Triangle, [2.0, 1.5]),
            // Wider than one stretch of columns.
            (FilterKind::Triangle, [9.3, 1.0]),
            (FilterKind::Gaussian { sigma: 0.5 }, [1.5, 1.5]),
            (FilterKind::Mitchell { b, c: b }, [2.0, 2.0]),
        ]
        .map(|(kind, radius)| Filter::new(&FilterSettings { kind, radius }))
        .to_vec()
    }

    #[test]
    fn integral_is_one() {
        for f in all() {
            let [rx, ry] = f.radius();
            // Midpoint rule aligned with the support: error O(n⁻²) for these piecewise smooth shapes.
            let n = 400;
            let mut sum = 0.0f64;
            for i in 0..n {
                for j in 0..n {
                    let p = |k: usize, r: f32| r * (2.0 * (k as f32 + 0.5) / n as f32 - 1.0);
                    sum += f.evaluate(p(i, rx), p(j, ry)) as f64;
                }
            }
            sum *= 4.0 * (rx * ry) as f64 / (n * n) as f64;
            assert!((sum - 1.0).abs() < 1e-4, "{sum} {f:?}");
        }
    }

    #[test]
    fn pixels_share_a_point_with_total_weight_one_on_average() {
        for f in all() {
            let n = 64;
            let mut mean = 0.0f64;
            for i in 0..n {
                for j in 0..n {
                    let p = Vec2::new(
                        10.0 + (i as f32 + 0.5) / n as f32,
                        7.0 + (j as f32 + 0.5) / n as f32,
                    );
                    let mut total = 0.0;
                    f.for_pixels(p, |x, y, h| {
                        let e = f.evaluate(p.x - (x as f32 + 0.5), p.y - (y as f32 + 0.5));
                        assert_eq!(e, h);
                        total += h as f64;
                    });
                    mean += total / (n * n) as f64;
                }
            }
            // ∫ over a pixel of Σ h = ∫ h = 1. Midpoint rule: smooth shapes leave O(n⁻²), the jump of a box whose
            // edge crosses the pixel up to a column of points on each axis.
            let jump = matches!(f.axes[0].shape, Shape::Box) && !f.unit_box;
            let limit = if jump { 2.0 / n as f64 } else { 1e-3 };
            assert!((mean - 1.0).abs() < limit, "{mean} {f:?}");
        }
    }

    #[test]
    fn sampling_follows_the_absolute_value() {
        const CELLS: usize = 24;
        let filters = all();
        for f in &filters {
            let axis = &f.axes[0];
            let n = 40_000;
            let mut counts = [0.0f64; CELLS];
            let mut mean = 0.0f64;
            for i in 0..n {
                // Stratified points would make the statistic too small: scramble with a Weyl-free hash instead.
                let u = hash(i) as f64 / 2f64.powi(32);
                let (x, w) = axis.sample(u as f32);
                mean += w as f64 / n as f64;
                let cell = ((x + axis.radius) / (2.0 * axis.radius) * CELLS as f32) as usize;
                counts[cell.min(CELLS - 1)] += 1.0;
            }
            let steps = 1000;
            let expected: Vec<f64> = (0..CELLS)
                .map(|c| {
                    (0..steps)
                        .map(|s| (c as f32 + (s as f32 + 0.5) / steps as f32) / CELLS as f32)
                        .map(|t| axis.value(axis.radius * (2.0 * t - 1.0)).abs() as f64)
                        .sum()
                })
                .collect();
            let total: f64 = expected.iter().sum();
            let chi2: f64 = (0..CELLS)
                .map(|c| {
                    let e = expected[c] / total * n as f64;
                    (counts[c] - e).powi(2) / e
                })
                .sum();
            // Šidák over the filters at 1 %.
            let alpha = 1.0 - 0.99f64.powf(1.0 / filters.len() as f64);
            let limit = ChiSquared::new((CELLS - 1) as f64)
                .unwrap()
                .inverse_cdf(1.0 - alpha);
            assert!(chi2 < limit, "{chi2} >= {limit} {:?}", axis.shape);
            // Weights have mean ∫h = 1; for Mitchell sd < 0.5, four standard errors are 0.01.
            assert!((mean - 1.0).abs() < 0.01, "{mean}");
        }
    }

    fn hash(i: u32) -> u32 {
        let mut x = i.wrapping_mul(0x9E37_79B9) ^ 0x85EB_CA6B;
        x = (x ^ (x >> 16)).wrapping_mul(0x21F0_AAAD);
        x = (x ^ (x >> 15)).wrapping_mul(0x735A_2D97);
        x ^ (x >> 15)
    }
}
