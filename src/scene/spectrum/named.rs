//! Spectra with names: metals, glasses and standard illuminants, under the names pbrt-v4 gives them.

use super::{Curve, LAMBDA_MIN, observer::TABLE_LEN};
use std::sync::{Arc, LazyLock};

/// Rows of a data file: lines of `W` comma-separated numbers, `#` starts a comment line.
pub(super) fn parse_rows<const W: usize>(text: &str) -> Vec<[f64; W]> {
    text.lines()
        .filter(|l| !l.starts_with('#') && !l.trim().is_empty())
        .map(|l| {
            let mut row = [0.0; W];
            let mut n = 0;
            for (slot, s) in row.iter_mut().zip(l.split(',')) {
                *slot = s.trim().parse().expect("built-in data is numeric");
                n += 1;
            }
            assert_eq!(n, W, "built-in data has whole rows");
            row
        })
        .collect()
}

/// Values at 360 … 830 nm of a function of wavelength in nm.
pub(super) fn tabulate(f: impl Fn(f64) -> f64) -> Arc<Vec<f32>> {
    Arc::new(
        (0..TABLE_LEN)
            .map(|i| f(LAMBDA_MIN as f64 + i as f64) as f32)
            .collect(),
    )
}

/// Piecewise linear through `points` (increasing first coordinate), constant beyond them.
pub(super) fn interpolate(points: &[(f64, f64)], x: f64) -> f64 {
    let i = points.partition_point(|p| p.0 <= x);
    match (i.checked_sub(1).map(|j| points[j]), points.get(i)) {
        (None, Some(b)) => b.1,
        (Some(a), None) => a.1,
        (Some(a), Some(b)) => a.1 + (x - a.0) / (b.0 - a.0) * (b.1 - a.1),
        (None, None) => 0.0,
    }
}

/// CIE standard illuminant D65 at 360 … 830 nm, relative power (100 at 560 nm).
pub fn d65() -> Arc<Vec<f32>> {
    static D65: LazyLock<Arc<Vec<f32>>> = LazyLock::new(|| {
        let rows = parse_rows::<2>(include_str!("data/d65.csv"));
        assert_eq!(rows.len(), TABLE_LEN);
        Arc::new(rows.iter().map(|r| r[1] as f32).collect())
    });
    D65.clone()
}

/// The spectrum that pbrt-v4 knows under `name`: `metal-X-eta`, `metal-X-k`, `glass-X`, `stdillum-X`.
///
/// Values are raw: refraction indices as they are, illuminants as relative power. Held constant beyond a table's ends.
/// The figures' sources are in data/SOURCE.txt; they are not pbrt's own tables, so a metal may differ by a few per cent.
pub fn named(name: &str) -> Option<Curve> {
    let table = if let Some(metal) = name.strip_prefix("metal-") {
        let (metal, part) = metal.rsplit_once('-')?;
        let column = match part {
            "eta" => 1,
            "k" => 2,
            _ => return None,
        };
        metal_table(metal, column)?
    } else if let Some(glass) = name.strip_prefix("glass-") {
        glass_table(glass)?
    } else {
        illuminant_table(name.strip_prefix("stdillum-")?)?
    };
    Some(Curve::Table { scale: 1.0, table })
}

/// Every name that [`named`] knows, for messages.
pub fn names() -> impl Iterator<Item = String> {
    let metals = ["Ag", "Al", "Au", "Cu", "CuZn", "MgO", "TiO2"];
    let glasses = ["BK7", "BAF10", "FK51A", "LASF9", "F5", "F10", "F11"];
    metals
        .into_iter()
        .flat_map(|m| [format!("metal-{m}-eta"), format!("metal-{m}-k")])
        .chain(glasses.into_iter().map(|g| format!("glass-{g}")))
        .chain(
            ["A", "D50", "D65"]
                .into_iter()
                .map(|i| format!("stdillum-{i}")),
        )
        .chain((1..=12).map(|i| format!("stdillum-F{i}")))
}

fn metal_table(metal: &str, column: usize) -> Option<Arc<Vec<f32>>> {
    let text = match metal {
        "Ag" => include_str!("data/ag.csv"),
        "Al" => include_str!("data/al.csv"),
        "Au" => include_str!("data/au.csv"),
        "Cu" => include_str!("data/cu.csv"),
        "CuZn" => include_str!("data/cuzn.csv"),
        // Transparent oxides: no absorption in the visible range, dispersion formulas of the sources.
        "MgO" | "TiO2" if column == 2 => return Some(tabulate(|_| 0.0)),
        "MgO" => {
            return Some(tabulate(|nm| {
                let l2 = (nm * 1e-3).powi(2);
                (2.957019 + 0.0216485 / (l2 - 0.0158650) - 0.0101373 * l2).sqrt()
            }));
        }
        "TiO2" => {
            return Some(tabulate(|nm| {
                (5.913 + 0.2441 / ((nm * 1e-3).powi(2) - 0.0803)).sqrt()
            }));
        }
        _ => return None,
    };
    let points: Vec<_> = parse_rows::<3>(text)
        .iter()
        .map(|r| (r[0], r[column]))
        .collect();
    Some(tabulate(|nm| interpolate(&points, nm)))
}

