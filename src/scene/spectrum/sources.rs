//! Curves from what scene files give: samples, temperatures, RGB triples.

use super::{
    Curve, Rgb2Spec, d65,
    named::{interpolate, tabulate},
};

/// Piecewise linear through `(nm, value)` pairs of increasing wavelength, 0 outside them: what pbrt-v4 makes of a
/// `spectrum` parameter given inline or as a file. Equal values everywhere still end at the first and last wavelength.
pub fn from_samples(samples: &[(f32, f32)]) -> Curve {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return Curve::Constant(0.0);
    };
    let points = to_f64(samples);
    Curve::Table {
        scale: 1.0,
        table: tabulate(|nm| {
            if nm < first.0 as f64 || nm > last.0 as f64 {
                0.0
            } else {
                interpolate(&points, nm)
            }
        }),
    }
}

/// As [`from_samples`], held constant outside the samples.
pub fn from_samples_extended(samples: &[(f32, f32)]) -> Curve {
    let points = to_f64(samples);
    Curve::Table {
        scale: 1.0,
        table: tabulate(|nm| interpolate(&points, nm)),
    }
}

fn to_f64(samples: &[(f32, f32)]) -> Vec<(f64, f64)> {
    samples.iter().map(|s| (s.0 as f64, s.1 as f64)).collect()
}

/// A black body of the given temperature, 1 at its brightest wavelength, visible or not (pbrt-v4's `blackbody`).
pub fn blackbody(kelvin: f32) -> Curve {
    // Planck's law up to a factor; second radiation constant hc/k (CODATA 2018) in nm·K.
    const C2: f64 = 1.438_776_877e7;
    // Wien: x·T of the maximum, nm·K (CODATA 2018).
    const WIEN: f64 = 2.897_771_955e6;
    let t = kelvin as f64;
    if t.is_nan() || t <= 0.0 {
        return Curve::Constant(0.0);
    }
    // Relative to the peak, and through exponents only, so that no temperature overflows.
    let peak = WIEN / t;
    let xp = C2 / WIEN;
    Curve::Table {
        scale: 1.0,
        table: tabulate(|nm| {
            let x = C2 / (nm * t);
            (peak / nm).powi(5) * (xp.exp_m1() / x.exp_m1())
        }),
    }
}

/// A reflectance of linear sRGB `rgb`, each clamped to 0..=1 (pbrt-v4's `RGBAlbedoSpectrum`).
pub fn rgb_albedo(rgb: [f32; 3]) -> Curve {
    let rgb = rgb.map(|v| v.clamp(0.0, 1.0));
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
        return Curve::Constant(rgb[0]);
    }
    Curve::Sigmoid {
        scale: 1.0,
        shape: Rgb2Spec::get().fetch(rgb),
    }
}

/// A non-negative spectrum of linear sRGB `rgb` under D65 (pbrt-v4's `RGBUnboundedSpectrum`): twice the largest
/// component times a reflectance that stays at or below one half in sRGB.
pub fn rgb_unbounded(rgb: [f32; 3]) -> Curve {
    let rgb = rgb.map(|v| v.max(0.0));
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
        return Curve::Constant(rgb[0]);
    }
    let scale = 2.0 * rgb[0].max(rgb[1]).max(rgb[2]);
    Curve::Sigmoid {
        scale,
        shape: Rgb2Spec::get().fetch(rgb.map(|v| v / scale)),
    }
}

/// An RGB light on the shape of D65 (pbrt-v4's `RGBIlluminantSpectrum`). Raw: divide by [`super::photometric`] to
/// make `rgb [1 1 1]` show as 1.
pub fn rgb_illuminant(rgb: [f32; 3]) -> Curve {
    let rgb = rgb.map(|v| v.max(0.0));
    let largest = rgb[0].max(rgb[1]).max(rgb[2]);
    let scale = 2.0 * largest;
    Curve::Illuminant {
        scale,
        shape: Rgb2Spec::get().fetch(rgb.map(|v| if scale > 0.0 { v / scale } else { 0.0 })),
        table: d65(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::spectrum::{photometric, xyz_of, xyz_to_rgb64};

    #[test]
    fn samples_are_linear_inside_and_zero_outside() {
        let s = [(400.0, 1.0), (500.0, 3.0), (700.0, 2.0)];
        let c = from_samples(&s);
        assert_eq!(c.at(399.0), 0.0);
        assert_eq!(c.at(400.0), 1.0);
        assert_eq!(c.at(450.0), 2.0);
        assert_eq!(c.at(600.0), 2.5);
        assert_eq!(c.at(701.0), 0.0);
        let e = from_samples_extended(&s);
        assert_eq!((e.at(360.0), e.at(830.0)), (1.0, 2.0));
        assert_eq!(from_samples(&[]).at(500.0), 0.0);
    }

    #[test]
    fn black_body_peaks_at_one_and_follows_planck() {
        let c = blackbody(5500.0);
        // λ_max = 526.87 nm; the table's nearest nodes are within 0.5 nm, where the curve is flat to 1e-6.
        assert!((c.at(527.0) - 1.0).abs() < 1e-5);
        // Ratio of Planck's law at 450 and 650 nm for 5500 K, by hand: (650/450)^5·expm1(4.02455)/expm1(5.81324).
        let expect = (650.0f64 / 450.0).powi(5) * 4.024_551_f64.exp_m1() / 5.813_240_f64.exp_m1();
        let got = (c.at(450.0) / c.at(650.0)) as f64;
        assert!((got / expect - 1.0).abs() < 1e-4, "{got} {expect}");
        assert!(blackbody(1e-3).at(500.0) == 0.0 && blackbody(1e9).at(500.0).is_finite());
        assert_eq!(blackbody(0.0).at(500.0), 0.0);
    }

    #[test]
    fn rgb_lights_show_their_rgb() {
        for rgb in [[1.0, 1.0, 1.0], [3.0, 1.0, 0.25], [0.0, 0.2, 0.9]] {
            let c = rgb_illuminant(rgb);
            let xyz = xyz_of(&c.scaled(1.0 / photometric(&c)));
            let got = xyz_to_rgb64(xyz);
            for i in 0..3 {
                let m = rgb[0].max(rgb[1]).max(rgb[2]) as f64;
                assert!((got[i] - rgb[i] as f64).abs() < 0.01 * m, "{rgb:?} {got:?}");
            }
        }
    }
}
