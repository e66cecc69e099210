//! The Utah teapot, as a vessel that can be made of glass.
//!
//! The control points are Martin Newell's (1975) as published with 32 bicubic patches; rim, body, lid and bottom are
//! surfaces of revolution there and are turned exactly here. What the data lacks is added: the wall has a thickness,
//! the lid is a body with a flange, and handle and hollow spout end a hair before the wall instead of poking through
//! it, so that each of the four parts is a closed surface and none overlaps another.

use super::bezier;
use super::lathe::{Piece, revolve};
use super::mesh::Mesh;
use super::newell::*;
use super::tube::{HalfTube, Tube, bridge, cut, lid};
use glam::{DVec2, DVec3};

const AROUND: usize = 96;
const TUBE_AROUND: usize = 32;
/// Thickness of the wall in the data's unit (the pot is 6.4 units long).
const WALL: f64 = 0.1;
/// Distance that handle and spout keep from the wall: more than a facet of either can sag.
const GAP: f64 = 0.012;

fn cubic(c: &Cubic) -> [DVec2; 4] {
    c.map(DVec2::from)
}

fn half_tube(c: &Patch) -> HalfTube {
    c.map(|row| row.map(DVec3::from_array))
}

/// Radius of the body's outside at a height.
fn body_radius(z: f64) -> f64 {
    let curve = cubic(if z < 0.9 { &BODY_LOWER } else { &BODY_UPPER });
    let (mut lo, mut hi) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (lo + hi);
        if bezier::point(&curve, middle).y < z {
            lo = middle;
        } else {
            hi = middle;
        }
    }
    bezier::point(&curve, 0.5 * (lo + hi)).x
}

/// Distance from the body's wall in the direction away from its axis, positive outside.
pub fn clearance(p: DVec3) -> f64 {
    p.truncate().length() - body_radius(p.z)
}

fn outside(p: DVec3) -> f64 {
    clearance(p) - GAP
}

fn onto_wall(p: DVec3) -> DVec3 {
    (p.truncate().normalize() * (body_radius(p.z) + GAP)).extend(p.z)
}

/// The vessel: the published outside, and an inside that keeps the wall's thickness down to a rounded floor.
fn body() -> Mesh {
    let inner = |c: &Cubic, t: f64| {
        let d = bezier::derivative(&cubic(c), t).normalize();
        bezier::point(&cubic(c), t) - DVec2::new(d.y, -d.x) * WALL
    };
    // The offset of a cubic is fitted by the cubic through four of its points.
    let offset = |c: &Cubic, from: f64, to: f64| {
        let q = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|s| inner(c, from + (to - from) * s));
        let a = (q[1] * 18.0 - q[2] * 9.0 + q[3] * 2.0 - q[0] * 5.0) / 6.0;
        let b = (q[2] * 18.0 - q[1] * 9.0 + q[0] * 2.0 - q[3] * 5.0) / 6.0;
        [q[0], a, b, q[3]]
    };
    let upper = offset(&BODY_UPPER, 1.0, 0.0);
    let mut lower = offset(&BODY_LOWER, 1.0, 0.45);
    lower[0] = upper[3];
    let corner = lower[3] + (lower[3] - lower[2]) * 0.8;
    let floor = [
        lower[3],
        corner,
        DVec2::new(0.8, 0.16),
        DVec2::new(0.0, 0.16),
    ];
    revolve(
        &[
            Piece::Curve(cubic(&BOTTOM), 12),
            Piece::Curve(cubic(&BODY_LOWER), 16),
            Piece::Curve(cubic(&BODY_UPPER), 16),
            Piece::Curve(cubic(&RIM), 12),
            Piece::Line(DVec2::from(RIM[3]), upper[0]),
            Piece::Curve(upper, 14),
            Piece::Curve(lower, 10),
            Piece::Curve(floor, 12),
        ],
        AROUND,
    )
}

