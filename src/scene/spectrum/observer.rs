//! The CIE 1931 observer: tristimulus values of curves, and linear sRGB of tristimulus values.

use super::{Curve, LAMBDA_MAX, LAMBDA_MIN, named};
use crate::real::{Convert, Real};
use std::sync::LazyLock;

/// Number of entries of a table at 360, 361 … 830 nm.
pub const TABLE_LEN: usize = (LAMBDA_MAX - LAMBDA_MIN) as usize + 1;

/// x̄, ȳ, z̄ at 360 … 830 nm; the fourth entry only rounds a row to 16 bytes.
static CMF: LazyLock<Vec<[f32; 4]>> = LazyLock::new(|| {
    let rows = named::parse_rows::<4>(include_str!("data/cie1931.csv"));
    assert_eq!(rows.len(), TABLE_LEN, "the observer covers 360 to 830 nm");
    rows.iter()
        .map(|r| [r[1] as f32, r[2] as f32, r[3] as f32, 0.0])
        .collect()
});

/// x̄, ȳ, z̄ at a wavelength in nm, linear between the tabulated integers.
#[inline]
pub fn cmf(lambda: Real) -> [Real; 3] {
    let table: &[[f32; 4]] = &CMF;
    let x = (lambda - LAMBDA_MIN).clamp(0.0, (TABLE_LEN - 1) as Real);
    let i = (x as usize).min(TABLE_LEN - 2);
    let f = x - i as Real;
    let (a, b) = (table[i].real(), table[i + 1].real());
    std::array::from_fn(|c| a[c] + f * (b[c] - a[c]))
}

/// ∫ x̄·s dλ, ∫ ȳ·s dλ, ∫ z̄·s dλ over 360–830 nm. Not divided by ∫ ȳ dλ.
///
/// Simpson's rule on every nanometre: exact for tables, whose products with the observer are quadratic there.
pub fn xyz_of_fn(s: impl Fn(Real) -> f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut left = s(LAMBDA_MIN);
    for i in 0..TABLE_LEN - 1 {
        let l = LAMBDA_MIN + i as Real;
        let (mid, right) = (s(l + 0.5), s(l + 1.0));
        let (a, b) = (CMF[i], CMF[i + 1]);
        for c in 0..3 {
            let (a, b) = (a[c] as f64, b[c] as f64);
            sum[c] += (a * left + 2.0 * (a + b) * mid + b * right) / 6.0;
        }
        left = right;
    }
    sum
}

/// As [`xyz_of_fn`], of a curve.
pub fn xyz_of(curve: &Curve) -> [f64; 3] {
    xyz_of_fn(|l| curve.at(l) as f64)
}

/// ∫ ȳ·curve dλ: what pbrt-v4 divides a light's scale by, so that light of any spectrum with `scale` 1 has luminance 1.
pub fn luminance(curve: &Curve) -> f32 {
    xyz_of(curve)[1] as f32
}

/// The integral that normalises a light: as [`luminance`], but of the bare illuminant when the light is an RGB one
/// (pbrt-v4's `SpectrumToPhotometric`), so that `rgb L [1 0 0]` keeps the luminance of red.
pub fn photometric(curve: &Curve) -> f32 {
    match curve {
        Curve::Illuminant { table, .. } => luminance(&Curve::Table {
            scale: 1.0,
            table: table.clone(),
        }),
        other => luminance(other),
    }
}

/// Linear sRGB → XYZ and back, for the white of our own D65 table, so that D65 light is exactly grey.
pub struct SrgbMatrices {
    /// RGB → XYZ, rows first.
    pub to_xyz: [[f64; 3]; 3],
    /// XYZ → RGB, rows first.
    pub from_xyz: [[f64; 3]; 3],
}

/// xy of the primaries of sRGB (IEC 61966-2-1).
const PRIMARIES: [[f64; 2]; 3] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];

/// The matrices of linear sRGB.
pub static SRGB: LazyLock<SrgbMatrices> = LazyLock::new(|| {
    let w = xyz_of(&Curve::Table {
        scale: 1.0,
        table: named::d65(),
    });
    let white = w.map(|v| v / w[1]);
    let mut m = [[0.0; 3]; 3];
    for (c, [x, y]) in PRIMARIES.into_iter().enumerate() {
        m[0][c] = x / y;
        m[1][c] = 1.0;
        m[2][c] = (1.0 - x - y) / y;
    }
    let gain = apply(&inverse(&m), white);
    for row in &mut m {
        for c in 0..3 {
            row[c] *= gain[c];
        }
    }
    SrgbMatrices {
        from_xyz: inverse(&m),
        to_xyz: m,
    }
});

/// Linear sRGB of tristimulus values (Y = 1 is white).
pub fn xyz_to_rgb(xyz: [f32; 3]) -> [f32; 3] {
    apply(&SRGB.from_xyz, xyz.map(f64::from)).map(|v| v as f32)
}

/// As [`xyz_to_rgb`] in double precision.
pub fn xyz_to_rgb64(xyz: [f64; 3]) -> [f64; 3] {
    apply(&SRGB.from_xyz, xyz)
}

/// Tristimulus values of linear sRGB.
pub fn rgb_to_xyz(rgb: [f32; 3]) -> [f32; 3] {
    apply(&SRGB.to_xyz, rgb.map(f64::from)).map(|v| v as f32)
}

/// Matrix times vector.
pub(super) fn apply(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|r| m[r][0] * v[0] + m[r][1] * v[1] + m[r][2] * v[2])
}

/// Inverse by cofactors.
pub(super) fn inverse(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let cof = |r: usize, c: usize| {
        let (r1, r2) = ((r + 1) % 3, (r + 2) % 3);
        let (c1, c2) = ((c + 1) % 3, (c + 2) % 3);
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let det: f64 = (0..3).map(|c| m[0][c] * cof(0, c)).sum();
    std::array::from_fn(|r| std::array::from_fn(|c| cof(c, r) / det))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminance_of_a_constant_is_the_integral_of_the_observer() {
        // 106.856895 is the sum of ȳ at 1 nm that CIE 15 and pbrt-v4 use; trapezoid and sum differ by half the ends.
        let y = luminance(&Curve::Constant(1.0));
        assert!((y - 106.856_9).abs() < 1e-3, "{y}");
    }

    #[test]
    fn white_of_d65_has_the_published_chromaticity_and_is_grey() {
        let w = xyz_of(&Curve::Table {
            scale: 1.0,
            table: named::d65(),
        });
        let s: f64 = w.iter().sum();
        // CIE 15: x = 0.31272, y = 0.32903 (2°), five decimals.
        assert!((w[0] / s - 0.31272).abs() < 1e-5 && (w[1] / s - 0.32903).abs() < 1e-5);
        let rgb = xyz_to_rgb64(w.map(|v| v / w[1]));
        for v in rgb {
            assert!((v - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn matrix_is_the_one_of_the_standard() {
        // IEC 61966-2-1 rounds the white to x = 0.3127, y = 0.3290, which moves entries by less than 5e-4.
        let std = [
            [0.4124, 0.3576, 0.1805],
            [0.2126, 0.7152, 0.0722],
            [0.0193, 0.1192, 0.9505],
        ];
        for (got, want) in SRGB.to_xyz.iter().flatten().zip(std.iter().flatten()) {
            assert!((got - want).abs() < 5e-4, "{got} {want}");
        }
        let back = xyz_to_rgb(rgb_to_xyz([0.2, 0.5, 0.9]));
        for (a, b) in back.into_iter().zip([0.2, 0.5, 0.9]) {
            assert!((a - b).abs() < 1e-6);
        }
    }
}
