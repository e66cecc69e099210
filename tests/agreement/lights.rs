//! One scene for each kind of light: a coloured floor, a wall and a ball, paths of at most three edges.

use super::common::scene::{embree, of_text};
use super::common::stats::agree;
use super::{Effort, pairs, quick_and_long, runs};
use metrolux::chain::Direct::{self, InChain, Separate};
use metrolux::output::{Image, Layers, Metadata, write_exr};
use metrolux::path::World;

/// Looks down at the floor; above the wall there is sky.
const CAMERA: &str = "LookAt 0.3 -3 1.4  0 0.4 0.5  0 0 1\nCamera \"perspective\" \"float fov\" 50";

const OBJECTS: &str = r#"
Material "diffuse" "rgb reflectance" [ 0.7 0.5 0.3 ]
Shape "trianglemesh" "point3 P" [ -2 -2 0  2 -2 0  2 2 0  -2 2 0 ] "integer indices" [ 0 1 2 0 2 3 ]
Material "diffuse" "rgb reflectance" [ 0.3 0.6 0.8 ]
Shape "trianglemesh" "point3 P" [ -2 1.5 0  2 1.5 0  2 1.5 1  -2 1.5 1 ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeBegin
Translate 0.2 0.1 0.5
Material "diffuse" "rgb reflectance" [ 0.6 0.6 0.6 ]
Shape "sphere" "float radius" 0.5
AttributeEnd
"#;

fn lit_by(what: &str, light: &str, chains: &[Direct], effort: Effort) {
    let scene = of_text(16, CAMERA, &format!("{light}\n{OBJECTS}"));
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 2);
    let found = runs::<4, _>(&world, effort.work, effort.limits, chains);
    agree(what, &pairs(&found, effort.limits));
}

const DISTANT: &str =
    r#"LightSource "distant" "rgb L" [ 3 2.5 2 ] "point3 from" [ 1 -1.5 2 ] "point3 to" [ 0 0 0 ]"#;

const POINT: &str = r#"LightSource "point" "rgb I" [ 5 4 3 ] "point3 from" [ 0.8 -0.9 1.8 ]"#;

const SPOT: &str = r#"
LightSource "spot" "rgb I" [ 9 8 7 ] "point3 from" [ 0.8 -0.9 2 ] "point3 to" [ 0 0.4 0.4 ]
    "float coneangle" 40 "float conedeltaangle" 15"#;

const CONSTANT: &str = r#"LightSource "infinite" "rgb L" [ 0.7 0.8 1 ]"#;

/// All kinds at once: the choice among lights.
const MIXED: &str = r#"
LightSource "infinite" "rgb L" [ 0.2 0.3 0.4 ]
LightSource "point" "rgb I" [ 1 1 1 ] "point3 from" [ -1 -1 1.5 ]
LightSource "distant" "rgb L" [ 0.6 0.5 0.4 ] "point3 from" [ 1 -1.5 2 ] "point3 to" [ 0 0 0 ]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 4 2 1 ] "bool twosided" true
Translate -1 0.5 0.8
Rotate 70 1 0.5 0
Shape "disk" "float radius" 0.3
AttributeEnd
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 1 4 2 ]
Translate 1.2 0.6 0.7
Shape "sphere" "float radius" 0.15
AttributeEnd"#;

/// A bright patch on a gradient.
fn sky_of_an_image(effort: Effort) {
    let dir = tempfile::tempdir().expect("a folder");
    let file = dir.path().join("sky.exr");
    let n = 16;
    let rgb = (0..n * n)
        .map(|i| {
            let (x, y) = (i % n, i / n);
            let patch = (9..11).contains(&x) && (5..8).contains(&y);
            let sun = if patch { 20.0 } else { 0.0 };
            [
                0.2 + 0.05 * x as f32 + sun,
                0.4 + 0.8 * sun,
                0.9 - 0.04 * y as f32 + 0.5 * sun,
            ]
        })
        .collect();
    let image = Image {
        width: n,
        height: n,
        rgb,
    };
    write_exr(&file, &image, &Metadata::default(), Layers::default()).expect("written");
    let light = format!(
        "LightSource \"infinite\" \"string filename\" \"{}\"",
        file.display()
    );
    lit_by("image sky", &light, &[Separate], effort);
}

quick_and_long! {
    distant = |e| lit_by("distant light", DISTANT, &[Separate], e);
    point = |e| lit_by("point light", POINT, &[Separate], e);
    spot = |e| lit_by("spot light", SPOT, &[Separate], e);
    constant_sky = |e| lit_by("constant sky", CONSTANT, &[Separate], e);
    image_sky = sky_of_an_image;
    mixed = |e| lit_by("five kinds of light", MIXED, &[Separate, InChain], e);
}
