//! A value that cannot be is counted, its place is told, and the work there can be done again.

use super::common::scene::{embree, of_text};
use super::small;
use assert_cmd::Command;
use metrolux::chain::{Direct, Setting, Which, Witness, chain_again, step_seen, verify};
use metrolux::integrator::{Budget, Quiet, mlt, pt};
use metrolux::path::{Site, Tally, World};
use metrolux::scene::Material;
use metrolux::scene::Scene;
use metrolux::scene::spectrum::Curve;
use metrolux::scene::texture::SpectrumTexture;
use std::path::Path;

/// A room with a patch of floor whose reflectance is no number, which no file can say.
fn cursed() -> Scene {
    let mut scene = of_text(
        8,
        "LookAt 0.5 -3 1.25  0 0 0.5  0 0 1\nCamera \"perspective\" \"float fov\" 40",
        r#"LightSource "point" "rgb I" [ 3 3 3 ] "point3 from" [ -1 -1 1.5 ]
        Material "diffuse" "rgb reflectance" [ 0.7 0.7 0.7 ]
        Shape "trianglemesh" "point3 P" [ -2 -2 0  2 -2 0  2 2 0  -2 2 0  -2 1 0  2 1 0  2 1 2  -2 1 2 ]
            "integer indices" [ 0 1 2 0 2 3 4 5 6 4 6 7 ]
        Material "diffuse" "rgb reflectance" [ 0.25 0.25 0.25 ]
        Shape "trianglemesh" "point3 P" [ 0 0 0.01  0.3 0 0.01  0 0.3 0.01 ] "integer indices" [ 0 1 2 ]"#,
    );
    let patch = scene.geometry.shapes[1].material as usize;
    scene.materials[patch] = Material::Diffuse {
        reflectance: SpectrumTexture::Constant(Curve::Constant(f32::NAN)),
    };
    scene
}

/// Every site that a run of chains tells of is met again there, by the same kind of fault, and the fault does not reach
/// the image.
#[test]
fn a_fault_is_met_again_where_it_was_told() {
    let scene = cursed();
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 4);
    let options = small(Direct::Separate);
    let mut tally = Tally::default();
    let r = mlt::<4, _>(
        &world,
        &options,
        Budget::PerPixel(200.0),
        7,
        &Quiet,
        &mut tally,
    );
    assert!(tally.fault_nan > 0, "{tally:?}");
    assert_eq!(tally.impossible(), tally.fault_nan);
    assert!(r.image.iter().flatten().all(|v| v.is_finite()));

    let set = Setting::new(&world, &options);
    let sites = world.sites.first();
    assert_eq!(sites.len(), 8);
    let mut met = 0;
    for site in sites {
        let Site::Step {
            generation,
            group,
            chain,
            step,
            steps,
        } = site
        else {
            continue;
        };
        assert_eq!(steps, 1);
        let which = Which {
            seed: 7,
            generation,
            group,
            chain,
        };
        let mut chain = chain_again::<4, _>(&set, which, &mut Tally::default()).expect("a chain");
        let mut witness = Witness::new(&world);
        while chain.steps() < step {
            step_seen(&mut chain, &set, &mut witness, |_| ());
        }
        step_seen(&mut chain, &set, &mut witness, |s| {
            assert_eq!((s.step, s.tally.fault_nan), (step, 1));
            assert!(!s.turn.accepted);
        });
        met += 1;
    }
    // Seeds come first in the order of sites; another world without them tells of the steps.
    let world = World::new(&scene, &accel, 4);
    let set = Setting::new(&world, &options);
    let which = Which {
        seed: 7,
        generation: 0,
        group: 1,
        chain: 2,
    };
    let mut seeding = Tally::default();
    let mut chain = chain_again::<4, _>(&set, which, &mut seeding).expect("a chain");
    let mut witness = Witness::new(&world);
    let mut faulty = Vec::new();
    for _ in 0..20_000 {
        step_seen(&mut chain, &set, &mut witness, |s| {
            if s.tally.impossible() > 0 {
                faulty.push(s.step);
            }
        });
    }
    let told: Vec<u64> = world
        .sites
        .first()
        .into_iter()
        .filter_map(|s| match s {
            Site::Step { step, .. } => Some(step),
            _ => None,
        })
        .collect();
    assert!(!faulty.is_empty());
    assert!(
        told.iter().all(|s| faulty.contains(s)),
        "{told:?} {faulty:?}"
    );
    println!("{met} steps met again, {} in one chain", faulty.len());
}

