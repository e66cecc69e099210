//! Stand-ins for named spectra, until the tables are there.

use super::Curve;
use std::sync::Arc;

/// A named metal, glass or illuminant; raw values.
pub fn named(name: &str) -> Option<Curve> {
    let known = ["metal-", "glass-", "stdillum-"];
    known
        .iter()
        .any(|k| name.starts_with(k))
        .then_some(Curve::Constant(1.5))
}

/// A black body of `kelvin`, its maximum 1.
pub fn blackbody(kelvin: f32) -> Curve {
    let _ = kelvin;
    Curve::Constant(1.0)
}

/// Linear between samples (wavelength in nm, value).
pub fn from_samples(samples: &[(f32, f32)]) -> Curve {
    let table = (0..471)
        .map(|i| {
            let l = 360.0 + i as f32;
            let j = samples.partition_point(|s| s.0 < l);
            match (
                j.checked_sub(1).and_then(|k| samples.get(k)),
                samples.get(j),
            ) {
                (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (l - a.0) / (b.0 - a.0),
                (None, Some(b)) if b.0 == l => b.1,
                _ => 0.0,
            }
        })
        .collect();
    Curve::Table {
        scale: 1.0,
        table: Arc::new(table),
    }
}

/// D65 at 360, 361 … 830 nm.
pub fn d65() -> Arc<Vec<f32>> {
    Arc::new(vec![100.0; 471])
}

/// ∫ ȳ·curve dλ.
pub fn luminance(curve: &Curve) -> f32 {
    // ∫ȳ ≈ 106.857 nm stands for the observer.
    106.857 * curve.at(555.0)
}
