//! `scenes/cornell` and `scenes/cornell-glass`: the Cornell box from its published measurements.
//!
//! Millimetres, y up, as on the page of the Cornell Program of Computer Graphics.

use super::Output;
use super::text::Head;

type Quad = [[f64; 3]; 4];

const FLOOR: Quad = [
    [552.8, 0.0, 0.0],
    [0.0, 0.0, 0.0],
    [0.0, 0.0, 559.2],
    [549.6, 0.0, 559.2],
];
const CEILING: Quad = [
    [556.0, 548.8, 0.0],
    [556.0, 548.8, 559.2],
    [0.0, 548.8, 559.2],
    [0.0, 548.8, 0.0],
];
const BACK: Quad = [
    [549.6, 0.0, 559.2],
    [0.0, 0.0, 559.2],
    [0.0, 548.8, 559.2],
    [556.0, 548.8, 559.2],
];
const RIGHT: Quad = [
    [0.0, 0.0, 559.2],
    [0.0, 0.0, 0.0],
    [0.0, 548.8, 0.0],
    [0.0, 548.8, 559.2],
];
const LEFT: Quad = [
    [552.8, 0.0, 0.0],
    [549.6, 0.0, 559.2],
    [556.0, 548.8, 559.2],
    [556.0, 548.8, 0.0],
];

/// Foot corners (x, z) and height of the two blocks.
const SHORT: ([[f64; 2]; 4], f64) = (
    [[130.0, 65.0], [82.0, 225.0], [240.0, 272.0], [290.0, 114.0]],
    165.0,
);
const TALL: ([[f64; 2]; 4], f64) = (
    [
        [423.0, 247.0],
        [265.0, 296.0],
        [314.0, 456.0],
        [472.0, 406.0],
    ],
    330.0,
);

/// The mirror of `cornell-glass`: turned so that its two visible sides show the coloured walls.
const MIRROR: ([[f64; 2]; 4], f64) = (
    [
        [368.0, 241.0],
        [258.0, 351.0],
        [368.0, 461.0],
        [478.0, 351.0],
    ],
    330.0,
);

/// Top and four sides, counter-clockwise seen from outside. The foot stands on the floor and is left open.
fn block((foot, height): &([[f64; 2]; 4], f64)) -> Vec<Quad> {
    let p = |k: usize, y: f64| [foot[k % 4][0], y, foot[k % 4][1]];
    let mut faces = vec![[0, 1, 2, 3].map(|k| p(k, *height))];
    for k in 0..4 {
        faces.push([p(k, 0.0), p(k + 1, 0.0), p(k + 1, *height), p(k, *height)]);
    }
    faces
}

/// The lamp 0.1 mm under the ceiling, so that the two do not coincide; it looks down.
fn lamp(x0: f64, x1: f64, z0: f64, z1: f64) -> Quad {
    let y = 548.7;
    [[x0, y, z0], [x1, y, z0], [x1, y, z1], [x0, y, z1]]
}

fn shape(quads: &[Quad]) -> String {
    let mut points = String::new();
    let mut indices = String::new();
    for (i, quad) in quads.iter().enumerate() {
        for [x, y, z] in quad {
            points += &format!(" {x} {y} {z}");
        }
        let b = 4 * i;
        indices += &format!(" {} {} {} {} {} {}", b, b + 1, b + 2, b, b + 2, b + 3);
    }
    format!(
        "Shape \"trianglemesh\"\n    \"point3 P\" [{points} ]\n    \"integer indices\" [{indices} ]\n"
    )
}

fn diffuse(name: &str, rgb: &str, quads: &[Quad]) -> String {
    format!(
        "# {name}\nMaterial \"diffuse\" \"rgb reflectance\" [ {rgb} ]\n{}\n",
        shape(quads)
    )
}

fn head(film: &str, depth: u32) -> String {
    let head = Head {
        film,
        depth,
        mutations: 100,
        ..Head::default()
    };
    format!(
        r#"{head}# The box is measured in a right-handed frame.
Scale -1 1 1
LookAt 278 273 -800   278 273 0   0 1 0
# A lens of 35 mm before a square of 25 mm: 2 atan(12.5 / 35).
Camera "perspective"
    "float fov" 39.307648

WorldBegin

"#
    )
}

const WHITE: &str = "0.725 0.71 0.68";

fn walls() -> String {
    diffuse("floor, ceiling, back", WHITE, &[FLOOR, CEILING, BACK])
        + &diffuse("right wall, green", "0.14 0.45 0.091", &[RIGHT])
        + &diffuse("left wall, red", "0.63 0.065 0.05", &[LEFT])
}

fn emitter(radiance: &str, quad: Quad) -> String {
    format!(
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ {radiance} ]\n{}AttributeEnd\n",
        diffuse("lamp", "0.78 0.78 0.78", &[quad])
    )
}

/// Both scene files.
pub fn outputs() -> Vec<Output> {
    let classic = head("cornell", 8)
        + &walls()
        + &diffuse("short block", WHITE, &block(&SHORT))
        + &diffuse("tall block", WHITE, &block(&TALL))
        + &emitter("17 12 4", lamp(213.0, 343.0, 227.0, 332.0));
    let glass = head("cornell-glass", 12)
        + &walls()
        + "# glass sphere, a millimetre above the floor\nAttributeBegin\nTranslate 170 96 150\n\
           Material \"dielectric\" \"float eta\" 1.5\nShape \"sphere\" \"float radius\" 95\nAttributeEnd\n\n\
           # block, a silver mirror\nMaterial \"conductor\" \"spectrum eta\" \"metal-Ag-eta\" \
           \"spectrum k\" \"metal-Ag-k\"\n"
        + &shape(&block(&MIRROR))
        + "\n"
        + &emitter("60 48 30", lamp(248.0, 308.0, 250.0, 310.0));
    vec![
        Output::text("cornell/cornell.pbrt", classic),
        Output::text("cornell-glass/cornell-glass.pbrt", glass),
    ]
}
