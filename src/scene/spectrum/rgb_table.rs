//! Builds the coefficient table of [`super::Rgb2Spec`] by solving for each node.
//!
//! For a target colour the three coefficients of the sigmoid are found by damped Gauss–Newton steps on the CIELAB
//! difference between the target and the reflectance under D65 (Jakob & Hanika 2019, §5), with the derivatives written
//! out. Every column of nodes is walked from a mid value of the largest component towards both ends, each solution
//! starting the next.

use super::observer::{SRGB, TABLE_LEN, apply, cmf};
use super::rgb::{ENTRIES, RES, z_nodes};
use super::{LAMBDA_MAX, LAMBDA_MIN, Sigmoid, d65};
use crate::real::Real;
use std::sync::LazyLock;

/// Coefficients are held below this over the normalised wavelength: a sigmoid of 200 is within 7e-6 of 1.
const LIMIT: f64 = 200.0;

/// Where a column's walk begins, as a part of the nodes: bright enough that Lab is well conditioned, far from 1.
const START: usize = RES / 5;

/// Integration nodes over 0..=1 (normalised wavelength) with the weight of each for X, Y, Z, relative to D65's Y.
struct Quadrature {
    nodes: Vec<(f64, [f64; 3])>,
    white: [f64; 3],
}

/// Trapezoid rule at 1 nm.
static QUADRATURE: LazyLock<Quadrature> = LazyLock::new(|| {
    let light = d65();
    let mut nodes: Vec<(f64, [f64; 3])> = (0..TABLE_LEN)
        .map(|i| {
            let end = i == 0 || i == TABLE_LEN - 1;
            let w = light[i] as f64 * if end { 0.5 } else { 1.0 };
            let v = cmf(LAMBDA_MIN + i as Real);
            (i as f64 / (TABLE_LEN - 1) as f64, v.map(|v| v as f64 * w))
        })
        .collect();
    let y: f64 = nodes.iter().map(|n| n.1[1]).sum();
    for n in &mut nodes {
        n.1 = n.1.map(|v| v / y);
    }
    Quadrature {
        // The white of the matrices, so that the target (1, 1, 1) is the white of this quadrature too.
        white: std::array::from_fn(|c| nodes.iter().map(|n| n.1[c]).sum()),
        nodes,
    }
});

/// Sigmoid over normalised wavelength: `s(c0·t² + c1·t + c2)`.
type Coefficients = [f64; 3];

fn sigmoid(x: f64) -> (f64, f64) {
    let r = 1.0 / (1.0 + x * x).sqrt();
    (0.5 + 0.5 * x * r, 0.5 * r * r * r)
}

/// XYZ of the reflectance and its derivatives by the coefficients.
fn xyz(c: &Coefficients) -> ([f64; 3], [[f64; 3]; 3]) {
    let (mut v, mut d) = ([0.0; 3], [[0.0; 3]; 3]);
    for (t, w) in &QUADRATURE.nodes {
        let (s, ds) = sigmoid((c[0] * t + c[1]) * t + c[2]);
        for r in 0..3 {
            v[r] += w[r] * s;
            let g = w[r] * ds;
            d[r][0] += g * t * t;
            d[r][1] += g * t;
            d[r][2] += g;
        }
    }
    (v, d)
}

