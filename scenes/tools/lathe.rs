//! Surfaces of revolution around the z axis.

use super::bezier;
use super::mesh::Mesh;
use super::trig::cos_sin_turns;
use glam::{DVec2, DVec3};

/// A piece of a profile in the half plane (radius, z); pieces meet in creases unless their tangents agree.
#[derive(Clone, Copy)]
pub enum Piece {
    /// Cubic with its number of steps.
    Curve([DVec2; 4], usize),
    /// Straight from the first to the second point.
    Line(DVec2, DVec2),
}

impl Piece {
    /// Points with outward normals: the outside is on the right of the direction of travel.
    fn samples(&self) -> Vec<(DVec2, DVec2)> {
        let right = |d: DVec2| DVec2::new(d.y, -d.x).normalize();
        match self {
            Piece::Line(a, b) => vec![(*a, right(*b - *a)), (*b, right(*b - *a))],
            Piece::Curve(p, steps) => (0..=*steps)
                .map(|i| {
                    let t = i as f64 / *steps as f64;
                    (bezier::point(p, t), right(bezier::derivative(p, t)))
                })
                .collect(),
        }
    }
}

/// Turns a profile, drawn from the bottom of the axis outward and back to the axis, around z.
///
/// Radius 0 gives a single vertex. Neighbouring pieces repeat their common ring with equal positions.
pub fn revolve(profile: &[Piece], around: usize) -> Mesh {
    let circle: Vec<_> = (0..around)
        .map(|j| cos_sin_turns(j as f64 / around as f64))
        .collect();
    let mut mesh = Mesh::default();
    for piece in profile {
        let samples = piece.samples();
        let mut rings: Vec<Vec<u32>> = Vec::new();
        for (p, n) in &samples {
            let first = mesh.positions.len() as u32;
            let count = if p.x == 0.0 { 1 } else { around };
            for (c, s) in &circle[..count] {
                mesh.positions.push(DVec3::new(p.x * c, p.x * s, p.y));
                let normal = if p.x == 0.0 {
                    DVec3::new(0.0, 0.0, n.y.signum())
                } else {
                    DVec3::new(n.x * c, n.x * s, n.y)
                };
                mesh.normals.push(normal);
            }
            rings.push((first..first + count as u32).collect());
        }
        for pair in rings.windows(2) {
            for j in 0..around {
                let at = |ring: &Vec<u32>, j: usize| ring[j % ring.len()];
                let (a, b) = (at(&pair[0], j), at(&pair[0], j + 1));
                let (d, c) = (at(&pair[1], j), at(&pair[1], j + 1));
                mesh.triangle_unless_degenerate([a, b, c]);
                mesh.triangle_unless_degenerate([a, c, d]);
            }
        }
    }
    mesh
}
