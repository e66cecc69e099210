//! `scenes/pool`: a pool under a lamp as large as a sun, seen through its waved surface.
//!
//! Metres, z up; the deck is z = 0.

use super::Output;
use super::mesh::Mesh;
use super::text::{Head, MIRROR, folder, plymesh, transform};
use super::trig::cos_sin_turns;
use glam::{DAffine3, DMat3, DVec2, DVec3};

/// Half the sides of the basin.
const HALF: [f64; 2] = [3.2, 2.2];
/// Depth of the bottom and of the water's mean level below the deck.
pub const DEPTH: f64 = 1.5;
const LEVEL: f64 = 0.18;
/// Centre of the sun's disk and its radius: 3.8 degrees from its middle to its rim, seen from the pool.
const SUN: [f64; 3] = [5.0, 6.5, 9.0];
const SUN_RADIUS: f64 = 0.8;
/// Side of a cell of the water's mesh is about this.
const CELL: f64 = 0.055;

/// Waves: direction in turns, length, height from mean to crest, phase in turns.
const WAVES: [(f64, f64, f64, f64); 7] = [
    (0.03, 1.90, 0.0320, 0.13),
    (0.17, 1.25, 0.0210, 0.71),
    (0.42, 0.97, 0.0160, 0.37),
    (0.29, 0.71, 0.0112, 0.92),
    (0.88, 0.58, 0.0088, 0.55),
    (0.61, 0.45, 0.0060, 0.08),
    (0.11, 0.37, 0.0044, 0.64),
];

/// Height above the mean level, and its slope.
pub fn wave(p: DVec2) -> (f64, DVec2) {
    let (mut height, mut slope) = (0.0, DVec2::ZERO);
    for (turns, length, crest, phase) in WAVES {
        let (c, s) = cos_sin_turns(turns);
        let along = DVec2::new(c, s);
        let (cos, sin) = cos_sin_turns(p.dot(along) / length + phase);
        height += crest * sin;
        slope += along * (crest * cos * std::f64::consts::TAU / length);
    }
    (height, slope)
}

/// The surface, a little larger than the basin so that its border is inside the walls.
fn water() -> Mesh {
    let margin = 0.01;
    let size = DVec2::from_array(HALF) + DVec2::splat(margin);
    let n = [0, 1].map(|i| (2.0 * size[i] / CELL).ceil() as u32);
    let mut m = Mesh::default();
    for j in 0..=n[1] {
        for i in 0..=n[0] {
            let at = DVec2::new(
                f64::from(i) / f64::from(n[0]),
                f64::from(j) / f64::from(n[1]),
            );
            let p = (at * 2.0 - DVec2::ONE) * size;
            let (height, slope) = wave(p);
            m.positions.push(p.extend(height - LEVEL));
            m.normals.push((-slope).extend(1.0).normalize());
        }
    }
    let row = n[0] + 1;
    for j in 0..n[1] {
        for i in 0..n[0] {
            let a = j * row + i;
            m.triangles.push([a, a + 1, a + row + 1]);
            m.triangles.push([a, a + row + 1, a + row]);
        }
    }
    m
}

/// Basin (seen from inside) and the deck around it.
fn stone() -> [Mesh; 2] {
    let [x, y] = HALF;
    let p = DVec3::new;
    let d = -DEPTH;
    let mut basin = Mesh::default();
    basin.quad([p(-x, -y, d), p(x, -y, d), p(x, y, d), p(-x, y, d)]);
    basin.quad([p(-x, y, d), p(x, y, d), p(x, y, 0.0), p(-x, y, 0.0)]);
    basin.quad([p(x, -y, d), p(-x, -y, d), p(-x, -y, 0.0), p(x, -y, 0.0)]);
    basin.quad([p(-x, -y, d), p(-x, y, d), p(-x, y, 0.0), p(-x, -y, 0.0)]);
    basin.quad([p(x, y, d), p(x, -y, d), p(x, -y, 0.0), p(x, y, 0.0)]);
    let (bx, by) = (6.0, 5.5);
    let mut deck = Mesh::default();
    deck.quad([
        p(-bx, y, 0.0),
        p(bx, y, 0.0),
        p(bx, by, 0.0),
        p(-bx, by, 0.0),
    ]);
    deck.quad([
        p(-bx, -by, 0.0),
        p(bx, -by, 0.0),
        p(bx, -y, 0.0),
        p(-bx, -y, 0.0),
    ]);
    deck.quad([
        p(-bx, -y, 0.0),
        p(-x, -y, 0.0),
        p(-x, y, 0.0),
        p(-bx, y, 0.0),
    ]);
    deck.quad([p(x, -y, 0.0), p(bx, -y, 0.0), p(bx, y, 0.0), p(x, y, 0.0)]);
    [basin, deck]
}

/// Three steps down into the water at the left.
fn steps() -> Mesh {
    let mut m = Mesh::default();
    for k in 0..3 {
        let (z, w) = (-0.35 - 0.38 * f64::from(k), 0.35 * f64::from(k + 1));
        m.block(
            [-HALF[0] - 0.02, 0.6, -DEPTH - 0.01],
            [-HALF[0] + w, 2.0, z],
        );
    }
    m
}

/// Names and meshes.
pub fn meshes() -> Vec<(&'static str, Mesh)> {
    let [basin, deck] = stone();
    vec![
        ("basin", basin),
        ("deck", deck),
        ("steps", steps()),
        ("water", water()),
    ]
}

fn scene() -> String {
    let head = Head {
        film: "pool",
        ..Head::default()
    };
    format!(
        r#"{head}{MIRROR}LookAt -0.8 -5.2 2.9   0 0.1 -0.7   0 0 1
Camera "perspective"
    "float fov" 38

WorldBegin

# the sun: a disk that looks at the pool, 3.8 degrees from middle to rim
AttributeBegin
    AreaLightSource "diffuse" "rgb L" [ 1 0.94 0.82 ] "float scale" 300
    Material "diffuse" "rgb reflectance" [ 0 0 0 ]
    {placement}
    Shape "disk" "float radius" {SUN_RADIUS}
AttributeEnd

Material "diffuse" "rgb reflectance" [ 0.62 0.78 0.82 ]
{}Material "diffuse" "rgb reflectance" [ 0.4 0.34 0.28 ]
{}Material "diffuse" "rgb reflectance" [ 0.75 0.75 0.72 ]
{}
# a ball that lies on the bottom, and one that floats
AttributeBegin
    Material "diffuse" "rgb reflectance" [ 0.7 0.1 0.06 ]
    Translate 1.1 0.3 -1.14
    Shape "sphere" "float radius" 0.35
AttributeEnd
AttributeBegin
    Material "diffuse" "rgb reflectance" [ 0.8 0.6 0.08 ]
    Translate -0.6 -0.9 -0.06
    Shape "sphere" "float radius" 0.22
AttributeEnd

Material "dielectric" "float eta" 1.33
{}"#,
        plymesh("basin"),
        plymesh("deck"),
        plymesh("steps"),
        plymesh("water"),
        placement = transform(&placement(DVec3::from_array(SUN))),
    )
}

/// A frame at `at` whose z axis points to the middle of the pool.
fn placement(at: DVec3) -> DAffine3 {
    let z = -at.normalize();
    let x = z.cross(DVec3::Z).normalize();
    let y = z.cross(x);
    DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), at)
}

/// The scene file and its meshes.
pub fn outputs() -> Vec<Output> {
    folder("pool", [("pool".into(), scene())], meshes())
}