/// CIELAB relative to D65 and its derivatives by XYZ (rows L, a, b).
fn lab(v: &[f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    const DELTA: f64 = 6.0 / 29.0;
    let white = &QUADRATURE.white;
    let f: [(f64, f64); 3] = std::array::from_fn(|c| {
        let t = v[c] / white[c];
        if t > DELTA.powi(3) {
            (t.cbrt(), t.cbrt() / (3.0 * t * white[c]))
        } else {
            let k = 1.0 / (3.0 * DELTA * DELTA);
            (k * t + 4.0 / 29.0, k / white[c])
        }
    });
    (
        [
            116.0 * f[1].0 - 16.0,
            500.0 * (f[0].0 - f[1].0),
            200.0 * (f[1].0 - f[2].0),
        ],
        [
            [0.0, 116.0 * f[1].1, 0.0],
            [500.0 * f[0].1, -500.0 * f[1].1, 0.0],
            [0.0, 200.0 * f[1].1, -200.0 * f[2].1],
        ],
    )
}

/// Residual Lab(target) − Lab(c) and the Jacobian of Lab by the coefficients.
fn residual(target: &[f64; 3], c: &Coefficients) -> ([f64; 3], [[f64; 3]; 3]) {
    let (v, dv) = xyz(c);
    let (l, dl) = lab(&v);
    let j =
        std::array::from_fn(|r| std::array::from_fn(|k| (0..3).map(|m| dl[r][m] * dv[m][k]).sum()));
    (std::array::from_fn(|r| target[r] - l[r]), j)
}

fn norm2(r: &[f64; 3]) -> f64 {
    r.iter().map(|v| v * v).sum()
}

/// Levenberg–Marquardt from `c`; returns the coefficients and the remaining Lab difference.
fn solve(rgb: [f64; 3], mut c: Coefficients) -> (Coefficients, f64) {
    let target = lab(&apply(&SRGB.to_xyz, rgb)).0;
    let (mut r, mut j) = residual(&target, &c);
    let mut mu = 1e-3;
    for _ in 0..60 {
        if norm2(&r) < 1e-16 || mu > 1e12 {
            break;
        }
        let mut a = [[0.0; 3]; 3];
        let mut g = [0.0; 3];
        for p in 0..3 {
            for q in 0..3 {
                a[p][q] = (0..3).map(|m| j[m][p] * j[m][q]).sum();
            }
            g[p] = (0..3).map(|m| j[m][p] * r[m]).sum();
        }
        for (p, row) in a.iter_mut().enumerate() {
            row[p] *= 1.0 + mu;
            row[p] += 1e-300;
        }
        let step = apply(&super::observer::inverse(&a), g);
        let mut next: Coefficients = std::array::from_fn(|i| c[i] + step[i]);
        let largest = next.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if largest > LIMIT {
            next = next.map(|v| v * LIMIT / largest);
        }
        let (rn, jn) = residual(&target, &next);
        if norm2(&rn) < norm2(&r) {
            (c, r, j) = (next, rn, jn);
            mu = (mu * 0.1).max(1e-12);
        } else {
            mu *= 10.0;
        }
    }
    (c, norm2(&r).sqrt())
}

/// To coefficients over nm: t = (λ − 360) / 470.
fn to_nm(c: &Coefficients) -> [f64; 3] {
    let range = (LAMBDA_MAX - LAMBDA_MIN) as f64;
    let start = LAMBDA_MIN as f64;
    let (a, b) = (c[0] / (range * range), c[1] / range);
    [a, b - 2.0 * a * start, c[2] - b * start + a * start * start]
}

/// All nodes of one column: largest component `max`, ratios of the next two `x`, `y`.
pub(super) fn build_column(max: usize, x: f64, y: f64) -> [[f32; 3]; RES] {
    let z = z_nodes();
    let mut out = [[0.0; 3]; RES];
    let mut walk = |order: &mut dyn Iterator<Item = usize>, mut c: Coefficients| {
        let mut first = c;
        for (n, k) in order.enumerate() {
            let mut rgb = [0.0; 3];
            rgb[max] = z[k];
            rgb[(max + 1) % 3] = x * z[k];
            rgb[(max + 2) % 3] = y * z[k];
            c = solve(rgb, c).0;
            if n == 0 {
                first = c;
            }
            out[k] = to_nm(&c).map(|v| v as f32);
        }
        first
    };
    let start = walk(&mut (START..RES), [0.0; 3]);
    walk(&mut (0..START).rev(), start);
    out
}

/// Builds the whole table: little-endian f32 triples in the order [`super::Rgb2Spec`] reads. Takes some seconds.
#[doc(hidden)]
pub fn build_table() -> Vec<u8> {
    let mut table = vec![[0.0f32; 3]; ENTRIES];
    let ratio = |i: usize| i as f64 / (RES - 1) as f64;
    for max in 0..3 {
        for y in 0..RES {
            for x in 0..RES {
                let column = build_column(max, ratio(x), ratio(y));
                for (z, c) in column.into_iter().enumerate() {
                    table[((max * RES + z) * RES + y) * RES + x] = c;
                }
            }
        }
    }
    table
        .iter()
        .flatten()
        .flat_map(|v| v.to_le_bytes())
        .collect()
}

/// Solves for one colour without the table: slower by four orders of magnitude, exact where a solution exists.
pub fn solve_rgb(rgb: [f32; 3]) -> Sigmoid {
    let [c0, c1, c2] = to_nm(&solve(rgb.map(f64::from), [0.0; 3]).0).map(|v| v as f32);
    Sigmoid { c0, c1, c2 }
}

/// Linear sRGB of a reflectance under D65.
#[cfg(test)]
pub(super) fn rgb_of(s: &Sigmoid) -> [f64; 3] {
    let v = super::xyz_of_fn(|l| s.at(l) as f64 * light_at(l));
    let y = super::xyz_of_fn(light_at)[1];
    apply(&SRGB.from_xyz, v.map(|v| v / y))
}

#[cfg(test)]
fn light_at(l: Real) -> f64 {
    super::Curve::Table {
        scale: 1.0,
        table: d65(),
    }
    .at(l) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Set this to a path to have the table built anew and written there.
    const WRITE: &str = "METROLUX_WRITE_RGB2SPEC";

    #[test]
    fn committed_table_is_what_the_builder_gives() {
        if let Some(path) = std::env::var_os(WRITE) {
            std::fs::write(path, build_table()).unwrap();
            return;
        }
        let bytes = include_bytes!("data/rgb2spec.bin");
        let entry = |i: usize| -> [f32; 3] {
            std::array::from_fn(|c| {
                let o = i * 12 + c * 4;
                f32::from_le_bytes(bytes[o..o + 4].try_into().unwrap())
            })
        };
        for (max, x, y) in [(0, 0, 0), (1, 7, 22), (2, 31, 4), (0, 16, 16), (2, 20, 31)] {
            let ratio = |i: usize| i as f64 / (RES - 1) as f64;
            let column = build_column(max, ratio(x), ratio(y));
            for (z, c) in column.iter().enumerate() {
                let s = |c: [f32; 3]| Sigmoid {
                    c0: c[0],
                    c1: c[1],
                    c2: c[2],
                };
                let old = s(entry(((max * RES + z) * RES + y) * RES + x));
                for l in [380.0, 450.0, 550.0, 650.0, 780.0] {
                    // Other CPUs round otherwise on the way; the reflectance must not notice.
                    assert!((s(*c).at(l) - old.at(l)).abs() < 1e-4, "{max} {x} {y} {z}");
                }
            }
        }
    }

    #[test]
    fn derivatives_match_differences() {
        let c = [3.0, -2.0, 0.4];
        let target = [50.0, 0.0, 0.0];
        let (r, j) = residual(&target, &c);
        for k in 0..3 {
            let mut d = c;
            // Step of cbrt(eps): the truncation of the forward difference is its size times the curvature.
            d[k] += 6e-6;
            let (s, _) = residual(&target, &d);
            for m in 0..3 {
                let diff = -(s[m] - r[m]) / 6e-6;
                assert!((diff - j[m][k]).abs() < 1e-3 * (1.0 + j[m][k].abs()));
            }
        }
    }

    #[test]
    fn exact_solver_meets_ordinary_colours() {
        for rgb in [
            [0.63f32, 0.065, 0.05],
            [0.14, 0.45, 0.091],
            [0.725, 0.71, 0.68],
        ] {
            let got = rgb_of(&solve_rgb(rgb));
            for c in 0..3 {
                assert!((got[c] - rgb[c] as f64).abs() < 1e-4, "{rgb:?} {got:?}");
            }
        }
    }
}
