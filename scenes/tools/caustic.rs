//! `scenes/caustic`: a tilted lens focuses a spotlight on the floor; a floor lamp lights the rest by way of the ceiling.
//! One camera, four fields of view.
//!
//! Metres, z up. The room is x −2…2, y −2.4…2, z 0…2.6.

use super::Output;
use super::lathe::{Piece, revolve};
use super::mesh::Mesh;
use super::text::{Head, MIRROR, folder, plymesh};
use super::trig::cos_sin_turns;
use glam::{DAffine3, DMat3, DVec2, DVec3};

/// Magnifications of the four cameras.
pub const ZOOMS: [u32; 4] = [1, 4, 16, 64];
/// Middle of the lens.
const LENS: [f64; 3] = [0.35, 0.1, 0.5];
/// The lens leans by this part of a turn about the x axis.
const TILT: f64 = 0.07;
/// Radius of the lens across its axis.
const APERTURE: f64 = 0.15;
/// Radius of its two spherical faces: with index 1.5 the focal length is the same.
const CURVATURE: f64 = 0.5;
/// Height of the spotlight's disk above the lens, and the disk's radius.
const SPOT: (f64, f64) = (1.25, 0.02);
/// Tube around the spotlight: radius, length below the disk.
const TUBE: (f64, f64) = (0.04, 0.3);
/// Foot of the floor lamp.
const POLE: [f64; 2] = [-0.95, 1.35];
/// Tangent of half the field of view at ×1.
const HALF_VIEW: f64 = 0.42;
/// What all cameras look at: the middle of the caustic.
const AIM: [f64; 3] = [0.35, 0.095, 0.0];

fn ring(radius: f64, z: f64, n: usize) -> Vec<DVec3> {
    (0..n)
        .map(|j| {
            let (c, s) = cos_sin_turns(j as f64 / n as f64);
            DVec3::new(radius * c, radius * s, z)
        })
        .collect()
}

/// The solid lens around the z axis with its middle at the origin: two caps that share their rim, normals those of
/// the spheres.
fn lens() -> Mesh {
    let (rings, around) = (40, 96);
    let depth = (CURVATURE * CURVATURE - APERTURE * APERTURE).sqrt();
    let mut mesh = Mesh::default();
    for side in [-1.0, 1.0] {
        let base = mesh.positions.len() as u32;
        for i in 0..=rings {
            let radius = APERTURE * i as f64 / rings as f64;
            let z = side * ((CURVATURE * CURVATURE - radius * radius).sqrt() - depth);
            let points = if i == 0 { 1 } else { around };
            for p in ring(radius, z, points) {
                mesh.positions.push(p);
                let centre = DVec3::new(0.0, 0.0, -side * depth);
                mesh.normals.push((p - centre).normalize());
            }
        }
        let at = |i: usize, j: usize| match i {
            0 => base,
            _ => base + 1 + ((i - 1) * around + j % around) as u32,
        };
        for i in 0..rings {
            for j in 0..around {
                let q = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                for [a, b, c] in [[q[0], q[3], q[2]], [q[0], q[2], q[1]]] {
                    let t = if side > 0.0 { [a, b, c] } else { [a, c, b] };
                    mesh.triangle_unless_degenerate(t);
                }
            }
        }
    }
    mesh
}

/// Leans the lens and what holds it, and puts them in their place.
fn placement() -> DAffine3 {
    let (c, s) = cos_sin_turns(TILT);
    let turn = DMat3::from_cols(DVec3::X, DVec3::new(0.0, c, s), DVec3::new(0.0, -s, c));
    DAffine3::from_mat3_translation(turn, DVec3::from_array(LENS))
}

/// A ring around the lens's rim, and a rod to the wall.
fn holder() -> Mesh {
    let (around, across, thick) = (96, 16, 0.008);
    let radius = APERTURE + 0.9 * thick;
    let rows: Vec<Vec<DVec3>> = (0..=across)
        .map(|i| {
            let (c, s) = cos_sin_turns(i as f64 / across as f64);
            ring(radius + thick * c, thick * s, around)
        })
        .collect();
    let mut m = Mesh::default();
    m.loops(&rows);
    let mut m = m.moved(&placement());
    // The rod: a closed cylinder along x, from the rim into the right wall.
    let v = |x: f64, y: f64| DVec2::new(x, y);
    let rod = revolve(
        &[
            Piece::Line(v(0.0, 0.0), v(0.007, 0.0)),
            Piece::Line(v(0.007, 0.0), v(0.007, 1.55)),
            Piece::Line(v(0.007, 1.55), v(0.0, 1.55)),
        ],
        24,
    );
    let lie = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
    let from = DVec3::new(LENS[0] + APERTURE + 0.004, LENS[1], LENS[2]);
    m.append(&rod.moved(&DAffine3::from_mat3_translation(lie, from)));
    m
}

/// Inside of the room: floor; walls and ceiling.
fn room() -> [Mesh; 2] {
    let (x0, x1, y0, y1, h) = (-2.0, 2.0, -2.4, 2.0, 2.6);
    let p = DVec3::new;
    let mut floor = Mesh::default();
    floor.quad([
        p(x0, y0, 0.0),
        p(x1, y0, 0.0),
        p(x1, y1, 0.0),
        p(x0, y1, 0.0),
    ]);
    let mut walls = Mesh::default();
    walls.quad([p(x0, y0, h), p(x0, y1, h), p(x1, y1, h), p(x1, y0, h)]);
    walls.quad([p(x0, y1, 0.0), p(x1, y1, 0.0), p(x1, y1, h), p(x0, y1, h)]);
    walls.quad([p(x1, y0, 0.0), p(x0, y0, 0.0), p(x0, y0, h), p(x1, y0, h)]);
    walls.quad([p(x0, y0, 0.0), p(x0, y1, 0.0), p(x0, y1, h), p(x0, y0, h)]);
    walls.quad([p(x1, y1, 0.0), p(x1, y0, 0.0), p(x1, y0, h), p(x1, y1, h)]);
    [floor, walls]
}

