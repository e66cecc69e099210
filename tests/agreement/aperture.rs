//! A small closed room seen through a lens so wide that light sub-paths end on it often: the strategy t = 0, by itself
//! and among the others.

use super::common::estimate::{self, Grid};
use super::common::scene::{embree, of_text};
use super::common::stats::{Estimate, Pair, agree};
use super::{Effort, Work, pairs, quick_and_long, runs};
use metrolux::chain::Direct::{InChain, Separate};
use metrolux::path::{Heuristic, World};
use metrolux::scene::Scene;

/// An aperture half as wide as the room, before one of its walls.
fn room() -> Scene {
    of_text(
        16,
        "LookAt 0 -0.9 0  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 80 \"float lensradius\" 0.5 \"float focaldistance\" 1.4",
        r#"
        Material "diffuse" "rgb reflectance" [ 0.7 0.6 0.5 ]
        Shape "trianglemesh"
            "point3 P" [ -1 -1 -1  1 -1 -1  1 1 -1  -1 1 -1  -1 -1 1  1 -1 1  1 1 1  -1 1 1 ]
            "integer indices" [ 0 1 2 0 2 3  4 5 6 4 6 7  0 1 5 0 5 4  2 3 7 2 7 6  1 2 6 1 6 5  3 0 4 3 4 7 ]
        Material "conductor" "float roughness" 0.4
        AttributeBegin
        Translate 0.4 0.4 -0.5
        Shape "sphere" "float radius" 0.35
        AttributeEnd
        Material "diffuse"
        AreaLightSource "diffuse" "rgb L" [ 5 4 3 ]
        Shape "trianglemesh" "point3 P" [ -0.6 -0.2 0.9  -0.6 0.4 0.9  0.1 0.4 0.9  0.1 -0.2 0.9 ] "integer indices" [ 0 1 2 0 2 3 ]
        "#,
    )
}

/// Light sub-paths that end on the lens make the whole image by themselves, in every path length.
fn alone(effort: Effort) {
    let scene = room();
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 3);
    let grid = Grid::new(&world, 8);
    let (pt, light) = (effort.work.pt, effort.work.bdpt * 6);
    let reference = estimate::pt::<4, _>(&world, grid, 31, 32, pt);
    let alone = estimate::light_alone::<4, _>(&world, grid, 32, 32, light);
    let mut all = Vec::new();
    let mut push = |name: String, found: Estimate, reference: Estimate, limit: f64| {
        all.push(Pair {
            name,
            found,
            reference,
            limit,
        });
    };
    for k in 1..=reference.edges() {
        let (a, b) = (alone.length(k..=k), reference.length(k..=k));
        push(format!("{k} edges"), a, b, 0.6 * effort.limits.pt);
    }
    for t in 0..reference.tiles() {
        let (a, b) = (alone.tile(t), reference.tile(t));
        push(format!("tile {t}"), a, b, effort.limits.tile);
    }
    agree("t = 0 alone", &all);
}

fn together(effort: Effort) {
    let scene = room();
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 3);
    // In the chain, the lamp's own image takes most of the steps.
    let work = Work {
        steps: effort.work.steps * 5 / 2,
        ..effort.work
    };
    let found = runs::<4, _>(&world, work, effort.limits, &[Separate, InChain]);
    agree("wide lens", &pairs(&found, effort.limits));
}

quick_and_long! {
    light_alone_makes_the_image = alone;
    wide_lens = together;
}

/// A bulb is not seen itself, and so not in a mirror either, though t = 0 could find its blurred image there.
#[test]
fn a_point_light_in_a_mirror_is_not_seen() {
    let scene = of_text(
        16,
        "LookAt 0 -1 1  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 60 \"float lensradius\" 0.5 \"float focaldistance\" 1.4",
        r#"
        LightSource "point" "point3 from" [ 0 1 1 ]
        Material "conductor" "float roughness" 0
        Shape "trianglemesh" "point3 P" [ -1 -1 0  1 -1 0  1 1 0  -1 1 0 ] "integer indices" [ 0 1 2 0 2 3 ]
        "#,
    );
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 3);
    let grid = Grid::new(&world, 8);
    let bdpt = estimate::bdpt::<4, _>(&world, grid, Heuristic::Balance, 33, 2, 16);
    assert_eq!(bdpt.length(1..=bdpt.edges()).mean, 0.0);
}
