//! Hard cases: what makes renderers print NaN, lose light or hang, each as a small scene or a property with the bound
//! that must hold. No case may meet an impossible value: every estimate here fails if a fault was counted.

#[path = "../common/mod.rs"]
mod common;

mod chains;
mod drift;
mod faults;
mod grazing;
mod input;
mod lights;
mod lobes;
mod long;
mod random;
mod scale;
mod spectra;
mod sums;
mod triangles;

use common::estimate::{self, Chains, Grid, Run};
use common::scene::embree;
use common::stats::{Estimate, Pair};
use metrolux::accel::Accel;
use metrolux::chain::{Direct, MltOptions};
use metrolux::integrator::{Bdpt, Budget, MltResult, Quiet, bdpt, mlt, pt};
use metrolux::path::{Heuristic, Tally, World};
use metrolux::scene::Scene;
use metrolux::scene::load::{LoadOptions, load_str};

/// XYZ of each pixel.
type Pixels = Vec<[f64; 3]>;

/// A scene from the text of a whole file.
fn scene_of(text: &str) -> Scene {
    let options = LoadOptions::default();
    load_str(text, std::path::Path::new(""), &options).unwrap_or_else(|e| panic!("{e}"))
}

/// Few chains and seeds: an image in a fraction of a second.
fn small(direct: Direct) -> MltOptions {
    MltOptions {
        groups: 4,
        chains: 4,
        seeds: 512,
        round: 32,
        rounds_per_generation: 64,
        direct,
        ..MltOptions::default()
    }
}

/// A Metropolis image; fails on a fault.
fn chains_on<A: Accel>(world: &World<A>, options: &MltOptions, per_pixel: f64) -> MltResult {
    let mut tally = Tally::default();
    let budget = Budget::PerPixel(per_pixel);
    let r = mlt::<4, A>(world, options, budget, 1, &Quiet, &mut tally);
    assert_eq!(tally.impossible(), 0, "mlt: {tally:?}");
    r
}

/// Images of a few samples or mutations a pixel, by every integrator, on Embree. Fails on a fault, and on a value that is
/// no finite number ≥ 0.
fn all_images(scene: &Scene, spp: u64) -> Vec<(&'static str, Pixels)> {
    images_on(scene, &embree(scene), spp)
}

/// The same on any backend.
fn images_on<A: Accel>(scene: &Scene, accel: &A, spp: u64) -> Vec<(&'static str, Pixels)> {
    let world = World::new(scene, accel, scene.settings.max_depth);
    let budget = Budget::Rounds(spp);
    let mut tally = Tally::default();
    let what = Bdpt {
        heuristic: Heuristic::Power,
        indirect_only: false,
    };
    let mut all = vec![
        ("pt", pt::<4, A>(&world, budget, 1, &Quiet, &mut tally).0),
        (
            "bdpt",
            bdpt::<4, A>(&world, what, budget, 1, &Quiet, &mut tally).0,
        ),
    ];
    assert_eq!(tally.impossible(), 0, "{tally:?}");
    for (name, options) in [
        ("mlt", small(Direct::Separate)),
        ("mlt, direct light in the chain", small(Direct::InChain)),
        (
            "mlt of two stages",
            MltOptions {
                test_samples: Some(2),
                ..small(Direct::Separate)
            },
        ),
    ] {
        let image = chains_on(&world, &options, 4.0 * spp as f64).image;
        all.push((name, image));
    }
    for (name, image) in &all {
        let bad = image
            .iter()
            .flatten()
            .find(|v| !(0.0..f64::INFINITY).contains(*v));
        assert_eq!(bad, None, "{name}");
    }
    all
}

/// Light by path length, by every integrator: path tracing, bidirectional path tracing, chains with direct light in them.
/// 16 repeats; `effort` multiplies samples and steps.
fn by_length(scene: &Scene, depth: u32, effort: u32) -> [(&'static str, Run); 3] {
    let accel = embree(scene);
    let world = World::new(scene, &accel, depth);
    let grid = Grid::new(&world, 4);
    let chains = Chains {
        options: MltOptions {
            chains: 4,
            seeds: 512 * effort,
            direct: Direct::InChain,
            ..MltOptions::default()
        },
        steps: 4000 * effort,
        direct: 0,
    };
    let bdpt = estimate::bdpt::<4, _>(&world, grid, Heuristic::Balance, 2, 16, 16 * effort);
    [
        ("pt", estimate::pt::<4, _>(&world, grid, 1, 16, 32 * effort)),
        ("bdpt", bdpt),
        ("mlt", estimate::mlt::<4, _>(&world, grid, chains, 3, 16)),
    ]
}

/// Paths of `edges` edges bring the luminance `expected`, by the runs named, within what each may leave unseen.
fn brings(
    what: &str,
    runs: &[(&'static str, Run)],
    edges: std::ops::RangeInclusive<usize>,
    expected: f64,
    limit: f64,
) -> Vec<Pair> {
    let of = |(name, run): &(&str, Run)| Pair {
        name: format!("{what} by {name}"),
        found: run.length(edges.clone()),
        reference: Estimate::exact(expected),
        limit,
    };
    runs.iter().map(of).collect()
}