/// Surfaces of revolution around vertical axes: tube of the spotlight, floor lamp.
fn fittings() -> Mesh {
    let v = |x: f64, y: f64| DVec2::new(x, y);
    let ((above, _), (r, l), t) = (SPOT, TUBE, 0.004);
    let z = LENS[2] + above;
    let mut m = Mesh::default();
    let tube = [
        Piece::Line(v(r + t, z - l), v(r + t, z + 0.05)),
        Piece::Line(v(r + t, z + 0.05), v(0.0, z + 0.05)),
        Piece::Line(v(0.0, z + 0.01), v(r, z + 0.01)),
        Piece::Line(v(r, z + 0.01), v(r, z - l)),
        Piece::Line(v(r, z - l), v(r + t, z - l)),
    ];
    let put =
        |m: &Mesh, x: f64, y: f64| m.moved(&DAffine3::from_translation(DVec3::new(x, y, 0.0)));
    m.append(&put(&revolve(&tube, 48), LENS[0], LENS[1]));
    let lamp = [
        Piece::Line(v(0.0, 0.0), v(0.16, 0.0)),
        Piece::Line(v(0.16, 0.0), v(0.16, 0.02)),
        Piece::Line(v(0.16, 0.02), v(0.015, 0.03)),
        Piece::Line(v(0.015, 0.03), v(0.015, 1.6)),
        Piece::Line(v(0.015, 1.6), v(0.09, 1.62)),
        Piece::Line(v(0.09, 1.62), v(0.2, 1.8)),
        Piece::Line(v(0.2, 1.8), v(0.196, 1.8)),
        Piece::Line(v(0.196, 1.8), v(0.086, 1.624)),
        Piece::Line(v(0.086, 1.624), v(0.0, 1.624)),
    ];
    m.append(&put(&revolve(&lamp, 64), POLE[0], POLE[1]));
    m
}

fn head(name: &str, zoom: u32) -> String {
    let fov = field_of_view(HALF_VIEW / f64::from(zoom));
    let [x, y, z] = AIM;
    let head = Head {
        film: name,
        depth: 10,
        mutations: 200,
        ..Head::default()
    };
    format!(
        r#"{head}{MIRROR}LookAt -0.45 -2.3 1.5   {x} {y} {z}   0 0 1
Camera "perspective"
    "float fov" {fov}

WorldBegin

"#
    )
}

/// 2·atan(t) in degrees by the series of atan after three halvings of the angle, for 0 < t ≤ 1: the C library's differs
/// between machines.
fn field_of_view(tangent: f64) -> f32 {
    let mut t = tangent;
    for _ in 0..3 {
        t /= 1.0 + (1.0 + t * t).sqrt();
    }
    let (mut sum, mut power) = (0.0, t);
    for k in 0..20 {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        sum += sign * power / f64::from(2 * k + 1);
        power *= t * t;
    }
    (16.0 * sum * 180.0 / std::f64::consts::PI) as f32
}

fn world() -> String {
    let [lx, ly, lz] = LENS;
    let (above, radius) = SPOT;
    let z = ((lz + above) * 1e6).round() / 1e6;
    let [px, py] = POLE;
    format!(
        r#"# the spotlight's disk, looking down, in a black tube
AttributeBegin
    AreaLightSource "diffuse" "rgb L" [ 1 0.95 0.85 ] "float scale" 150
    Material "diffuse" "rgb reflectance" [ 0 0 0 ]
    Translate {lx} {ly} {z}
    Rotate 180 1 0 0
    Shape "disk" "float radius" {radius}
AttributeEnd

# the floor lamp's disk, looking up out of its bowl
AttributeBegin
    AreaLightSource "diffuse" "rgb L" [ 1 0.8 0.55 ] "float scale" 1200
    Material "diffuse" "rgb reflectance" [ 0 0 0 ]
    Translate {px} {py} 1.63
    Shape "disk" "float radius" 0.07
AttributeEnd

Material "diffuse" "rgb reflectance" [ 0.55 0.5 0.45 ]
{}Material "diffuse" "rgb reflectance" [ 0.6 0.62 0.62 ]
{}Material "diffuse" "rgb reflectance" [ 0.04 0.04 0.04 ]
{}Material "diffuse" "rgb reflectance" [ 0.35 0.12 0.06 ]
{}Material "dielectric" "float eta" 1.5
{}"#,
        plymesh("floor"),
        plymesh("walls"),
        plymesh("fittings"),
        plymesh("holder"),
        plymesh("lens")
    )
}

/// Names and meshes.
pub fn meshes() -> Vec<(&'static str, Mesh)> {
    let [floor, walls] = room();
    vec![
        ("floor", floor),
        ("walls", walls),
        ("fittings", fittings()),
        ("holder", holder()),
        ("lens", lens().moved(&placement())),
    ]
}

/// The scene files and their meshes.
pub fn outputs() -> Vec<Output> {
    let scene = |zoom| {
        let name = format!("caustic-x{zoom}");
        let text = head(&name, zoom) + &world();
        (name, text)
    };
    folder("caustic", ZOOMS.map(scene), meshes())
}
