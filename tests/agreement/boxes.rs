//! The scenes of `scenes/`.

use super::common::scene::{embree, of_file};
use super::common::stats::agree;
use super::{Effort, Limits, Work, pairs, runs};
use metrolux::chain::Direct::{self, InChain, Separate};
use metrolux::path::World;

fn of(file: &str, size: [u32; 2], depth: u32, effort: Effort, chains: &[Direct]) {
    let scene = of_file(file, size[0], size[1]);
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, depth);
    let found = runs::<4, _>(&world, effort.work, effort.limits, chains);
    agree(file, &pairs(&found, effort.limits));
}

/// Diffuse walls, the scene's own depth.
#[test]
fn cornell() {
    let effort = Effort {
        work: Work {
            pt: 256,
            bdpt: 64,
            seeds: 32_768,
            steps: 130_000,
        },
        limits: Limits {
            least: 0.05,
            pt: 0.02,
            mlt: 0.02,
            in_chain: 0.12,
            indirect: 0.05,
            tile: 0.1,
        },
    };
    of(
        "cornell/cornell.pbrt",
        [16, 16],
        8,
        effort,
        &[Separate, InChain],
    );
}

const GLASS: &str = "cornell-glass/cornell-glass.pbrt";

/// Caustics, mirror paths and chains of them, up to 8 edges; the lamp is too small for path tracing to find it well.
#[test]
fn cornell_glass() {
    let effort = Effort {
        work: Work {
            pt: 256,
            bdpt: 192,
            seeds: 32_768,
            steps: 100_000,
        },
        limits: Limits {
            least: 0.05,
            pt: 0.15,
            mlt: 0.1,
            in_chain: 0.3,
            indirect: 0.1,
            tile: 0.2,
        },
    };
    of(GLASS, [16, 16], 7, effort, &[Separate]);
}

/// As above, without path tracing.
#[test]
#[ignore = "minutes; make test-long"]
fn cornell_glass_long() {
    let effort = Effort {
        work: Work {
            pt: 0,
            bdpt: 1536,
            seeds: 262_144,
            steps: 8_000_000,
        },
        limits: Limits {
            least: 0.05,
            pt: 0.02,
            mlt: 0.02,
            in_chain: 0.3,
            indirect: 0.02,
            tile: 0.1,
        },
    };
    of(GLASS, [16, 16], 7, effort, &[Separate]);
}

const AJAR: &str = "ajar/ajar.pbrt";

/// Light through the door, up to 6 edges: those that bidirectional path tracing, for which this scene is hard, finds
/// often enough. Path tracing does not.
#[test]
fn ajar() {
    let effort = Effort {
        work: Work {
            pt: 0,
            bdpt: 64,
            seeds: 16_384,
            steps: 40_000,
        },
        limits: Limits {
            least: 0.05,
            pt: 0.3,
            mlt: 0.3,
            in_chain: 0.5,
            indirect: 0.2,
            tile: 1.0,
        },
    };
    of(AJAR, [32, 18], 5, effort, &[Separate]);
}

/// The same for so long that 2 % of a length and 10 % of a tile are seen.
#[test]
#[ignore = "minutes; make test-long"]
fn ajar_long() {
    let effort = Effort {
        work: Work {
            pt: 0,
            bdpt: 14_336,
            // All of them are one estimate of b, in which this scene has its noise.
            seeds: 4_194_304,
            steps: 10_000_000,
        },
        limits: Limits {
            least: 0.05,
            pt: 0.02,
            mlt: 0.02,
            in_chain: 0.5,
            indirect: 0.02,
            tile: 0.1,
        },
    };
    of(AJAR, [32, 18], 5, effort, &[Separate]);
}