/// Camera samples tell of theirs.
#[test]
fn a_fault_of_a_camera_sample_is_told_with_its_pixel() {
    let scene = cursed();
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 4);
    let mut tally = Tally::default();
    let (image, _) = pt::<4, _>(&world, Budget::Rounds(16), 1, &Quiet, &mut tally);
    assert!(tally.fault_nan > 0, "{tally:?}");
    assert!(image.iter().flatten().all(|v| v.is_finite()));
    let pixel = |s: &Site| matches!(s, Site::Pixel { direct: false, pixel: [x, y], sample } if *x < 8 && *y < 8 && *sample < 16);
    let sites = world.sites.first();
    assert!(!sites.is_empty() && sites.iter().all(pixel), "{sites:?}");
}

/// Looking changes nothing: a chain that is looked into stands where one that is not stands.
#[test]
fn a_step_that_is_seen_is_the_same_step() {
    let scene = super::common::scene::of_file("cornell-glass/cornell-glass.pbrt", 16, 16);
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 6);
    let options = small(Direct::Separate);
    let set = Setting::new(&world, &options);
    let which = Which {
        seed: 3,
        generation: 1,
        group: 2,
        chain: 3,
    };
    let mut tally = Tally::default();
    let [mut a, mut b] =
        [(); 2].map(|_| chain_again::<4, _>(&set, which, &mut tally).expect("a chain"));
    let mut witness = Witness::new(&world);
    let mut d = Default::default();
    let mut weight = [0.0; 2];
    for _ in 0..20_000 {
        a.step(&set, &mut |s: metrolux::chain::Splat| {
            weight[0] += s.weight as f64
        });
        step_seen(&mut b, &set, &mut witness, |s| verify(&set, s, &mut d));
        weight[1] += witness.given.iter().map(|g| g.weight as f64).sum::<f64>();
    }
    assert_eq!(a.x.raster, b.x.raster);
    assert_eq!((a.x.shape, &a.x.rho), (b.x.shape, &b.x.rho));
    assert_eq!(a.stats, b.stats);
    assert_eq!(weight[0], weight[1]);
    assert!(d.fine() && d.proposals > 5000, "{d:?}");
    assert!(a.stats.strategies.iter().any(|s| s.longest_run > 3));
}

fn metrolux(args: &[&str]) -> (i32, String) {
    let scene =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-glass/cornell-glass.pbrt");
    let mut c = Command::new(env!("CARGO_BIN_EXE_metrolux"));
    let done = c
        .arg(args[0])
        .arg(scene)
        .args(&args[1..])
        .output()
        .expect("it runs");
    let text = String::from_utf8([done.stdout, done.stderr].concat()).expect("UTF-8");
    (done.status.code().expect("an exit code"), text)
}

#[test]
fn the_replay_command_prints_a_step() {
    let (code, text) = metrolux(&[
        "replay",
        "--resolution",
        "16x16",
        "--max-depth",
        "5",
        "--seed",
        "3",
        "--group",
        "2",
        "--chain",
        "1",
        "--step",
        "300",
    ]);
    assert_eq!(code, 0, "{text}");
    for part in [
        "step: 300\n",
        "x: ",
        "strategy: ",
        "faults: 0 NaN",
        "rays: ",
    ] {
        assert!(text.contains(part), "no {part:?} in\n{text}");
    }
    let (code, text) = metrolux(&["replay", "--group", "99", "--chain", "0", "--step", "1"]);
    assert_eq!(code, 2, "{text}");
    assert!(text.contains("found group 99"), "{text}");
}

#[test]
fn the_verify_command_finds_nothing_in_a_room_with_glass() {
    let (code, text) = metrolux(&["verify", "--resolution", "32x32", "--steps", "300"]);
    println!("{text}");
    assert_eq!(code, 0, "{text}");
    assert!(text.starts_with("4800 steps, "), "{text}");
    let (code, text) = metrolux(&["verify", "--integrator", "pt"]);
    assert_eq!(code, 2, "{text}");
}
