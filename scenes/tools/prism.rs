//! `scenes/prism`: a beam through a slit skims a table, and a prism of flint glass fans it out into its colours.
//!
//! Metres, z up; the table is z = 0, the prism's axis stands on the origin.

use super::Output;
use super::mesh::Mesh;
use super::text::{Head, MIRROR, folder, plymesh};
use super::trig::cos_sin_turns;
use glam::{DAffine3, DMat3, DVec3};

/// Half the deviation of green light at its least, in turns: 33.5 degrees in glass of index 1.79 at an edge of 60.
const HALF_DEVIATION: f64 = 33.5 / 360.0;
/// Side of the prism's triangle, and its height.
const SIDE: f64 = 0.12;
const HEIGHT: f64 = 0.08;
/// The prism hangs a millimetre above the table, so that nothing touches.
const GAP: f64 = 0.001;
/// From where the beam enters the prism: back to the slit, to the lamp behind it; on from where it leaves: to the screen.
const TO_SLIT: f64 = 0.3;
const TO_LAMP: f64 = 0.55;
const TO_SCREEN: f64 = 0.75;
/// Half the width of the lamp and of the slit.
const HALF_SLIT: f64 = 0.0015;

/// The equilateral prism, its edge of 60 degrees towards −y.
pub fn prism() -> Mesh {
    let tip = SIDE / 3f64.sqrt();
    let corners = [
        [0.0, -tip],
        [SIDE / 2.0, tip / 2.0],
        [-SIDE / 2.0, tip / 2.0],
    ];
    let at = |i: usize, z: f64| DVec3::new(corners[i % 3][0], corners[i % 3][1], z);
    let (lo, hi) = (GAP, GAP + HEIGHT);
    let mut m = Mesh::default();
    for i in 0..3 {
        m.quad([at(i, lo), at(i + 1, lo), at(i + 1, hi), at(i, hi)]);
    }
    let base = m.positions.len() as u32;
    m.positions.extend([0, 1, 2].map(|i| at(i, lo)));
    m.positions.extend([0, 1, 2].map(|i| at(i, hi)));
    m.triangles.push([base, base + 2, base + 1]);
    m.triangles.push([base + 3, base + 4, base + 5]);
    m
}

/// A frame whose x axis turns by `turns` from the world's, at the middle of the prism's side at `x`.
fn along(turns: f64, x: f64) -> DAffine3 {
    let (c, s) = cos_sin_turns(turns);
    let z = DMat3::from_cols(DVec3::new(c, s, 0.0), DVec3::new(-s, c, 0.0), DVec3::Z);
    // A side's middle is half way from the base to the edge.
    let y = -SIDE / 3f64.sqrt() / 4.0;
    DAffine3::from_mat3_translation(z, DVec3::new(x, y, 0.0))
}

/// The beam's way in.
fn inward() -> DAffine3 {
    along(-HALF_DEVIATION, -SIDE / 4.0)
}

/// The green beam's way out.
fn outward() -> DAffine3 {
    along(HALF_DEVIATION, SIDE / 4.0)
}

/// A closed case around the lamp, but for the slit.
fn case() -> Mesh {
    let (back, front) = (-TO_LAMP - 0.03, -TO_SLIT);
    let (wide, high, thick, lip) = (0.045, 0.11, 0.005, 0.04);
    let mut m = Mesh::default();
    m.block([back - thick, -wide, GAP], [back, wide, high]);
    m.block([back, -wide, GAP], [front - thick, thick - wide, high]);
    m.block([back, wide - thick, GAP], [front - thick, wide, high]);
    m.block(
        [back, thick - wide, high - thick],
        [front - thick, wide - thick, high],
    );
    m.block([front - thick, -wide, GAP], [front, -HALF_SLIT, lip]);
    m.block([front - thick, HALF_SLIT, GAP], [front, wide, lip]);
    m.block([front - thick, -wide, lip], [front, wide, high]);
    m.moved(&inward())
}

/// The lamp: a strip that looks at the slit.
fn lamp() -> Mesh {
    let p = |y: f64, z: f64| DVec3::new(-TO_LAMP, y, z);
    let (w, lo, hi) = (HALF_SLIT, 0.006, 0.056);
    let mut m = Mesh::default();
    m.quad([p(-w, lo), p(w, lo), p(w, hi), p(-w, hi)]);
    m.moved(&inward())
}

/// The screen that catches the colours.
fn screen() -> Mesh {
    let mut m = Mesh::default();
    m.block([TO_SCREEN, -0.2, GAP], [TO_SCREEN + 0.01, 0.2, 0.2]);
    m.moved(&outward())
}

/// The table, and a wall behind it.
fn table() -> Mesh {
    let p = DVec3::new;
    let mut m = Mesh::default();
    m.quad([
        p(-1.6, -1.0, 0.0),
        p(1.6, -1.0, 0.0),
        p(1.6, 1.4, 0.0),
        p(-1.6, 1.4, 0.0),
    ]);
    m.quad([
        p(-1.6, 1.4, 0.0),
        p(1.6, 1.4, 0.0),
        p(1.6, 1.4, 1.2),
        p(-1.6, 1.4, 1.2),
    ]);
    m
}

/// Names and meshes.
pub fn meshes() -> Vec<(&'static str, Mesh)> {
    vec![
        ("case", case()),
        ("lamp", lamp()),
        ("prism", prism()),
        ("screen", screen()),
        ("table", table()),
    ]
}

fn scene() -> String {
    let head = Head {
        film: "prism",
        resolution: [320, 240],
        ..Head::default()
    };
    format!(
        r#"{head}{MIRROR}LookAt 0.15 -1.05 0.72   0.15 0.17 0.0   0 0 1
Camera "perspective"
    "float fov" 35

WorldBegin

# a weak lamp far above, so that things are seen
AttributeBegin
    AreaLightSource "diffuse" "spectrum L" "stdillum-D65" "float scale" 2.5
    Material "diffuse" "rgb reflectance" [ 0 0 0 ]
    Translate 0 0.2 2
    Rotate 180 1 0 0
    Shape "disk" "float radius" 0.4
AttributeEnd

# the lamp behind the slit
AttributeBegin
    AreaLightSource "diffuse" "spectrum L" "stdillum-D65" "float scale" 60000
    Material "diffuse" "rgb reflectance" [ 0 0 0 ]
    {}AttributeEnd

Material "diffuse" "rgb reflectance" [ 0.03 0.03 0.03 ]
{}Material "diffuse" "rgb reflectance" [ 0.6 0.6 0.6 ]
{}Material "diffuse" "rgb reflectance" [ 0.85 0.85 0.85 ]
{}
Material "dielectric" "spectrum eta" "glass-F11"
{}"#,
        plymesh("lamp"),
        plymesh("case"),
        plymesh("table"),
        plymesh("screen"),
        plymesh("prism"),
    )
}

/// The scene file and its meshes.
pub fn outputs() -> Vec<Output> {
    folder("prism", [("prism".into(), scene())], meshes())
}
