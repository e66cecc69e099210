//! Each perturbation alone beside 10 % bidirectional mutations, on scenes of specular chains: a plate of glass under a
//! lamp, water over a floor, a corner with a mirror.

use super::common::estimate::{self, Grid};
use super::common::scene::{embree, of_text};
use super::common::stats::agree;
use super::{Effort, Judged, LONG, Limits, QUICK, REPEATS, Work, pairs, runs};
use metrolux::chain::Direct::{InChain, Separate};
use metrolux::chain::Shares;
use metrolux::mutation::Strategy;
use metrolux::path::World;

const CAMERA: &str =
    "LookAt 0.3 -2.2 2.1  0 0.1 0.3  0 0 1\nCamera \"perspective\" \"float fov\" 36";

/// A floor, and a lamp of two metres.
const ROOM: &str = r#"
Material "diffuse" "rgb reflectance" [ 0.7 0.6 0.4 ]
Shape "trianglemesh" "point3 P" [ -2 -2 0  2 -2 0  2 2 0  -2 2 0 ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 5 4 3 ]
Shape "trianglemesh" "point3 P" [ -1 -1 2.4  -1 1 2.4  1 1 2.4  1 -1 2.4 ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeEnd
Material "dielectric" "float eta" 1.5
"#;

/// A plate of glass seen from above: LSSDE beside it, LSSDSSE through it.
const PLATE: &str = r#"Shape "trianglemesh"
    "point3 P" [ -0.5 -0.5 0.5  0.5 -0.5 0.5  0.5 0.5 0.5  -0.5 0.5 0.5
                 -0.5 -0.5 0.6  0.5 -0.5 0.6  0.5 0.5 0.6  -0.5 0.5 0.6 ]
    "integer indices" [ 0 2 1 0 3 2  4 5 6 4 6 7  0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7 ]"#;

/// The surface of a pool: LSDSE.
const POOL: &str = r#"Shape "trianglemesh"
    "point3 P" [ -2.1 -2.1 0.4  2.1 -2.1 0.4  2.1 2.1 0.4  -2.1 2.1 0.4 ]
    "integer indices" [ 0 1 2 0 2 3 ]"#;

/// A wedge of flint glass: LSSDE of one colour each.
const WEDGE: &str = r#"Material "dielectric" "spectrum eta" "glass-F11"
Shape "trianglemesh"
    "point3 P" [ -0.6 -0.5 0.5  0.6 -0.5 0.5  0.6 0.5 0.5  -0.6 0.5 0.5
                 -0.6 -0.5 0.55  0.6 -0.5 0.9  0.6 0.5 0.9  -0.6 0.5 0.55 ]
    "integer indices" [ 0 2 1 0 3 2  4 5 6 4 6 7  0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7 ]"#;

/// A wall, and a mirror beside it: LDDE, and LDDSE in the mirror. On the floor lies a coated sheet, where modes are
/// chosen.
const CORNER: &str = r#"
Material "diffuse" "rgb reflectance" [ 0.3 0.6 0.7 ]
Shape "trianglemesh" "point3 P" [ -2 1 0  2 1 0  2 1 2.5  -2 1 2.5 ] "integer indices" [ 0 1 2 0 2 3 ]
Material "coateddiffuse" "rgb reflectance" [ 0.5 0.5 0.5 ] "float eta" 2.5 "float roughness" 0
Shape "trianglemesh" "point3 P" [ -0.9 -0.6 0.01  0.9 -0.6 0.01  0.9 0.6 0.4  -0.9 0.6 0.4 ]
    "integer indices" [ 0 1 2 0 2 3 ]
Material "conductor" "rgb reflectance" [ 0.9 0.9 0.8 ]
Shape "trianglemesh" "point3 P" [ 0.2 0.9 0.5  1.2 0.6 0.5  1.2 0.6 1.5  0.2 0.9 1.5 ]
    "integer indices" [ 0 1 2 0 2 3 ]"#;

fn of(what: &str, glass: &str, depth: u32, strategies: &[Strategy], effort: Effort) {
    let scene = of_text(16, CAMERA, &format!("{ROOM}{glass}"));
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, depth);
    let Effort { work, limits } = effort;
    let mut all = runs::<4, _>(&world, work, limits, &[]);
    let grid = Grid::new(&world, 8);
    for strategy in strategies {
        let mut chains = work.chains(Separate);
        chains.options.shares = Shares::only(*strategy, 0.1);
        all.push(Judged {
            name: strategy.name().into(),
            run: estimate::mlt::<4, _>(&world, grid, chains, 23, REPEATS),
            limit: limits.mlt,
            indirect: limits.indirect,
        });
    }
    agree(what, &pairs(&all, limits));
}