/// The lid with its knob, and below it a flange that fills the mouth.
fn cover() -> Mesh {
    let [bottom, edge, top] = [(1.2, 2.37), (1.37, 2.37), (1.37, 2.4)].map(DVec2::from);
    let under = [(0.0, 2.46), (0.6, 2.46), (1.0, 2.43), (1.2, 2.37)];
    revolve(
        &[
            Piece::Curve(cubic(&under), 10),
            Piece::Line(bottom, edge),
            Piece::Line(edge, top),
            Piece::Line(top, DVec2::from(LID[0])),
            Piece::Curve(cubic(&LID), 16),
            Piece::Curve(cubic(&KNOB), 16),
        ],
        AROUND,
    )
}

fn turns() -> impl Iterator<Item = f64> {
    (0..TUBE_AROUND).map(|j| j as f64 / TUBE_AROUND as f64)
}

/// The handle: solid, cut at both ends.
fn handle() -> Mesh {
    let halves = [half_tube(&HANDLE_UPPER), half_tube(&HANDLE_LOWER)];
    let tube = Tube(&halves);
    let ends: Vec<(f64, f64)> = turns()
        .map(|a| {
            let line = |v| tube.point(a, v);
            (cut(line, outside, 1.0, -0.5), cut(line, outside, 1.0, 2.5))
        })
        .collect();
    let steps = 40;
    let rows: Vec<Vec<DVec3>> = (0..=steps)
        .map(|i| {
            let s = f64::from(i) / f64::from(steps);
            let at = |(a, (v0, v1)): (f64, &(f64, f64))| tube.point(a, v0 + (v1 - v0) * s);
            turns().zip(&ends).map(at).collect()
        })
        .collect();
    let mut mesh = Mesh::default();
    let reversed: Vec<DVec3> = rows[0].iter().rev().copied().collect();
    lid(&mut mesh, &reversed, 6, onto_wall);
    mesh.loops(&rows);
    lid(&mut mesh, &rows[rows.len() - 1], 6, onto_wall);
    mesh.outward()
}

/// The spout: a hollow tube, its bore narrowing towards the published lip.
fn spout() -> Mesh {
    let halves = [half_tube(&SPOUT_LOWER), half_tube(&SPOUT_LIP)];
    let tube = Tube(&halves);
    let bore = |a: f64, v: f64| {
        let (p, c) = (tube.point(a, v), tube.centre(v));
        let narrow = v.max(0.0);
        // At the lip these are the ratios between its inner and its outer edge.
        let plane = 0.86 + (2.0 / 3.0 - 0.86) * narrow;
        let across = 0.86 + (0.6 - 0.86) * narrow;
        DVec3::new(
            c.x + (p.x - c.x) * plane,
            p.y * across,
            c.z + (p.z - c.z) * plane,
        )
    };
    let steps = 28;
    let sheet = |line: &dyn Fn(f64, f64) -> DVec3| -> Vec<Vec<DVec3>> {
        let ends: Vec<f64> = turns()
            .map(|a| cut(|v| line(a, v), outside, 0.7, -0.5))
            .collect();
        (0..=steps)
            .map(|i| {
                let s = f64::from(i) / f64::from(steps);
                let at = |(a, v0): (f64, &f64)| line(a, v0 + (1.0 - v0) * s);
                turns().zip(&ends).map(at).collect()
            })
            .collect()
    };
    let mut rows = sheet(&|a, v| tube.point(a, v));
    for i in 1..=10 {
        let v = 1.0 + f64::from(i) / 10.0;
        rows.push(turns().map(|a| tube.point(a, v)).collect());
    }
    let mut inside = sheet(&bore);
    inside.reverse();
    inside[0] = rows[rows.len() - 1].clone();
    let root = bridge(&inside[inside.len() - 1], &rows[0], 3, onto_wall);
    let mut mesh = Mesh::default();
    mesh.loops(&rows);
    mesh.loops(&inside);
    mesh.loops(&root);
    mesh.outward()
}

/// The four closed parts, z up, spout towards +x, standing on z = 0, in the data's units.
pub fn parts() -> [Mesh; 4] {
    [body(), cover(), handle(), spout()]
}

/// All parts in one mesh.
pub fn teapot() -> Mesh {
    let mut mesh = Mesh::default();
    parts().iter().for_each(|part| mesh.append(part));
    mesh
}
