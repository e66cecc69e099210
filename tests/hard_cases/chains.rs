//! Chains in places they can hardly leave, and images of odd shapes.

use super::common::scene::{embree, of_file};
use super::{all_images, chains_on, scene_of, small};
use metrolux::chain::{Chain, Direct, MltOptions, Setting, Shares, Splat, replay, seed_group};
use metrolux::mutation::Strategy;
use metrolux::path::{Sampler, Tally, World};
use metrolux::sampling::Rng;

/// Steps of a chain, the weight it gave the image, and its counters.
fn walk(options: &MltOptions, steps: u64) -> (f64, metrolux::chain::ChainStats) {
    let scene = of_file("cornell-glass/cornell-glass.pbrt", 16, 16);
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 7);
    let set = Setting::new(&world, options);
    let mut tally = Tally::default();
    let batch = seed_group::<4, _>(&set, 5, 0, 0, &mut tally);
    let mut sampler = Sampler::new(world.max_edges);
    let start = batch.seeds[0];
    assert!(replay(
        &world,
        options,
        5,
        0,
        0,
        start,
        &mut sampler,
        &mut tally
    ));
    let (path, pool) = sampler.joined();
    let mut chain = Chain::<4>::new(world.max_edges, Rng::new(5, 1000, 0, 0));
    chain.start(path, pool);
    let mut weight = 0.0;
    let mut sink = |s: Splat| weight += f64::from(s.weight);
    for _ in 0..steps {
        chain.step(&set, &mut sink);
    }
    chain.flush(&mut sink);
    (weight, chain.stats)
}

/// However a chain fares, each step gives the image a weight of 1 in all: to proposal and current path by expectation,
/// after rejections and failed constructions too.
#[test]
fn every_step_gives_the_image_a_weight_of_one() {
    for expected_values in [true, false] {
        for direct in [Direct::Separate, Direct::InChain] {
            let steps = 50_000;
            let options = MltOptions {
                seeds: 512,
                expected_values,
                shares: Shares([0.3, 0.2, 0.2, 0.2, 0.05, 0.05]),
                ..small(direct)
            };
            let (weight, stats) = walk(&options, steps);
            // A weight is rounded to f32, half of 2⁻²⁴ of it at most.
            let off = (weight / steps as f64 - 1.0).abs();
            assert!(
                off < 2f64.powi(-24),
                "{expected_values} {direct:?}: {off:e}"
            );
            assert!(stats.longest_stay > 10, "{stats:?}");
        }
    }
}

/// A million steps in a row without a move: no strategy has a share but one that never suits a path here. The whole
/// weight goes to the one path.
#[test]
fn a_million_rejections_in_a_row_are_weight_for_one_path() {
    let mut shares = [0.0; Strategy::ALL.len()];
    shares[Strategy::Wavelength as usize] = 0.0;
    let options = MltOptions {
        shares: Shares(shares),
        ..small(Direct::InChain)
    };
    let (weight, stats) = walk(&options, 1_000_000);
    assert_eq!((weight, stats.longest_stay), (1e6, 1_000_000));
    assert_eq!(stats.tally.impossible(), 0);
}

/// Ratios that no step may take: each is counted by its kind.
#[test]
fn impossible_ratios_are_counted_by_kind() {
    let mut t = Tally::default();
    let zero = std::hint::black_box(0.0f64);
    assert!(t.check(0.0) && t.check(1.0) && t.check(f64::MAX) && t.check(5e-324));
    assert_eq!(t, Tally::default());
    assert!(!t.check(zero / zero) && !t.check(1.0 / zero) && !t.check(-1e-300));
    assert_eq!((t.fault_nan, t.fault_infinite, t.fault_negative), (1, 1, 1));
    assert_eq!(t.impossible(), 3);
}

/// A test image that is black says nothing: the run is the one of one stage, to the bit.
#[test]
fn a_black_test_image_is_one_stage() {
    let scene = scene_of(
        r#"Film "rgb" "integer xresolution" 6 "integer yresolution" 6
        Integrator "path" "integer maxdepth" 3
        LookAt 3 -3 1.4  0 0 0  0 0 1
        Camera "perspective" "float fov" 40
        WorldBegin
        AreaLightSource "diffuse" "rgb L" [ 5 5 5 ]
        Shape "trianglemesh" "point3 P" [ -4 -4 0  4 -4 0  4 4 0  -4 4 0 ] "integer indices" [ 0 1 2 0 2 3 ]"#,
    );
    // A convex lamp alone has no indirect light, so what the chains own is black.
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 3);
    let one = chains_on(&world, &small(Direct::Separate), 16.0);
    let two = MltOptions {
        test_samples: Some(2),
        ..small(Direct::Separate)
    };
    let two = chains_on(&world, &two, 16.0);
    assert_eq!(one.b, (0.0, 0.0));
    assert_eq!(one.image, two.image);
    assert!(one.image.iter().any(|p| p[1] > 0.0));
}

/// Images of one pixel, one row and one column, and crops of one pixel in the corner of a larger image.
#[test]
fn images_of_any_shape() {
    let shape = |film: &str| {
        scene_of(&format!(
            r#"Film "rgb" {film}
            Integrator "path" "integer maxdepth" 3
            LookAt 3 -3 1.4  0 0 0  0 0 1
            Camera "perspective" "float fov" 20
            WorldBegin
            LightSource "point" "rgb I" [ 9 9 9 ] "point3 from" [ 0 0 2 ]
            Shape "trianglemesh" "point3 P" [ -9 -9 0  9 -9 0  9 9 0  -9 9 0  -1 1 0  1 1 0  1 1 2  -1 1 2 ]
                "integer indices" [ 0 1 2 0 2 3 4 5 6 4 6 7 ]"#
        ))
    };
    let size = |w: u32, h: u32| format!("\"integer xresolution\" {w} \"integer yresolution\" {h}");
    for (film, pixels) in [
        (size(1, 1), 1),
        (size(1, 10_000), 10_000),
        (size(10_000, 1), 10_000),
        (
            size(65_536, 1) + " \"integer pixelbounds\" [ 65535 65536 0 1 ]",
            1,
        ),
        (size(64, 48) + " \"integer pixelbounds\" [ 63 64 47 48 ]", 1),
    ] {
        let scene = shape(&film);
        for (name, image) in all_images(&scene, 2) {
            assert_eq!(image.len(), pixels, "{name}, {film}");
        }
    }
    // The middle of the scene in one pixel is as bright as the same in many.
    let means = [size(1, 1), size(32, 32)].map(|film| {
        all_images(&shape(&film), 256)
            .into_iter()
            .map(|(name, image)| {
                (
                    name,
                    image.iter().map(|p| p[1]).sum::<f64>() / image.len() as f64,
                )
            })
            .collect::<Vec<_>>()
    });
    for ((name, one), (_, many)) in means[0].iter().zip(&means[1]) {
        println!("{name}: {one} {many}");
        // 1024 samples of a pixel whose radiance varies twofold, and chains of some thousand steps.
        assert!((one / many - 1.0).abs() < 0.25, "{name}: {one} {many}");
    }
}
