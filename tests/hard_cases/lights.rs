//! Lights of every size and strength, and none.

use super::common::scene::of_text;
use super::common::stats::{Pair, agree};
use super::grazing::over_window;
use super::{all_images, brings, by_length, scene_of};
use std::f64::consts::PI;

/// Looks down at a floor from the side, at a patch so small that it is lit evenly.
const CAMERA: &str = "LookAt 2 0 1  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 0.05";

const FLOOR: &str = r#"Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
    Shape "trianglemesh" "point3 P" [ -4 -4 0  4 -4 0  4 4 0  -4 4 0 ] "integer indices" [ 0 1 2 0 2 3 ]"#;

/// A lamp's light on the floor below it, one scattering, by every integrator.
fn on_the_floor(what: &str, lamp: &str, expected: f64) -> Vec<Pair> {
    let scene = of_text(4, CAMERA, &format!("{lamp}\n{FLOOR}"));
    brings(what, &by_length(&scene, 1, 1), 2..=2, expected, 0.2)
}

/// Emitters of 10⁻⁶ area, a square and a sphere; suns of 10⁻⁵ sr as discs 10 to 10⁶ away, and at infinity; a point. The
/// irradiance of each is known, and the floor sends 0.5/π of it on. The patch is so small, and the lamps so far, that
/// distance and angle vary by less than 10⁻³.
#[test]
fn small_and_distant_lamps_lose_nothing() {
    let mut all = Vec::new();
    all.extend(on_the_floor(
        "a square of 10⁻⁶",
        r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [ 4e6 4e6 4e6 ]
        Shape "trianglemesh" "point3 P" [ -5e-4 -5e-4 1  -5e-4 5e-4 1  5e-4 5e-4 1  5e-4 -5e-4 1 ]
            "integer indices" [ 0 1 2 0 2 3 ] AttributeEnd"#,
        0.5 / PI * 4.0,
    ));
    let r = (1e-6 / (4.0 * PI)).sqrt();
    all.extend(on_the_floor(
        "a sphere of 10⁻⁶",
        &format!(
            "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ 4e6 4e6 4e6 ] Translate 0 0 1 Shape \"sphere\" \
             \"float radius\" {r} AttributeEnd"
        ),
        0.5 / PI * 4e6 * PI * r * r,
    ));
    for exp in [1, 3, 6] {
        let d = 10f64.powi(exp);
        // Ω = π·r²/d² = 10⁻⁵.
        let r = d * (1e-5 / PI).sqrt();
        all.extend(on_the_floor(
            &format!("a sun 10^{exp} away"),
            &format!(
                "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ 1e5 1e5 1e5 ] \"bool twosided\" true \
                 Translate 0 0 {d} Shape \"disk\" \"float radius\" {r} AttributeEnd"
            ),
            0.5 / PI,
        ));
    }
    all.extend(on_the_floor(
        "a sun at infinity",
        "LightSource \"distant\" \"rgb L\" [ 1 1 1 ] \"point3 from\" [ 0 0 1 ] \"point3 to\" [ 0 0 0 ]",
        0.5 / PI,
    ));
    all.extend(on_the_floor(
        "a point",
        "LightSource \"point\" \"rgb I\" [ 1 1 1 ] \"point3 from\" [ 0 0 1 ]",
        0.5 / PI,
    ));
    agree("lamps", &all);
}

/// A point light 10⁻⁴ below a mirror (LSDE, which path tracing cannot find): with its mirror image, 2·10⁻⁴ higher, it
/// lights the floor twice but for the 10⁻³ or so that the mirror takes (index 1, k = 200).
#[test]
fn a_point_beside_a_mirror_is_seen_twice() {
    let scene = of_text(
        4,
        "LookAt 0 0 0.9  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 60",
        &format!(
            r#"LightSource "point" "rgb I" [ 1 1 1 ] "point3 from" [ 0 0 1 ]
            {FLOOR}
            Material "conductor" "rgb reflectance" [ 1 1 1 ]
            Shape "trianglemesh" "point3 P" [ -9 -9 1.0001  9 -9 1.0001  9 9 1.0001  -9 9 1.0001 ]
                "integer indices" [ 0 1 2 0 2 3 ]"#
        ),
    );
    let half = 30f64.to_radians().tan();
    let expected = over_window(|x, y| {
        let r2 = (0.9 * half).powi(2) * (x * x + y * y);
        0.5 / PI / (1.0 + r2).powf(1.5)
    });
    let runs = by_length(&scene, 2, 4);
    let mut pairs = brings("point", &runs, 2..=2, expected, 0.15);
    pairs.extend(brings("its mirror image", &runs[1..], 3..=3, expected, 0.2));
    agree("point beside a mirror", &pairs);
}

