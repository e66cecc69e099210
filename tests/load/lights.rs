//! Lights are scaled as pbrt-v4 scales them.

use crate::{TRIANGLE, world};
use glam::Vec3;
use metrolux::scene::Light;
use metrolux::scene::spectrum::{Curve, luminance};

fn light(body: &str) -> Light {
    world(body).lights[0].clone()
}

fn emission(l: &Light) -> &Curve {
    match l {
        Light::Area { radiance, .. } | Light::InfiniteConstant { radiance } => radiance,
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => intensity,
        Light::Distant { irradiance, .. } => irradiance,
        Light::InfiniteImage { illuminant, .. } => illuminant,
    }
}

fn has_luminance(body: &str, want: f64) {
    let y = f64::from(luminance(emission(&light(body))));
    // Quadrature over 471 samples in f32 on both sides.
    assert!(
        (y - want).abs() <= 1e-4 * want,
        "{body}: {y}, expected {want}"
    );
}

/// A spectrum counts by its luminance alone, whatever its raw values; grey RGB counts by its value.
#[test]
fn spectra_are_normalised_and_scaled() {
    has_luminance("LightSource \"point\"", 1.0);
    has_luminance(
        "LightSource \"point\" \"rgb I\" [2 2 2] \"float scale\" 3",
        6.0,
    );
    has_luminance(
        "LightSource \"point\" \"blackbody I\" 5500 \"float scale\" 125",
        125.0,
    );
    has_luminance("LightSource \"distant\" \"spectrum L\" [360 7 830 7]", 1.0);
    has_luminance(
        "LightSource \"infinite\" \"spectrum L\" \"stdillum-A\"",
        1.0,
    );
    has_luminance(
        &format!("AreaLightSource \"diffuse\" \"rgb L\" [4 4 4]\n{TRIANGLE}"),
        4.0,
    );
}

#[test]
fn photometric_parameters() {
    let pi = std::f64::consts::PI;
    // Φ = 4π·I, E = π·L, E as it falls.
    has_luminance("LightSource \"point\" \"float power\" 8", 8.0 / (4.0 * pi));
    has_luminance("LightSource \"infinite\" \"float illuminance\" 5", 5.0 / pi);
    has_luminance("LightSource \"distant\" \"float illuminance\" 5", 5.0);
    // Φ of a spot: 2π·((1 − cos start) + (cos start − cos end)/2).
    let (start, end) = (60f64.to_radians().cos(), 90f64.to_radians().cos());
    let k = 2.0 * pi * ((1.0 - start) + (start - end) / 2.0);
    let spot = "LightSource \"spot\" \"float coneangle\" 90 \"float conedeltaangle\" 30";
    has_luminance(&format!("{spot} \"float power\" 7"), 7.0 / k);
    // Φ = π·A·L for each shape of pbrt, and a triangle is one; two sides share it.
    let area = format!("AreaLightSource \"diffuse\" \"float power\" 3\n{TRIANGLE}");
    has_luminance(&area, 3.0 / (pi * 0.5));
    let both = area.replace("3\n", "3 \"bool twosided\" true\n");
    has_luminance(&both, 3.0 / (pi * 0.5 * 2.0));
    // A sphere is one shape, whole or tessellated.
    let sphere = "AreaLightSource \"diffuse\" \"float power\" 3\nShape \"sphere\"";
    has_luminance(sphere, 3.0 / (pi * 4.0 * pi));
    let s = world(&sphere.replace("Shape", "Scale 1 1 1.001\nShape"));
    let total: f64 = (0..s.geometry.prim_count() as u32)
        .map(|p| s.geometry.area(p))
        .sum();
    let y = f64::from(luminance(emission(&s.lights[0])));
    assert!((y * total * pi - 3.0).abs() < 3e-4);
}

/// Grey RGB light is D65 exactly, coloured RGB rides on it, black is black.
#[test]
fn rgb_lights_ride_on_d65() {
    let curve =
        |rgb: &str| emission(&light(&format!("LightSource \"point\" \"rgb I\" [{rgb}]"))).clone();
    assert!(matches!(curve("2 2 2"), Curve::Table { .. }));
    assert!(matches!(curve("2 1 0.5"), Curve::Illuminant { .. }));
    assert_eq!(curve("0 0 0"), Curve::Constant(0.0));
}

#[test]
fn positions_and_directions() {
    let frame = "Translate 1 0 0\nScale 2 2 2\n";
    let from_to = "\"point3 from\" [0 1 0] \"point3 to\" [0 1 -3]";
    let Light::Spot {
        position,
        direction,
        ..
    } = light(&format!("{frame}LightSource \"spot\" {from_to}"))
    else {
        panic!()
    };
    assert_eq!((position, direction), (Vec3::new(1.0, 2.0, 0.0), -Vec3::Z));
    let Light::Distant { direction, .. } =
        light(&format!("{frame}LightSource \"distant\" {from_to}"))
    else {
        panic!()
    };
    assert_eq!(direction, -Vec3::Z);
    let Light::Distant { direction, .. } = light("Rotate 90 1 0 0\nLightSource \"distant\"") else {
        panic!()
    };
    assert!(
        (direction + Vec3::Y).length() < 1e-6,
        "pbrt's default shines along +z: {direction}"
    );
}

/// An environment map has to be square; a square one is read top row first.
#[test]
fn environment_maps() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("two words.png");
    let body = format!(
        "LightSource \"infinite\" \"string filename\" \"{}\"",
        path.display()
    );
    image::RgbImage::new(4, 2).save(&path).unwrap();
    let e = crate::load(&format!("WorldBegin\n{body}")).unwrap_err();
    assert!(
        e.to_string().ends_with("octahedral image (found 4 × 2)"),
        "{e}"
    );
    image::RgbImage::from_fn(2, 2, |x, y| image::Rgb([255 * (x == 0 && y == 0) as u8; 3]))
        .save(&path)
        .unwrap();
    let s = world(&body);
    assert_eq!(s.images[0].texel(0), [1.0; 3]);
    assert_eq!(s.images[0].texel(3), [0.0; 3]);
    let y = luminance(emission(&s.lights[0]));
    assert!((y - 1.0).abs() < 1e-4);
}
