//! A mesh of any size, made on the spot: hills on a square, with rays that fly over it, into it and from under it.

use super::sets::RaySet;
use crate::accel::Ray;
use crate::accel::record::Kind;
use crate::real::Convert;
use crate::sampling::Rng;
use crate::scene::{Geometry, NONE, Shape};
use glam::Vec3;
use std::f32::consts::TAU;

/// Stage of the random streams, apart from those of a render.
const STAGE: u32 = 101;

/// Hills over the unit square, of at least so many triangles; waves of twelve octaves, so that every size has detail of its
/// own.
pub fn terrain(triangles: usize) -> Geometry {
    let n = (triangles as f64 / 2.0).sqrt().ceil().max(1.0) as u32;
    let height = |x: f32, y: f32| {
        let mut rng = Rng::new(1, STAGE, 0, 0);
        let waves = (0..12).map(|octave| {
            let k = 2f32.powi(octave) * 3.0;
            let (a, b) = (rng.next_f32().single() * TAU, rng.next_f32().single() * TAU);
            ((x * k + a).sin() * (y * k + b).sin()) / k
        });
        0.3 * waves.sum::<f32>()
    };
    let at = |i: u32| i as f32 / n as f32;
    let rows = (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j)));
    let mut positions: Vec<Vec3> = rows
        .map(|(i, j)| Vec3::new(at(i), at(j), 0.5 + height(at(i), at(j))))
        .collect();
    positions.push(Vec3::ZERO);
    let mut faces = Vec::with_capacity(2 * (n * n) as usize);
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            faces.push([a, a + 1, a + n + 2]);
            faces.push([a, a + n + 2, a + n + 1]);
        }
    }
    let count = faces.len();
    Geometry {
        positions,
        triangles: faces,
        prim_shape: vec![0; count],
        prim_light: vec![NONE; count],
        shapes: vec![Shape {
            material: NONE,
            has_normals: false,
            has_uvs: false,
        }],
        ..Geometry::default()
    }
}

/// Rays from around the unit cube into it: `count` for the nearest hit, `count` between two points.
pub fn rays(count: usize) -> Vec<RaySet> {
    let set = |kind: Kind| RaySet {
        name: "random".into(),
        kind,
        rays: (0..count as u64).map(|i| random(i, kind)).collect(),
    };
    vec![set(Kind::Closest), set(Kind::Any)]
}

fn random(i: u64, kind: Kind) -> Ray {
    let mut rng = Rng::new(1, STAGE, 1, kind as u32);
    rng.set_step(i);
    let mut point = || Vec3::from_array([(); 3].map(|()| rng.next_f32().single()));
    let (o, to) = (point() * 2.0 - 0.5, point());
    Ray {
        o,
        d: to - o,
        t_max: match kind {
            Kind::Closest => f32::INFINITY,
            Kind::Any => 1.0,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{Accel, Checked, Embree, EmbreeOptions, Obvhs};
    use rayon::prelude::*;

    /// So many rays of each kind through both backends.
    fn check(triangles: usize, count: usize) {
        let g = terrain(triangles);
        assert!(g.triangles.len() >= triangles);
        let embree = Embree::new(&g, EmbreeOptions::default()).expect("builds");
        let checked = Checked::new(embree, Obvhs::new(&g));
        (0..count as u64).into_par_iter().for_each(|i| {
            checked.nearest(&random(i, Kind::Closest));
            checked.occluded(&random(i, Kind::Any));
        });
        let found = checked.disagreement();
        println!("{triangles} triangles: {}", found.lines().join("\n"));
        assert_eq!(found.wrong(), 0, "{found:#?}");
        // n rows, columns and diagonals make (2 + √2)·n of edges on the unit square. Who passes one within a rounding u·R
        // of the coordinates, R < 2, on either side, may meet either face: no two engines agree on more than the rest.
        let n = (triangles as f64 / 2.0).sqrt();
        let strip = 2.0 * 2.0 * f32::EPSILON as f64 / 2.0;
        let most = (2.0 + 2f64.sqrt()) * n * strip * 2.0 * count as f64;
        let named_otherwise = (found.different() + found.settled) as f64;
        assert!(named_otherwise <= most + 3.0, "{most}: {found:#?}");
        let hits_differ = found.different() as f64;
        assert!(hits_differ <= 1e-5 * count as f64 + 3.0, "{found:#?}");
    }

    #[test]
    fn backends_agree_on_hills() {
        check(20_000, 100_000);
    }

    /// 10⁷ rays on each of four meshes of 10⁴ … 10⁷ triangles.
    #[test]
    #[ignore = "minutes; make test-long"]
    fn backends_agree_on_growing_hills() {
        for triangles in [10_000, 100_000, 1_000_000, 10_000_000] {
            check(triangles, 5_000_000);
        }
    }
}