/// A tenth of the steps has to find every other kind of path, so lengths are told apart less sharply than elsewhere.
const ALONE: Effort = Effort {
    work: QUICK.work,
    limits: Limits {
        pt: 0.12,
        mlt: 0.2,
        tile: 0.3,
        ..QUICK.limits
    },
};

/// LSSDE: lens, caustic and multi-chain perturbation.
#[test]
fn plate() {
    let strategies = [Strategy::Lens, Strategy::Caustic, Strategy::MultiChain];
    of("plate of glass", PLATE, 3, &strategies, ALONE);
}

/// LSSDE whose way depends on the wavelength: caustic perturbation, and the wavelength mutation that follows it again.
#[test]
fn wedge() {
    let strategies = [Strategy::Caustic, Strategy::Wavelength];
    of("wedge of flint glass", WEDGE, 3, &strategies, ALONE);
}

/// (L|D)DS*E: lens sub-path mutation.
#[test]
fn corner() {
    of("corner", CORNER, 3, &[Strategy::LensSubpath], ALONE);
}

/// Two-stage Metropolis, where the image is uneven: chains that sample τ/I0, direct light in them or not.
fn two_stage_of(work: Work, limits: Limits) {
    let scene = of_text(16, CAMERA, &format!("{ROOM}{CORNER}"));
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 3);
    let grid = Grid::new(&world, 8);
    let mut all = runs::<4, _>(&world, work, limits, &[]);
    for (direct, limit, longer) in [(Separate, limits.mlt, 1), (InChain, limits.in_chain, 6)] {
        let mut chains = work.chains(direct);
        chains.options.test_samples = Some(4);
        // In the chain, direct light takes most of the steps.
        chains.steps *= longer;
        all.push(Judged {
            name: format!("two-stage {direct:?}"),
            run: estimate::mlt::<4, _>(&world, grid, chains, 23, REPEATS),
            limit,
            indirect: limits.indirect,
        });
    }
    agree("two-stage", &pairs(&all, limits));
}

#[test]
fn two_stage() {
    two_stage_of(QUICK.work, QUICK.limits);
}

#[test]
#[ignore = "minutes; make test-long"]
fn two_stage_long() {
    two_stage_of(LONG.work, LONG.limits);
}

/// LSDSE, which no other perturbation suits.
#[test]
fn pool() {
    of("pool", POOL, 3, &[Strategy::MultiChain], ALONE);
}

/// For minutes.
const LONG_ALONE: Effort = Effort {
    work: Work {
        pt: 2048,
        bdpt: 512,
        seeds: 65_536,
        steps: 960_000,
    },
    limits: Limits {
        pt: 0.05,
        mlt: 0.15,
        indirect: 0.1,
        tile: 0.15,
        ..QUICK.limits
    },
};

/// Longer paths, in which a strategy that suits some waits for the bidirectional mutation to leave the others. Of those of
/// six edges, which such a chain meets seldom, only half would be missed for sure.
const LONGER_ALONE: Effort = Effort {
    limits: Limits {
        mlt: 0.5,
        ..LONG_ALONE.limits
    },
    ..LONG_ALONE
};

#[test]
#[ignore = "minutes; make test-long"]
fn plate_long() {
    let strategies = [Strategy::Lens, Strategy::Caustic, Strategy::MultiChain];
    of("plate of glass", PLATE, 3, &strategies, LONG_ALONE);
    of("plate of glass", PLATE, 5, &strategies, LONGER_ALONE);
}

#[test]
#[ignore = "minutes; make test-long"]
fn pool_long() {
    let strategies = [Strategy::Lens, Strategy::Caustic, Strategy::MultiChain];
    of("pool", POOL, 4, &strategies, LONG_ALONE);
    of("pool", POOL, 5, &strategies, LONGER_ALONE);
}

/// Here all lengths are met often.
#[test]
#[ignore = "minutes; make test-long"]
fn corner_long() {
    let strategies = [Strategy::Lens, Strategy::LensSubpath];
    of("corner", CORNER, 5, &strategies, LONG_ALONE);
}
