//! `scenes/ajar`: two rooms and a door that is a little open.
//!
//! Metres, z up. The near room is x −2.4…2.7, y −4.8…0; the camera looks along +y at the dividing wall.

use super::Output;
use super::door;
use super::furniture::{self, TABLE_HEIGHT};
use super::mesh::Mesh;
use super::shell::{Planes, carve};
use super::teapot;
use super::text::{Head, MIRROR, folder, plymesh, transform};
use super::trig::cos_sin_turns;
use glam::{DAffine3, DMat3, DVec3};

const NEAR: [f64; 4] = [-2.4, 2.7, -4.8, 0.0];
const FAR: [f64; 4] = [-0.6, 5.7, 0.15, 7.35];
const CEILING: f64 = 2.7;
const TILE: f64 = 0.3;
/// The emitting rectangle: left, right, near and far edge. All of it lies to the right of the doorway, so no straight line leads from
/// it through the slit.
pub const LAMP: [f64; 4] = [2.4, 5.2, 3.9, 6.9];
const LAMP_HEIGHT: f64 = 2.66;
/// Width of a teapot's unit; the data is 6.4 units long.
const TEAPOT_UNIT: f64 = 0.084;
/// Emitted radiance.
const LAMP_RADIANCE: [f64; 3] = [1.0, 0.93, 0.82];
const LAMP_SCALE: f64 = 2400.0;

/// Teapots: name, position of the axis, rotation in turns.
const TEAPOTS: [(&str, [f64; 2], f64); 3] = [
    ("pot-metal", [-1.24, -0.5], 0.03),
    ("pot-diffuse", [-0.61, -0.46], -0.05),
    ("pot-glass", [0.03, -0.52], 0.07),
];

fn within(r: &[f64; 4], p: DVec3) -> bool {
    p.x > r[0] && p.x < r[1] && p.y > r[2] && p.y < r[3]
}

/// Names of the meshes of the shell, in the order `sort` uses.
const SHELL: [&str; 5] = [
    "walls-near",
    "tiles-white",
    "tiles-dark",
    "walls-far",
    "floor-far",
];

fn shell() -> Vec<Mesh> {
    let tiles = |from: f64, n: i32| (0..=n).map(move |i| from + TILE * f64::from(i));
    let mut xs: Vec<f64> = tiles(NEAR[0], 17).collect();
    xs.extend([NEAR[0] - 0.15, FAR[1], FAR[1] + 0.15]);
    let mut ys: Vec<f64> = tiles(NEAR[2], 16).collect();
    ys.extend([NEAR[2] - 0.15, FAR[2], FAR[3], FAR[3] + 0.15]);
    for planes in [&mut xs, &mut ys] {
        // The nearest double of the decimal, so that neighbours written elsewhere are equal.
        planes
            .iter_mut()
            .for_each(|c| *c = (*c * 1000.0).round() / 1000.0);
        planes.sort_by(f64::total_cmp);
    }
    let zs = vec![-0.15, 0.0, door::HEIGHT, CEILING, CEILING + 0.15];
    let doorway = [door::LEFT, door::RIGHT, NEAR[3], FAR[2]];
    let empty = |c: DVec3| {
        let room = within(&NEAR, c) || within(&FAR, c);
        let door = within(&doorway, c) && c.z < door::HEIGHT;
        c.z > 0.0 && c.z < CEILING && (room || door)
    };
    let sort = |c: DVec3, n: DVec3| {
        let floor = n.z > 0.0 && c.z < 0.5;
        match (c.y > FAR[2] - 0.02, floor) {
            (true, true) => 4,
            (true, false) => 3,
            (false, false) => 0,
            (false, true) if c.y > NEAR[3] => 1,
            (false, true) => {
                let i = ((c.x - NEAR[0]) / TILE).floor() + ((c.y - NEAR[2]) / TILE).floor();
                1 + (i.rem_euclid(2.0) as usize)
            }
        }
    };
    carve(&Planes([xs, ys, zs]), empty, sort, SHELL.len())
}

/// The emitting face, looking down.
fn lamp() -> Mesh {
    let [x0, x1, y0, y1] = LAMP;
    let p = |x, y| DVec3::new(x, y, LAMP_HEIGHT);
    let mut m = Mesh::default();
    m.quad([p(x0, y0), p(x0, y1), p(x1, y1), p(x1, y0)]);
    m
}

/// The lamp's sides, up into the ceiling.
fn lamp_box() -> Mesh {
    let [x0, x1, y0, y1] = LAMP;
    let foot = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)];
    let mut m = Mesh::default();
    for k in 0..4 {
        let (a, b) = (foot[k], foot[(k + 1) % 4]);
        let p = |c: (f64, f64), z| DVec3::new(c.0, c.1, z);
        let top = CEILING + 0.01;
        m.quad([p(a, LAMP_HEIGHT), p(b, LAMP_HEIGHT), p(b, top), p(a, top)]);
    }
    m
}

