//! Spectra at the ends of their ranges.

use super::{all_images, scene_of};
use metrolux::scene::Material;
use metrolux::scene::load::{LoadOptions, load_str};
use metrolux::scene::spectrum::{Curve, LAMBDA_MAX, LAMBDA_MIN, Lanes, Spectrum};
use metrolux::scene::texture::SpectrumTexture;
use std::path::Path;

fn reflectance(rgb: [f32; 3]) -> Curve {
    let [r, g, b] = rgb;
    let scene = scene_of(&format!(
        "WorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ {r} {g} {b} ]\nShape \"sphere\""
    ));
    let diffuse = scene.materials.iter().rev().find_map(|m| match m {
        Material::Diffuse {
            reflectance: SpectrumTexture::Constant(c),
        } => Some(c.clone()),
        _ => None,
    });
    diffuse.expect("a diffuse material")
}

/// Black is 0 and white 1 at every wavelength, exactly; any other colour lies between.
#[test]
fn reflectances_stay_between_0_and_1() {
    let all = |c: &Curve, ok: &dyn Fn(f32) -> bool| {
        for i in 0..=4700 {
            let lambda = LAMBDA_MIN + 0.1 * i as f32;
            let v = c.at(lambda.min(LAMBDA_MAX));
            assert!(ok(v), "{c:?} at {lambda}: {v}");
        }
    };
    all(&reflectance([0.0; 3]), &|v| v == 0.0);
    all(&reflectance([1.0; 3]), &|v| v == 1.0);
    let steps = [0.0, 1e-6, 0.02, 0.5, 0.98, 0.999_999, 1.0];
    for r in steps {
        for g in steps {
            for b in steps {
                all(&reflectance([r, g, b]), &|v| (0.0..=1.0).contains(&v));
            }
        }
    }
}

/// Colours outside of sRGB are an error with its place where they would make light, and never a silent clamp.
#[test]
fn colours_that_cannot_be_are_errors() {
    for rgb in ["-0.1 0.5 0.5", "0.5 1.1 0.5", "inf 0 0", "1e39 0 0"] {
        let text = format!("WorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ {rgb} ]");
        let e = load_str(&text, Path::new(""), &LoadOptions::default()).expect_err(rgb);
        assert!(e.to_string().starts_with("<text>:2:20: "), "{e}");
    }
    for rgb in ["-1 1 1", "nan 1 1"] {
        let text = format!("WorldBegin\nLightSource \"infinite\" \"rgb L\" [ {rgb} ]");
        let e = load_str(&text, Path::new(""), &LoadOptions::default()).expect_err(rgb);
        assert!(e.to_string().starts_with("<text>:2:24: "), "{e}");
    }
}

/// Wavelengths at the ends of the hero variable lie in the range, with finite weights.
#[test]
fn lanes_at_the_ends_are_finite() {
    for u in [0.0, f32::MIN_POSITIVE, 1e-7, 0.5, 1.0 - f32::EPSILON / 2.0] {
        for lanes in [Lanes::<4>::new(u), Lanes::with_target(u, true)] {
            let ok = |v: &f32| (LAMBDA_MIN..=LAMBDA_MAX).contains(v);
            assert!(lanes.lambda.iter().all(ok), "{u}: {:?}", lanes.lambda);
            let weights = lanes.xyz.iter().chain([&lanes.target]);
            for w in weights {
                assert!(w.0.iter().all(|v| (0.0..1e4).contains(v)), "{u}: {w:?}");
            }
            let white = lanes.to_xyz(Spectrum::splat(1.0));
            assert!(white.iter().all(|v| v.is_finite()), "{u}: {white:?}");
        }
    }
}

/// A room of reflectance exactly 0, 1, and of every colour at the cube's corners, lit by lamps of narrow lines, a laser's
/// among them, and by a black body of 1 K, which sends nothing visible: no fault by any integrator.
#[test]
fn extreme_colours_and_spiky_lamps_are_no_faults() {
    let mut world = String::new();
    for (i, rgb) in [
        "0 0 0", "1 1 1", "1 0 0", "0 1 0", "0 0 1", "1 1 0", "0 1 1", "1 0 1",
    ]
    .iter()
    .enumerate()
    {
        let x = i as f32 - 4.0;
        world += &format!(
            "Material \"diffuse\" \"rgb reflectance\" [ {rgb} ]\nShape \"trianglemesh\" \
             \"point3 P\" [ {x} -3 0  {r} -3 0  {r} 3 0.5  {x} 3 0.5 ] \"integer indices\" [ 0 1 2 0 2 3 ]\n",
            r = x + 1.0
        );
    }
    for (x, spectrum) in [
        (-3, "\"spectrum I\" \"stdillum-F11\""),
        (-1, "\"spectrum I\" [ 531.9 0  532 1  532.1 0 ]"),
        (1, "\"spectrum I\" [ 360 1  361 0  829 0  830 1 ]"),
        (2, "\"blackbody I\" [ 1 ]"),
        (3, "\"rgb I\" [ 0 0 9 ]"),
    ] {
        world += &format!("LightSource \"point\" {spectrum} \"point3 from\" [ {x} 0 2 ]\n");
    }
    let scene = scene_of(&format!(
        "Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 6\nIntegrator \"path\" \"integer maxdepth\" 4\n\
         LookAt 0 -4 5  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 50\nWorldBegin\n{world}"
    ));
    let images = all_images(&scene, 16);
    for (name, image) in images {
        assert!(image.iter().any(|p| p[1] > 0.0), "{name}");
    }
}
