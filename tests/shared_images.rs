//! Reads the public reference images beside the checkout; skipped where they are absent.

use metrolux::output::read_image;
use metrolux::study::metrics;
use std::path::PathBuf;

/// `../shared` next to the checkout, or where METROLUX_SHARED points.
fn shared(file: &str) -> Option<PathBuf> {
    let root = std::env::var_os("METROLUX_SHARED").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared")),
        PathBuf::from,
    );
    let path = root.join(file);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is absent", path.display());
    None
}

#[test]
fn references_of_the_cornell_box_agree_as_documented() {
    let (Some(a), Some(b)) = (
        shared("scenes/cornell-box/pbrt-v4.exr"),
        shared("scenes/cornell-box/TungstenRender.exr"),
    ) else {
        return;
    };
    let (a, b) = (read_image(&a).unwrap(), read_image(&b).unwrap());
    let b = metrics::blocks(&b, b.width / a.width);
    let c = metrics::compare(&a, &b).unwrap();
    // The folder's README: 0.6 % in red and green, 4 % in blue, through RGB upsampling.
    assert!((c.mean_ratio[0] - 1.0).abs() < 0.01 && (c.mean_ratio[1] - 1.0).abs() < 0.01);
    assert!(
        (0.03..0.05).contains(&(c.mean_ratio[2] - 1.0).abs()),
        "{c:?}"
    );
    assert_eq!(c.non_finite, 0);
}

#[test]
fn every_reference_is_readable() {
    for scene in ["veach-ajar", "veach-bidir", "veach-mis", "staircase2"] {
        for file in ["pbrt-v4.exr", "TungstenRender.exr", "TungstenRender.png"] {
            if let Some(path) = shared(&format!("scenes/{scene}/{file}")) {
                let image = read_image(&path).unwrap();
                let mean: f64 = image
                    .rgb
                    .iter()
                    .map(|p| metrics::luminance(*p))
                    .sum::<f64>()
                    / image.rgb.len() as f64;
                assert!(mean > 1e-3 && mean < 1e3, "{}: {mean}", path.display());
            }
        }
    }
}