/// One mesh a material.
pub fn meshes() -> Vec<(&'static str, Mesh)> {
    let mut all: Vec<(&str, Mesh)> = SHELL.into_iter().zip(shell()).collect();
    all.push(("lamp", lamp()));
    all.push(("lamp-box", lamp_box()));
    all.push(("door", door::leaf()));
    all.push(("frame", door::frame(NEAR[0], NEAR[1])));
    all.push(("fittings", door::fittings()));
    all.push(("table", furniture::table()));
    all.push(("picture-frame", furniture::picture_frame()));
    let names = [
        "picture-ground",
        "picture-red",
        "picture-blue",
        "picture-ochre",
    ];
    all.extend(names.into_iter().zip(furniture::picture()));
    all.push(("teapot", teapot::teapot()));
    all
}

/// Where a teapot stands: a fifth of a millimetre above the table.
fn teapot_placement(at: [f64; 2], turns: f64) -> DAffine3 {
    let (c, s) = cos_sin_turns(turns);
    let rotate = DMat3::from_cols(DVec3::new(c, s, 0.0), DVec3::new(-s, c, 0.0), DVec3::Z);
    DAffine3::from_mat3_translation(
        rotate * TEAPOT_UNIT,
        DVec3::new(at[0], at[1], TABLE_HEIGHT + 0.0002),
    )
}

const MATERIALS: &str = r#"# Walls have no texture, so that noise shows.
MakeNamedMaterial "walls-near" "string type" "diffuse" "rgb reflectance" [ 0.82 0.81 0.79 ]
MakeNamedMaterial "walls-far" "string type" "diffuse" "rgb reflectance" [ 0.78 0.78 0.775 ]
MakeNamedMaterial "floor-far" "string type" "diffuse" "rgb reflectance" [ 0.5 0.48 0.45 ]
MakeNamedMaterial "tiles-white" "string type" "coateddiffuse" "rgb reflectance" [ 0.85 0.84 0.81 ]
    "float roughness" 0.12 "bool remaproughness" false
MakeNamedMaterial "tiles-dark" "string type" "coateddiffuse" "rgb reflectance" [ 0.1 0.11 0.12 ]
    "float roughness" 0.12 "bool remaproughness" false
MakeNamedMaterial "lamp-box" "string type" "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
MakeNamedMaterial "door" "string type" "diffuse" "rgb reflectance" [ 0.5 0.24 0.11 ]
MakeNamedMaterial "frame" "string type" "diffuse" "rgb reflectance" [ 0.66 0.6 0.48 ]
MakeNamedMaterial "fittings" "string type" "conductor" "spectrum eta" "metal-CuZn-eta" "spectrum k" "metal-CuZn-k"
    "float roughness" 0.2 "bool remaproughness" false
MakeNamedMaterial "table" "string type" "coateddiffuse" "rgb reflectance" [ 0.56 0.38 0.2 ]
    "float roughness" 0.25 "bool remaproughness" false
MakeNamedMaterial "picture-frame" "string type" "coateddiffuse" "rgb reflectance" [ 0.05 0.04 0.035 ]
    "float roughness" 0.2 "bool remaproughness" false
MakeNamedMaterial "picture-ground" "string type" "diffuse" "rgb reflectance" [ 0.72 0.68 0.58 ]
MakeNamedMaterial "picture-red" "string type" "diffuse" "rgb reflectance" [ 0.55 0.1 0.06 ]
MakeNamedMaterial "picture-blue" "string type" "diffuse" "rgb reflectance" [ 0.08 0.16 0.34 ]
MakeNamedMaterial "picture-ochre" "string type" "diffuse" "rgb reflectance" [ 0.62 0.42 0.1 ]
MakeNamedMaterial "pot-metal" "string type" "conductor" "spectrum eta" "metal-Ag-eta" "spectrum k" "metal-Ag-k"
    "float roughness" 0.1 "bool remaproughness" false
MakeNamedMaterial "pot-diffuse" "string type" "diffuse" "rgb reflectance" [ 0.56 0.67 0.66 ]
# One index for all wavelengths: no dispersion.
MakeNamedMaterial "pot-glass" "string type" "dielectric" "float eta" 1.5
"#;

const CAMERA: &str = r#"LookAt 0.05 -4.45 1.45   0.05 0 0.93   0 0 1
Camera "perspective"
    "float fov" 30.5

WorldBegin

"#;

fn scene() -> String {
    let head = Head {
        film: "ajar",
        depth: 40,
        mutations: 200,
        resolution: [640, 360],
        filter: ("gaussian", 1.5),
        ..Head::default()
    };
    let mut s = format!("{head}{MIRROR}{CAMERA}{MATERIALS}\n");
    let [r, g, b] = LAMP_RADIANCE;
    s += &format!(
        "AttributeBegin\n    AreaLightSource \"diffuse\" \"rgb L\" [ {r} {g} {b} ] \"float scale\" {LAMP_SCALE}\n    \
         NamedMaterial \"lamp-box\"\n    {}AttributeEnd\n\n",
        plymesh("lamp")
    );
    for (name, _) in meshes() {
        if name != "lamp" && name != "teapot" {
            s += &format!("NamedMaterial \"{name}\"\n{}", plymesh(name));
        }
    }
    for (name, at, turns) in TEAPOTS {
        s += &format!(
            "\nAttributeBegin\n    {}\n    NamedMaterial \"{name}\"\n    {}AttributeEnd\n",
            transform(&teapot_placement(at, turns)),
            plymesh("teapot")
        );
    }
    s
}

/// The scene file and its meshes.
pub fn outputs() -> Vec<Output> {
    folder("ajar", [("ajar".into(), scene())], meshes())
}