/// A lamp of 10⁶ and, walled off from it, one of 10⁻⁶: each half of the picture shows its own.
#[test]
fn radiances_a_million_million_apart_share_a_picture() {
    let scene = scene_of(
        r#"Film "rgb" "integer xresolution" 16 "integer yresolution" 8
        PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
        Integrator "path" "integer maxdepth" 3
        LookAt 0 -3 0  0 0 0  0 0 1
        Camera "perspective" "float fov" 30
        WorldBegin
        AreaLightSource "diffuse" "rgb L" [ 1e6 1e6 1e6 ]
        Shape "trianglemesh" "point3 P" [ -4 1 -4  -0.01 1 -4  -0.01 1 4  -4 1 4 ] "integer indices" [ 0 1 2 0 2 3 ]
        AreaLightSource "diffuse" "rgb L" [ 1e-6 1e-6 1e-6 ]
        Shape "trianglemesh" "point3 P" [ 0.01 1 -4  4 1 -4  4 1 4  0.01 1 4 ] "integer indices" [ 0 1 2 0 2 3 ]
        AreaLightSource "diffuse" "rgb L" [ 0 0 0 ]
        Shape "trianglemesh" "point3 P" [ 0 -3 -4  0 1.1 -4  0 1.1 4  0 -3 4 ] "integer indices" [ 0 1 2 0 2 3 ]"#,
    );
    for (name, image) in all_images(&scene, 64) {
        if name.contains("chain") {
            // A chain that owns all light is right to spend 10¹² steps of every 10¹² + 1 on the brighter lamp.
            continue;
        }
        for (i, p) in image.iter().enumerate() {
            let expected = match i % 16 {
                9.. => 1e6,
                0..7 => 1e-6,
                _ => continue,
            };
            // One wavelength in four lanes, stratified over 64 samples; Fresnel has no part in it.
            assert!(
                (p[1] / expected - 1.0).abs() < 0.1,
                "{name}, pixel {i}: {p:?}"
            );
        }
    }
}

/// No light, lights that are black, have no area, stand behind walls on all sides: black pictures, no fault, no end to
/// wait for.
#[test]
fn no_light_is_a_black_picture() {
    let shut = r#"AttributeBegin Material "diffuse" Translate 0 0 1
        Shape "trianglemesh" "point3 P" [ -1 -1 -0.5  1 -1 -0.5  1 1 -0.5  -1 1 -0.5  -1 -1 0.5  1 -1 0.5  1 1 0.5  -1 1 0.5 ]
            "integer indices" [ 0 2 1 0 3 2  4 5 6 4 6 7  0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7 ]
        AttributeEnd"#;
    let lamp = r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [ 5 5 5 ] Translate 0 0 1
        Shape "sphere" "float radius" 0.2 AttributeEnd"#;
    let point = r#"LightSource "point" "rgb I" [ 9 9 9 ] "point3 from" [ 0.5 0.2 1.2 ]"#;
    for (what, world) in [
        ("no light", String::new()),
        (
            "black lights",
            r#"LightSource "point" "rgb I" [ 0 0 0 ] LightSource "infinite" "rgb L" [ 0 0 0 ]
            AttributeBegin AreaLightSource "diffuse" "rgb L" [ 0 0 0 ] Shape "sphere" AttributeEnd"#
                .into(),
        ),
        (
            "a lamp without area",
            r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [ 5 5 5 ]
            Shape "trianglemesh" "point3 P" [ 0 0 1  1 0 1  0.5 0 1 ] "integer indices" [ 0 1 2 ] AttributeEnd"#
                .into(),
        ),
        ("lamps in a box", format!("{shut}\n{lamp}\n{point}")),
        ("nothing at all", "#".into()),
    ] {
        let floor = if world == "#" { "" } else { FLOOR };
        let scene = scene_of(&format!(
            "Film \"rgb\" \"integer xresolution\" 6 \"integer yresolution\" 5\nIntegrator \"path\" \"integer maxdepth\" 5\n\
             LookAt 3 -3 1.4  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n{world}\n{floor}"
        ));
        for (name, image) in all_images(&scene, 4) {
            assert!(image.iter().all(|p| *p == [0.0; 3]), "{what}, {name}: {image:?}");
        }
    }
}

/// Only a sky, and nothing in it: every pixel is the sky.
#[test]
fn an_empty_scene_shows_its_sky() {
    let scene = scene_of(
        "Film \"rgb\" \"integer xresolution\" 6 \"integer yresolution\" 5\nCamera \"perspective\"\nWorldBegin\n\
         LightSource \"infinite\" \"rgb L\" [ 2 2 2 ]\nLightSource \"distant\" \"rgb L\" [ 2 2 2 ]\n\
         LightSource \"point\" \"rgb I\" [ 2 2 2 ]",
    );
    for (name, image) in all_images(&scene, 64) {
        // A chain that owns the sky moves between pixels at random.
        let bound = if name.contains("chain") { 2.0 } else { 0.1 };
        for p in &image {
            assert!((p[1] - 2.0).abs() < bound, "{name}: {p:?}");
        }
    }
}

/// A lamp in a box with a hole of 10⁻⁷ of its face: seeding finds nothing in most groups, which then are black and are
/// not asked again, and no step meets a fault.
#[test]
fn light_that_one_path_in_ten_million_finds() {
    let h = 3e-4 / 2.0;
    let scene = scene_of(&format!(
        r#"Film "rgb" "integer xresolution" 8 "integer yresolution" 8
        Integrator "path" "integer maxdepth" 4
        LookAt 3 -3 1.4  0 0 0  0 0 1
        Camera "perspective" "float fov" 40
        WorldBegin
        AttributeBegin AreaLightSource "diffuse" "rgb L" [ 1e5 1e5 1e5 ] Translate 0 0 1.5
        Shape "sphere" "float radius" 0.2 AttributeEnd
        Shape "trianglemesh" "point3 P" [ -1 -1 1  1 -1 1  1 1 1  -1 1 1  -1 -1 2  1 -1 2  1 1 2  -1 1 2
                -{h} -{h} 1  {h} -{h} 1  {h} {h} 1  -{h} {h} 1 ]
            "integer indices" [ 0 8 1 8 9 1  1 9 2 9 10 2  2 10 3 10 11 3  3 11 0 11 8 0
                4 5 6 4 6 7  0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7 ]
        {FLOOR}"#
    ));
    all_images(&scene, 16);
}
