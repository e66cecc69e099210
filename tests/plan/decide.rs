//! The look at a scene before it is rendered: the same however it is cut, and right where it is clear what is right.

use metrolux::accel::{Embree, EmbreeOptions};
use metrolux::chain::{Direct, MltOptions, Pilot, Shares};
use metrolux::integrator::Probe;
use metrolux::mutation::Strategy;
use metrolux::path::{Tally, World};
use metrolux::plan::{Options, Plan};
use metrolux::scene::load::{LoadOptions, load_scene};
use std::path::Path;

fn probe(file: &str, seed: u64, threads: usize) -> Probe {
    look(file, seed, threads).0
}

fn look(file: &str, seed: u64, threads: usize) -> (Probe, Pilot) {
    let mut scene = load_scene(Path::new(file), &LoadOptions::default()).expect("a scene");
    let plan = Plan::make(&mut scene, &Options::default());
    let embree = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree builds");
    let world = World::new(&scene, &embree, scene.settings.max_depth).with_plan(&plan);
    let mut tally = Tally::default();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let options = MltOptions {
        shares: plan.shares,
        direct: Direct::InChain,
        ..MltOptions::default()
    };
    let t = &mut tally;
    pool.expect("threads start").install(|| match plan.lanes {
        1 => (
            Probe::new::<1, _>(&world, seed, t),
            Pilot::new::<1, _>(&world, &options, seed, t),
        ),
        _ => (
            Probe::new::<4, _>(&world, seed, t),
            Pilot::new::<4, _>(&world, &options, seed, t),
        ),
    })
}

#[test]
fn any_number_of_threads_sees_the_same() {
    let (one, pilot) = look("scenes/cornell-glass/cornell-glass.pbrt", 3, 1);
    let (other, again) = look("scenes/cornell-glass/cornell-glass.pbrt", 3, 3);
    assert_eq!((one, pilot), (other, again));
    assert!(one.tried > 2000 && one.success > 0.5, "{one:?}");
    assert!(one.specular > 0.3 && one.specular < 1.0, "{one:?}");
}

/// Of a lamp in an open room almost every direct connection succeeds. Under the pool's waves a lamp is only found by
/// rays that happen to hit it through the surface: a sampler with such a variance must not be left alone with it.
#[test]
fn direct_light_goes_to_the_chain_where_it_is_hard() {
    for seed in 1..4 {
        let room = probe("scenes/cornell/cornell.pbrt", seed, 2);
        assert!(room.separate_over_chain() < 0.5, "{room:?}");
        let pool = probe("scenes/pool/pool.pbrt", seed, 2);
        assert!(pool.separate_over_chain() > 1.0, "{pool:?}");
    }
}

/// The pool's light comes through its surface twice: multi-chain perturbations move such paths, and others hardly do. They
/// move caustics too, and what a pilot sees nothing of (all has been diffuse) keeps its floor. A bidirectional mutation moves
/// an image less than a perturbation wherever light is hard to find; it keeps its floor.
#[test]
fn shares_follow_what_moves_the_image() {
    for seed in 1..4 {
        let of = |file: &str| {
            let mut scene = load_scene(Path::new(file), &LoadOptions::default()).expect("a scene");
            let planned = Plan::make(&mut scene, &Options::default()).shares;
            look(file, seed, 2).1.shares(&planned)
        };
        let pool = of("scenes/pool/pool.pbrt");
        let caustic = of("scenes/caustic/caustic-x1.pbrt");
        for shares in [pool, caustic] {
            assert!(
                (shares.0.iter().sum::<f64>() - 1.0).abs() < 0.031,
                "{shares:?}"
            );
            let [least, lens] = [Strategy::Bidirectional, Strategy::Lens].map(|s| shares.get(s));
            assert!(least >= 0.17 && least < lens, "{shares:?}");
        }
        let all = Shares::of(true, true, true);
        let diffuse = look("scenes/cornell/cornell.pbrt", seed, 2).1.shares(&all);
        let found = [pool, caustic, diffuse].map(|s| s.get(Strategy::MultiChain));
        assert!(
            found[0] > 0.1 && found[1] > 0.06 && found[2] == 0.03,
            "{found:?}"
        );
    }
}

/// Inside a sphere that reflects half of what it gets, with a lamp in its centre, all directions see the same: paths of
/// two edges carry half of what all longer ones do together with them, the image is even, and no sample varies.
#[test]
fn the_furnace_is_known_by_hand() {
    let p = probe("scenes/furnace/point.pbrt", 1, 2);
    let part = p.direct / (p.direct + p.indirect);
    // 40 scatterings of the endless series; 4096 samples of indirect light.
    assert!((part - 0.5).abs() < 0.02, "{p:?}");
    assert_eq!(p.success, 1.0);
    assert!(p.noise < 1e-6 && p.edges < 1e-6, "{p:?}");
    assert!(
        (p.range - 1.0).abs() < 0.01 && (p.loss - 1.0).abs() < 0.01,
        "{p:?}"
    );
}
