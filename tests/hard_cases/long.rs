//! Paths of 200 events: densities and weights of products of 200 factors.

use super::common::estimate::{self, Grid, Run};
use super::common::scene::{embree, of_text};
use super::common::stats::{Estimate, Pair, agree};
use super::{chains_on, small};
use metrolux::chain::{Direct, MltOptions};
use metrolux::path::{Heuristic, World};

const CAMERA: &str = "LookAt 0.3 -0.4 0.2  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 60";

/// Light of paths of `edges` edges against what the series says.
fn pair(name: &str, run: &Run, edges: std::ops::RangeInclusive<usize>, expected: f64) -> Pair {
    Pair {
        name: format!("{name}, {edges:?} edges"),
        found: run.length(edges),
        reference: Estimate::exact(expected),
        // A product of 200 factors that goes wrong, goes wrong by orders of magnitude.
        limit: 1.5,
    }
}

/// A closed sphere that reflects 0.99 and emits 0.01 everywhere: paths of k edges bring 0.01·0.99^(k−1), to k = 201, by
/// each of some 200 strategies that could have made them.
#[test]
fn a_nearly_white_room_follows_the_series() {
    let scene = of_text(
        2,
        CAMERA,
        r#"Material "diffuse" "spectrum reflectance" [ 360 0.99 830 0.99 ]
        AreaLightSource "diffuse" "rgb L" [ 0.01 0.01 0.01 ]
        ReverseOrientation
        Shape "sphere" "float radius" 2"#,
    );
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 200);
    let grid = Grid::new(&world, 2);
    let series = |a: usize, b: usize| 0.99f64.powi(a as i32 - 1) - 0.99f64.powi(b as i32);
    let runs = [
        ("pt", estimate::pt::<1, _>(&world, grid, 1, 16, 64)),
        (
            "bdpt",
            estimate::bdpt::<1, _>(&world, grid, Heuristic::Balance, 2, 16, 3),
        ),
        (
            "bdpt, power heuristic",
            estimate::bdpt::<1, _>(&world, grid, Heuristic::Power, 3, 16, 3),
        ),
    ];
    let mut pairs = Vec::new();
    for (name, run) in &runs {
        for (a, b) in [(1, 10), (11, 50), (51, 100), (101, 150), (151, 201)] {
            pairs.push(pair(name, run, a..=b, series(a, b)));
        }
    }
    agree("nearly white room", &pairs);
    // The chain's lengths wander too slowly to be judged here; it must meet no fault, and its b must not either.
    let options = MltOptions {
        chains: 2,
        seeds: 4,
        ..small(Direct::InChain)
    };
    let r = chains_on(&world, &options, 500.0);
    assert!(r.b.0.is_finite() && r.b.0 > 0.0, "{:?}", r.b);
}

/// A cube of mirrors around a lamp and a diffuse ball: paths of up to 201 edges, nearly all of their vertices specular.
#[test]
fn a_hall_of_mirrors_agrees_with_path_tracing() {
    let scene = of_text(
        2,
        CAMERA,
        r#"AttributeBegin Translate 0.2 0.9 0.3 AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
        Shape "sphere" "float radius" 0.3 AttributeEnd
        AttributeBegin Translate -0.7 0.5 -0.4 Material "diffuse" "rgb reflectance" [ 0.8 0.8 0.8 ]
        Shape "sphere" "float radius" 0.2 AttributeEnd
        Material "conductor" "rgb reflectance" [ 1 1 1 ]
        Shape "trianglemesh" "point3 P" [ -1 -1.5 -1  1 -1.5 -1  1 1.5 -1  -1 1.5 -1  -1 -1.5 1  1 -1.5 1  1 1.5 1  -1 1.5 1 ]
            "integer indices" [ 0 2 1 0 3 2  4 5 6 4 6 7  0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7 ]"#,
    );
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 200);
    let grid = Grid::new(&world, 2);
    let pt = estimate::pt::<1, _>(&world, grid, 1, 16, 512);
    let bdpt = estimate::bdpt::<1, _>(&world, grid, Heuristic::Balance, 2, 16, 128);
    let mut pairs = Vec::new();
    for edges in [1..=5, 6..=20, 21..=60, 61..=201] {
        pairs.push(Pair {
            name: format!("{edges:?} edges"),
            found: bdpt.length(edges.clone()),
            reference: pt.length(edges),
            limit: 0.5,
        });
    }
    agree("hall of mirrors", &pairs);
    let options = MltOptions {
        seeds: 64,
        ..small(Direct::InChain)
    };
    chains_on(&world, &options, 2000.0);
}
