//! What the tests of this room share: a small generator, random soups, an icosphere.

use crate::scene::{Geometry, NONE, Quadric, Shape};
use glam::{Mat3, Vec3};
use std::collections::HashMap;

/// SplitMix64; enough to place triangles.
pub struct Rng(pub u64);

impl Rng {
    /// Uniform in [0, 1).
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 * 2f32.powi(-24)
    }

    /// Uniform in the unit cube.
    pub fn vec3(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }

    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> Vec3 {
        let z = 1.0 - 2.0 * self.next();
        let phi = std::f32::consts::TAU * self.next();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }

    /// Weights (b1, b2) uniform over a triangle.
    pub fn barycentric(&mut self) -> (f32, f32) {
        let s = self.next().sqrt();
        (s * (1.0 - self.next()), 1.0 - s)
    }
}

/// Everything is one plain shape.
pub fn geometry(
    mut positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    quadrics: Vec<Quadric>,
) -> Geometry {
    positions.push(Vec3::ZERO);
    let n = triangles.len() + quadrics.len();
    Geometry {
        positions,
        triangles,
        quadrics,
        prim_shape: vec![0; n],
        prim_light: vec![NONE; n],
        shapes: vec![Shape {
            material: 0,
            has_normals: false,
            has_uvs: false,
        }],
        ..Geometry::default()
    }
}

/// `n` triangles of edge about 0.2 in the unit cube.
pub fn soup(rng: &mut Rng, n: usize) -> Geometry {
    mixed(rng, n, 0)
}

/// The same with `quadrics` spheres and disks among them.
pub fn mixed(rng: &mut Rng, n: usize, quadrics: usize) -> Geometry {
    let mut positions = Vec::new();
    for _ in 0..n {
        let center = rng.vec3();
        positions.extend((0..3).map(|_| center + 0.2 * (rng.vec3() - 0.5)));
    }
    let triangles = (0..n as u32)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    let quadrics = (0..quadrics).map(|i| {
        let center = rng.vec3();
        let radius = 0.02 + 0.08 * rng.next();
        let normal = rng.direction();
        if i % 2 == 0 {
            Quadric::Sphere {
                center,
                radius,
                to_object: Mat3::IDENTITY,
                inward: i % 4 == 0,
            }
        } else {
            Quadric::Disk {
                center,
                normal,
                tangent: normal.any_orthonormal_vector(),
                radius,
            }
        }
    });
    geometry(positions, triangles, quadrics.collect())
}

/// The geometry with every length multiplied.
pub fn scaled(mut g: Geometry, s: f32) -> Geometry {
    for p in &mut g.positions {
        *p *= s;
    }
    for q in &mut g.quadrics {
        match q {
            Quadric::Sphere { center, radius, .. } | Quadric::Disk { center, radius, .. } => {
                *center *= s;
                *radius *= s;
            }
        }
    }
    g
}

/// A closed mesh: an icosahedron with each face cut in four `levels` times, corners on the unit sphere.
pub fn icosphere(levels: usize) -> Geometry {
    let t = 0.5 * (1.0 + 5f32.sqrt());
    let mut positions: Vec<Vec3> = Vec::new();
    for (a, b) in [(-1.0, t), (1.0, t), (-1.0, -t), (1.0, -t)] {
        positions.push(Vec3::new(a, b, 0.0).normalize());
    }
    for (a, b) in [(-1.0, t), (1.0, t), (-1.0, -t), (1.0, -t)] {
        positions.push(Vec3::new(0.0, a, b).normalize());
    }
    for (a, b) in [(t, -1.0), (t, 1.0), (-t, -1.0), (-t, 1.0)] {
        positions.push(Vec3::new(a, 0.0, b).normalize());
    }
    // Faces are the triples of mutual neighbours; the winding follows from the sphere.
    let near = |a: Vec3, b: Vec3| (a - b).length() < 1.2;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let (p, q, r) = (positions[a], positions[b], positions[c]);
                if near(p, q) && near(q, r) && near(p, r) {
                    let outward = (q - p).cross(r - p).dot(p) > 0.0;
                    triangles.push(if outward { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push((positions[i as usize] + positions[j as usize]).normalize());
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    geometry(positions, triangles, Vec::new())
}
