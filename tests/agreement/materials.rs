//! One scene for each lobe: an object over a diffuse floor under a large lamp.

use super::common::scene::{embree, of_text};
use super::common::stats::agree;
use super::{Effort, Limits, Work, pairs, quick_and_long, runs};
use metrolux::chain::Direct::{self, InChain, Separate};
use metrolux::path::World;

pub const CAMERA: &str =
    "LookAt 0.4 -2.6 1.5  0 0 0.4  0 0 1\nCamera \"perspective\" \"float fov\" 38";

pub const ROOM: &str = r#"
Material "diffuse" "rgb reflectance" [ 0.7 0.6 0.4 ]
Shape "trianglemesh" "point3 P" [ -2 -2 0  2 -2 0  2 2 0  -2 2 0 ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 5 4 3 ]
Shape "trianglemesh" "point3 P" [ -1 -1 2.2  -1 1 2.2  1 1 2.2  1 -1 2.2 ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeEnd
"#;

/// A ball of the material.
const BALL: &str = "Translate 0 0 0.5\nShape \"sphere\" \"float radius\" 0.45";

/// An octahedron whose normals are those of a ball, and a little askew.
const MESH: &str = r#"
Translate 0 0 0.6
Rotate 25 1 2 3
Shape "trianglemesh"
    "point3 P" [ 0.55 0 0  -0.55 0 0  0 0.55 0  0 -0.55 0  0 0 0.55  0 0 -0.55 ]
    "normal N" [ 1 0.1 0  -1 0 0.1  0 1 0.1  0.1 -1 0  0 0.1 1  0.1 0 -1 ]
    "integer indices" [ 0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5 ]
"#;

fn of(what: &str, material: &str, shape: &str, effort: Effort) {
    seen_by(CAMERA, what, material, shape, &[Separate], effort);
}

fn seen_by(
    camera: &str,
    what: &str,
    material: &str,
    shape: &str,
    chains: &[Direct],
    effort: Effort,
) {
    let object = format!("AttributeBegin\nMaterial {material}\n{shape}\nAttributeEnd");
    let scene = of_text(16, camera, &format!("{ROOM}\n{object}"));
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 3);
    let found = runs::<4, _>(&world, effort.work, effort.limits, chains);
    agree(what, &pairs(&found, effort.limits));
}

const ROUGH_GLASS: &str =
    r#""dielectric" "float eta" 1.5 "float roughness" 0.3 "bool remaproughness" false"#;

const GLASS: &str = r#""dielectric" "float eta" 1.5"#;

const PANE: &str = r#""thindielectric" "float eta" 1.5"#;

const COATED: &str = r#""coateddiffuse" "rgb reflectance" [ 0.3 0.5 0.8 ]
    "float roughness" 0.2 "bool remaproughness" false"#;

const BRUSHED: &str =
    r#""conductor" "float uroughness" 0.15 "float vroughness" 0.5 "bool remaproughness" false"#;

const PAINT: &str = r#""diffuse" "rgb reflectance" [ 0.4 0.7 0.6 ]"#;

/// The ball stands before the plane in focus, the floor runs through it.
const THIN_LENS: &str = r#"LookAt 0.4 -2.6 1.5  0 0 0.4  0 0 1
Camera "perspective" "float fov" 38 "float lensradius" 0.2 "float focaldistance" 3.5"#;

quick_and_long! {
    rough_dielectric = |e| of("rough dielectric", ROUGH_GLASS, BALL, e);
    thin_dielectric = |e| of("thin dielectric", PANE, BALL, e);
    coated_diffuse = |e| of("coated diffuse", COATED, BALL, e);
    anisotropic_conductor = |e| of("anisotropic conductor", BRUSHED, BALL, e);
    interpolated_normals = |e| of("diffuse, interpolated normals", PAINT, MESH, e);
    interpolated_normals_of_glass = |e| of("rough glass, interpolated normals", ROUGH_GLASS, MESH, e);
    thin_lens = |e| seen_by(THIN_LENS, "thin lens", PAINT, BALL, &[Separate, InChain], e);
}

/// A glass ball whose caustic all three find: 2 % in every length with 5 % of the light, 10 % in every tile.
#[test]
fn smooth_dielectric() {
    let effort = Effort {
        work: Work {
            pt: 512,
            bdpt: 256,
            seeds: 65_536,
            steps: 240_000,
        },
        limits: Limits {
            least: 0.05,
            pt: 0.02,
            mlt: 0.02,
            in_chain: 0.1,
            indirect: 0.02,
            tile: 0.1,
        },
    };
    of("smooth dielectric", GLASS, BALL, effort);
}
