//! Objects that stand in several places give the light of as many copies.

use super::common::scene::{embree, of_text};
use super::common::stats::agree;
use super::materials::{CAMERA, ROOM};
use super::{Effort, Judged, Limits, Work, pairs, quick_and_long, runs};
use metrolux::accel::Obvhs;
use metrolux::chain::Direct::Separate;
use metrolux::path::World;
use metrolux::scene::Scene;
use metrolux::scene::flatten::flatten;

/// Eight toys, of faces with normals, metal and glass, turned, mirrored and scaled, but not stretched,
/// since what is a sphere in a toy and is stretched has facets in a copy (as has, in its own plane, a mirrored disk).
fn crowd() -> Scene {
    let mut world = format!(
        r#"{ROOM}
        ObjectBegin "toy"
        Material "diffuse" "rgb reflectance" [ 0.3 0.6 0.5 ]
        Shape "trianglemesh" "point3 P" [ 0.2 0 0  -0.2 0 0  0 0.2 0  0 -0.2 0  0 0 0.2  0 0 -0.2 ]
            "normal N" [ 1 0.1 0  -1 0 0.1  0 1 0.1  0.1 -1 0  0 0.1 1  0.1 0 -1 ]
            "integer indices" [ 0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5 ]
        Material "conductor" "float uroughness" 0.1 "float vroughness" 0.4
        Shape "disk" "float radius" 0.3
        Material "dielectric" "float eta" 1.5 "float roughness" 0.2
        Translate 0.3 0 0.1
        Shape "sphere" "float radius" 0.12
        ObjectEnd
        "#
    );
    for i in 0..8 {
        let scale = ["1 1 1", "-1 1 1", "0.5 0.5 0.5", "-2 2 2"][i % 4];
        let size = if i % 4 == 3 { "Scale 0.4 0.4 0.4" } else { "" };
        world += &format!(
            "AttributeBegin Translate {} {} 0.35 Rotate {} 1 2 3 Scale {scale} {size} ObjectInstance \"toy\" AttributeEnd\n",
            0.6 * (i % 4) as f64 - 0.9,
            0.8 * (i / 4) as f64 - 0.5,
            50 * i,
        );
    }
    of_text(16, CAMERA, &world)
}

/// Direct light and that of one more bounce in the crowd and in the copies, by every integrator and both backends.
fn crowd_and_copies(effort: Effort) {
    let scene = crowd();
    assert_eq!(scene.geometry.instances.len(), 8);
    let mut copies = scene.clone();
    flatten(&mut copies, |_| true);
    let flat = embree(&copies);
    let (a, b) = (embree(&scene), Obvhs::new(&scene.geometry));
    // Each bounce alone is a twentieth of the light; what they are together is looked at closely.
    let limits = Limits {
        least: 0.1,
        ..effort.limits
    };
    let alone = Work {
        pt: 0,
        ..effort.work
    };
    let reference = World::new(&copies, &flat, 3);
    let mut all = runs::<4, _>(&reference, alone, limits, &[]);
    let mut add = |who: &str, more: Vec<Judged>| {
        all.extend(more.into_iter().map(|j| Judged {
            name: format!("{} on {who}", j.name),
            ..j
        }));
    };
    let (x, y) = (World::new(&scene, &a, 3), World::new(&scene, &b, 3));
    add("Embree", runs::<4, _>(&x, effort.work, limits, &[Separate]));
    add("obvhs", runs::<4, _>(&y, effort.work, limits, &[Separate]));
    agree("crowd", &pairs(&all, limits));
}

quick_and_long! {
    a_crowd_gives_the_light_of_its_copies = crowd_and_copies;
}
