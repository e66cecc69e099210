//! Random scenes built of primitives: no integrator panics or meets an impossible value, and threads change no bit.

use super::{all_images, scene_of};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

/// A material's directive: every lobe, smooth and rough, also at the ends of its parameters.
fn material() -> impl Strategy<Value = String> {
    let rough = prop_oneof![Just(0.0), Just(1e-4), 1e-3..1.0f64, Just(1.0)];
    let eta = prop_oneof![Just(1.0), 0.5..2.5f64, Just(1.000_001)];
    let grey = prop_oneof![Just(0.0), 0.0..1.0f64, Just(1.0)];
    (0..5u32, rough, eta, grey, 0.0..1.0f64).prop_map(|(kind, rough, eta, r, g)| {
        let colour = format!("\"rgb reflectance\" [ {r} {g} {r} ]");
        match kind {
            0 => format!("Material \"diffuse\" {colour}"),
            1 => format!("Material \"conductor\" {colour} \"float roughness\" {rough}"),
            2 => format!("Material \"dielectric\" \"float eta\" {eta} \"float roughness\" {rough}"),
            3 => format!("Material \"thindielectric\" \"float eta\" {eta}"),
            _ => format!("Material \"coateddiffuse\" {colour} \"float roughness\" {rough}"),
        }
    })
}

/// A shape, a lamp now and then, somewhere and of any size.
fn shape() -> impl Strategy<Value = String> {
    let place = (-2.0..2.0f64, -2.0..2.0f64, -2.0..2.0f64);
    let turn = (0.0..360.0f64, -1.0..1.0f64, -1.0..1.0f64);
    (material(), 0..3u32, place, turn, -6.0..0.5f64, 0..4u32).prop_map(
        |(material, kind, (x, y, z), (angle, u, v), size, lamp)| {
            let shape = match kind {
                0 => "Shape \"sphere\"",
                1 => "Shape \"disk\"",
                _ => "Shape \"trianglemesh\" \"point3 P\" [ -1 -1 0  1 -1 0  1 1 0.3  -1 1 0 ] \"integer indices\" [ 0 1 2 0 2 3 ]",
            };
            let lamp = if lamp == 0 {
                "AreaLightSource \"diffuse\" \"rgb L\" [ 4 3 2 ]"
            } else {
                ""
            };
            let s = 10f64.powf(size.min(0.0)) * if size > 0.0 { 3.0 } else { 1.0 };
            format!(
                "AttributeBegin {material} {lamp} Translate {x} {y} {z} Rotate {angle} {u} {v} 1 Scale {s} {s} {s} {shape} \
                 AttributeEnd\n"
            )
        },
    )
}

fn light() -> impl Strategy<Value = String> {
    let power = -6.0..6.0f64;
    (0..4u32, power, -2.0..2.0f64, -2.0..2.0f64).prop_map(|(kind, power, x, y)| {
        let l = 10f64.powf(power);
        match kind {
            0 => format!("LightSource \"infinite\" \"rgb L\" [ {l} {l} {l} ]\n"),
            1 => format!("LightSource \"point\" \"rgb I\" [ {l} {l} {l} ] \"point3 from\" [ {x} {y} 3 ]\n"),
            2 => format!("LightSource \"distant\" \"rgb L\" [ {l} {l} {l} ] \"point3 from\" [ {x} {y} 3 ]\n"),
            _ => format!(
                "LightSource \"spot\" \"rgb I\" [ {l} {l} {l} ] \"point3 from\" [ {x} {y} 3 ] \"point3 to\" [ 0 0 0 ]\n"
            ),
        }
    })
}

fn scene() -> impl Strategy<Value = String> {
    let camera = (prop_oneof![Just(0.0), 1e-6..0.5f64], 5.0..120.0f64, 0..7u32);
    let shapes = prop::collection::vec(shape(), 1..8);
    let lights = prop::collection::vec(light(), 0..3);
    (camera, shapes, lights).prop_map(|((lens, fov, depth), shapes, lights)| {
        format!(
            "Film \"rgb\" \"integer xresolution\" 7 \"integer yresolution\" 5\n\
             Integrator \"path\" \"integer maxdepth\" {depth}\nLookAt 0.1 -4 0.5  0 0 0  0 0 1\n\
             Camera \"perspective\" \"float fov\" {fov} \"float lensradius\" {lens} \"float focaldistance\" 4\nWorldBegin\n{}{}",
            shapes.concat(),
            lights.concat()
        )
    })
}

#[test]
fn random_scenes_are_rendered_without_fault_by_any_number_of_threads() {
    let config = Config {
        cases: 48,
        failure_persistence: None,
        ..Config::default()
    };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let mut runner = TestRunner::new_with_rng(config, rng);
    let on = |threads: usize, text: &str| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().expect("threads");
        pool.install(|| all_images(&scene_of(text), 2))
    };
    let done = runner.run(&scene(), |text| {
        prop_assert_eq!(on(1, &text), on(3, &text));
        Ok(())
    });
    done.unwrap_or_else(|e| panic!("{e}"));
}