/// n² = 1 + Σ B·λ²/(λ² − C), λ in µm.
fn glass_table(glass: &str) -> Option<Arc<Vec<f32>>> {
    let (_, coefficients) = include_str!("data/sellmeier.csv")
        .lines()
        .filter_map(|l| l.split_once(','))
        .find(|(name, _)| *name == glass)?;
    let [b1, c1, b2, c2, b3, c3] = parse_rows::<6>(coefficients)[0];
    Some(tabulate(|nm| {
        let l2 = (nm * 1e-3).powi(2);
        let term = |b: f64, c: f64| b * l2 / (l2 - c);
        (1.0 + term(b1, c1) + term(b2, c2) + term(b3, c3)).sqrt()
    }))
}

fn illuminant_table(name: &str) -> Option<Arc<Vec<f32>>> {
    Some(match name {
        "D65" => d65(),
        "A" => tabulate(|nm| {
            // CIE 15: a Planckian radiator at 2848 K with c2 = 1.435e7 nm·K, 100 at 560 nm.
            let planck = |l: f64| l.powi(-5) / (1.435e7 / (2848.0 * l)).exp_m1();
            100.0 * planck(nm) / planck(560.0)
        }),
        "D50" => {
            let points: Vec<_> = parse_rows::<2>(include_str!("data/d50.csv"))
                .iter()
                .map(|r| (r[0], r[1]))
                .collect();
            tabulate(|nm| interpolate(&points, nm))
        }
        f => {
            let (_, values) = include_str!("data/fluorescent.csv")
                .lines()
                .filter(|l| !l.starts_with('#'))
                .filter_map(|l| l.split_once(','))
                .find(|(n, _)| *n == f)?;
            let points: Vec<_> = parse_rows::<81>(values)[0]
                .iter()
                .enumerate()
                .map(|(i, v)| (380.0 + 5.0 * i as f64, *v))
                .collect();
            tabulate(|nm| interpolate(&points, nm))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::spectrum::xyz_of;

    #[test]
    fn every_name_exists_and_others_do_not() {
        for n in names() {
            assert!(named(&n).is_some(), "{n}");
        }
        for n in [
            "metal-Xx-eta",
            "metal-Ag",
            "glass-",
            "stdillum-F13",
            "Ag",
            "",
        ] {
            assert!(named(n).is_none(), "{n}");
        }
    }

    #[test]
    fn glasses_meet_the_catalogue() {
        // n_d at 587.56 nm, five decimals, SCHOTT catalogue.
        for (g, nd) in [
            ("BK7", 1.51680),
            ("BAF10", 1.67003),
            ("FK51A", 1.48656),
            ("LASF9", 1.85025),
            ("F5", 1.67270),
            ("F10", 1.72825),
            ("F11", 1.78472),
        ] {
            let n = named(&format!("glass-{g}")).unwrap().at(587.5618);
            assert!((n - nd).abs() < 1e-5, "{g}: {n}");
        }
    }

    #[test]
    fn illuminants_have_their_published_chromaticity() {
        // CIE 15, four decimals; summing at 5 nm there and integrating piecewise lines here differ by up to 5e-4 for
        // lamps with lines.
        for (i, x, y) in [
            ("A", 0.4476, 0.4074),
            ("D50", 0.3457, 0.3585),
            ("D65", 0.3127, 0.3290),
            ("F1", 0.3131, 0.3371),
            ("F2", 0.3721, 0.3751),
            ("F3", 0.4091, 0.3941),
            ("F4", 0.4402, 0.4031),
            ("F5", 0.3138, 0.3452),
            ("F6", 0.3779, 0.3882),
            ("F7", 0.3129, 0.3292),
            ("F8", 0.3458, 0.3586),
            ("F9", 0.3741, 0.3727),
            ("F10", 0.3458, 0.3588),
            ("F11", 0.3805, 0.3769),
            ("F12", 0.4370, 0.4042),
        ] {
            let v = xyz_of(&named(&format!("stdillum-{i}")).unwrap());
            let s: f64 = v.iter().sum();
            let (dx, dy) = (v[0] / s - x, v[1] / s - y);
            assert!(dx.abs() < 5e-4 && dy.abs() < 5e-4, "{i}: {dx} {dy}");
        }
    }

    #[test]
    fn metals_reflect_as_metals_do() {
        let r = |m: &str, nm: crate::real::Real| {
            let n = named(&format!("metal-{m}-eta")).unwrap().at(nm);
            let k = named(&format!("metal-{m}-k")).unwrap().at(nm);
            ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k)
        };
        assert!(r("Ag", 550.0) > 0.97 && r("Al", 550.0) > 0.9);
        assert!(r("Au", 650.0) > 0.95 && r("Au", 450.0) < 0.45);
        assert!(r("Cu", 650.0) > 0.9 && r("Cu", 450.0) < 0.65);
    }
}
