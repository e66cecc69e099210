//! A planned image and one with an effect forced are the same but for noise.

use super::scene;
use metrolux::accel::{Embree, EmbreeOptions};
use metrolux::chain::MltOptions;
use metrolux::integrator::{Budget, Quiet, mlt};
use metrolux::path::{Tally, World};
use metrolux::plan::{Effect, Options, Plan};
use metrolux::scene::Scene;

// What only other tests use of it.
#[allow(dead_code)]
#[path = "../common/stats.rs"]
mod stats;
use stats::{Estimate, Pair, agree};

/// A closed grey room with a lamp and a block.
const ROOM: &str = r#"
    Integrator "mlt" "integer maxdepth" 4
    Film "rgb" "integer xresolution" 8 "integer yresolution" 8
    PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
    LookAt 0 0 -0.9  0 0 1  0 1 0
    Camera "perspective" "float fov" 80
    WorldBegin
    AttributeBegin
    AreaLightSource "diffuse" "rgb L" [ 9 8 5 ]
    Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
        "point3 P" [ -0.3 0.99 -0.3  0.3 0.99 -0.3  0.3 0.99 0.3  -0.3 0.99 0.3 ]
    AttributeEnd
    Material "diffuse" "rgb reflectance" [ 0.6 0.6 0.6 ]
    Shape "trianglemesh" "integer indices" [ 0 1 3 0 3 2 4 6 7 4 7 5 0 4 5 0 5 1 2 3 7 2 7 6 0 2 6 0 6 4 1 5 7 1 7 3 ]
        "point3 P" [ -1 -1 -1  1 -1 -1  -1 1 -1  1 1 -1  -1 -1 1  1 -1 1  -1 1 1  1 1 1 ]
    Material "diffuse" "rgb reflectance" [ 0.3 0.3 0.3 ]
    AttributeBegin
    Translate 0.3 -0.7 0.2
    Shape "sphere" "float radius" 0.3
    AttributeEnd
    "#;

/// Mean X, Y and Z of the quarters of the image, from independent seeds.
fn quarters(scene: &Scene, plan: &Plan, seeds: std::ops::Range<u64>) -> Vec<Estimate> {
    let embree = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree builds");
    let world = World::new(scene, &embree, scene.settings.max_depth).with_plan(plan);
    let options = MltOptions {
        shares: plan.shares,
        // Less seeding than a picture wants: many small runs.
        seeds: 512,
        ..MltOptions::default()
    };
    let images: Vec<Vec<[f64; 3]>> = seeds
        .map(|seed| {
            let mut tally = Tally::default();
            let budget = Budget::Rounds(3);
            let image = match plan.lanes {
                1 => mlt::<1, _>(&world, &options, budget, seed, &Quiet, &mut tally).image,
                _ => mlt::<4, _>(&world, &options, budget, seed, &Quiet, &mut tally).image,
            };
            assert_eq!(tally.impossible(), 0);
            image
        })
        .collect();
    let quarter = |i: usize| (i % 8) / 4 + 2 * (i / 32);
    let mut all = Vec::new();
    for q in 0..4 {
        for c in 0..3 {
            let mean = |image: &Vec<[f64; 3]>| {
                let of = (0..64).filter(|i| quarter(*i) == q);
                of.map(|i| image[i][c]).sum::<f64>() / 16.0
            };
            all.push(Estimate::of(images.iter().map(mean)));
        }
    }
    all
}

/// 12 comparisons for each effect, all under one level; a bias of 12 % of a quarter's X, Y or Z would be found.
#[test]
fn a_forced_effect_leaves_the_image_as_it_is() {
    let mut planned = scene(ROOM);
    let plan = Plan::make(&mut planned, &Options::default());
    assert!(plan.grey.is_some());
    let reference = quarters(&planned, &plan, 5000..5024);
    let mut pairs = Vec::new();
    for effect in Effect::ALL {
        if matches!(effect, Effect::Alpha | Effect::Indirect) {
            continue;
        }
        let mut forced = scene(ROOM);
        let force = vec![effect];
        let options = Options {
            force,
            ..Options::default()
        };
        let plan = Plan::make(&mut forced, &options);
        let seeds = 100 * (1 + effect as u64);
        let found = quarters(&forced, &plan, seeds..seeds + 12);
        for (i, (found, reference)) in found.into_iter().zip(&reference).enumerate() {
            pairs.push(Pair {
                name: format!("{effect}, quarter {}, {}", i / 3, ["X", "Y", "Z"][i % 3]),
                found,
                reference: *reference,
                limit: 0.12,
            });
        }
    }
    agree("forced against planned", &pairs);
}

/// A grey scene's image has the lamp's colour in every pixel, to the rounding of the film.
#[test]
fn without_colour_every_pixel_has_the_lamps() {
    let mut room = scene(ROOM);
    let plan = Plan::make(&mut room, &Options::default());
    let embree = Embree::new(&room.geometry, EmbreeOptions::default()).expect("Embree builds");
    let world = World::new(&room, &embree, room.settings.max_depth).with_plan(&plan);
    let options = MltOptions {
        shares: plan.shares,
        ..MltOptions::default()
    };
    let budget = Budget::Rounds(2);
    let r = mlt::<1, _>(&world, &options, budget, 1, &Quiet, &mut Tally::default());
    let (_, grey) = plan.grey.expect("no colour");
    for p in r.image.iter().filter(|p| p[1] > 0.0) {
        for (v, xyz) in p.iter().zip(grey.xyz) {
            let ratio = v / p[1];
            // Each splat rounds to f32 in each of X, Y and Z.
            assert!((ratio - (xyz / grey.xyz[1]) as f64).abs() < 1e-5, "{p:?}");
        }
    }
}

/// Bins of a scene without colour: those of its illuminant, whatever is seen of it.
#[test]
fn without_colour_the_bins_are_the_illuminants() {
    let text = "PixelFilter \"box\" Film \"rgb\" \"integer xresolution\" 2 \"integer yresolution\" 2\nCamera \"perspective\"\nWorldBegin\n\
                LightSource \"infinite\" \"blackbody L\" 3100 \"float scale\" 3\n";
    let folder = tempfile::tempdir().expect("a folder");
    let (file, out) = (folder.path().join("a.pbrt"), folder.path().join("a.exr"));
    std::fs::write(&file, text).expect("written");
    let sky = match &scene(text).lights[0] {
        metrolux::scene::Light::InfiniteConstant { radiance } => radiance.clone(),
        other => panic!("{other:?}"),
    };
    let done = std::process::Command::new(env!("CARGO_BIN_EXE_metrolux"))
        .args([
            "render",
            "--quiet",
            "--spp",
            "1",
            "--spectral",
            "5",
            "--integrator",
            "pt",
        ])
        .arg(&file)
        .arg("-o")
        .arg(&out)
        .status();
    assert!(done.expect("it runs").success());
    let image = exr::prelude::read_all_flat_layers_from_file(&out).expect("an EXR file");
    let channels = &image.layer_data[0].channel_data.list;
    let bins = channels
        .iter()
        .filter(|c| c.name.to_string().starts_with("S0"));
    for (i, bin) in bins.enumerate() {
        let from = 360.0 + 94.0 * i as f32;
        let mean = (0..94).map(|n| sky.at(from + 0.5 + n as f32)).sum::<f32>() / 94.0;
        for v in bin.sample_data.values_as_f32() {
            // Midpoints of nanometres against tenths of them: the curve is linear in each nanometre.
            assert!((v / mean - 1.0).abs() < 1e-4, "{i}: {v} {mean}");
        }
    }
}
