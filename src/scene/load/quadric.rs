//! Spheres and disks: exact where they are whole and keep their form, else as fine meshes.

use super::error::{Result, SceneError};
use super::params::Params;
use super::place::Mesh;
use super::transform::{mirrors, normal_matrix, uniform_scale};
use crate::scene::Quadric;
use glam::{DMat3, DMat4, DVec3, Vec2};
use std::f64::consts::PI;

/// Steps around a tessellated circle: chords of 2π/256 rad stay within 8·10⁻⁵ radii of the arc.
const AROUND: usize = 256;
/// Steps from pole to pole, or from the centre to the rim of a partial disk.
const ACROSS: usize = 128;

/// A quadric in world space, in f64.
#[derive(Clone, Debug)]
pub(super) enum Quadric64 {
    Sphere {
        center: DVec3,
        radius: f64,
        to_object: DMat3,
        inward: bool,
    },
    Disk {
        center: DVec3,
        normal: DVec3,
        tangent: DVec3,
        radius: f64,
    },
}

impl Quadric64 {
    /// Surface area, one side.
    pub(super) fn area(&self) -> f64 {
        match self {
            Self::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Self::Disk { radius, .. } => PI * radius * radius,
        }
    }

    /// Centre and radius of a sphere around it.
    pub(super) fn bounds(&self) -> (DVec3, f64) {
        match self {
            Self::Sphere { center, radius, .. } | Self::Disk { center, radius, .. } => {
                (*center, *radius)
            }
        }
    }

    /// The stored form, `origin` taken off.
    pub(super) fn stored(&self, origin: DVec3) -> Quadric {
        match *self {
            Self::Sphere {
                center,
                radius,
                to_object,
                inward,
            } => Quadric::Sphere {
                center: (center - origin).as_vec3(),
                radius: radius as f32,
                to_object: to_object.as_mat3(),
                inward,
            },
            Self::Disk {
                center,
                normal,
                tangent,
                radius,
            } => Quadric::Disk {
                center: (center - origin).as_vec3(),
                normal: normal.as_vec3(),
                tangent: tangent.as_vec3(),
                radius: radius as f32,
            },
        }
    }
}

/// pbrt's `sphere`, perhaps cut at two heights and an angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sphere {
    radius: f64,
    z_min: f64,
    z_max: f64,
    phi_max: f64,
}

/// pbrt's `disk`, perhaps with a hole and cut at an angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disk {
    height: f64,
    radius: f64,
    inner: f64,
    phi_max: f64,
}

fn phi_max(p: &Params) -> Result<f64> {
    let degrees = p.float_where("phimax", 360.0, "an angle above 0", |v| v > 0.0)?;
    Ok(degrees.min(360.0).to_radians())
}

impl Sphere {
    pub(super) fn parse(p: &Params) -> Result<Self> {
        let radius = p.float_where("radius", 1.0, "a radius above 0", |v| v > 0.0)?;
        let (a, b) = (p.float("zmin", -radius)?, p.float("zmax", radius)?);
        let s = Self {
            radius,
            z_min: a.min(b).clamp(-radius, radius),
            z_max: a.max(b).clamp(-radius, radius),
            phi_max: phi_max(p)?,
        };
        if s.z_min < s.z_max {
            return Ok(s);
        }
        Err(SceneError::value(
            &p.at,
            "nothing of the sphere lies between \"zmin\" and \"zmax\"",
        ))
    }

    /// The exact sphere, if it is whole and stays a sphere. Its outside stays outside under a mirror (as pbrt-v4
    /// samples it; pbrt's intersection code says the opposite there).
    pub(super) fn exact(&self, m: &DMat4, reverse: bool) -> Option<Quadric64> {
        let whole =
            self.z_min <= -self.radius && self.z_max >= self.radius && self.phi_max >= 2.0 * PI;
        let s = uniform_scale(m).filter(|_| whole)?;
        Some(Quadric64::Sphere {
            center: m.transform_point3(DVec3::ZERO),
            radius: self.radius * s,
            to_object: DMat3::from_mat4(*m).transpose() * (1.0 / s),
            inward: reverse,
        })
    }

    /// A fine mesh with normals, and pbrt's (φ, θ) as texture coordinates.
    pub(super) fn tessellate(&self) -> Mesh {
        let theta = |z: f64| (z / self.radius).clamp(-1.0, 1.0).acos();
        let (t0, t1) = (theta(self.z_min), theta(self.z_max));
        grid(|u, v| {
            let (phi, t) = (u * self.phi_max, t0 + v * (t1 - t0));
            let n = DVec3::new(t.sin() * phi.cos(), t.sin() * phi.sin(), t.cos());
            (n * self.radius, Some(n))
        })
    }
}

impl Disk {
    pub(super) fn parse(p: &Params) -> Result<Self> {
        let radius = p.float_where("radius", 1.0, "a radius above 0", |v| v > 0.0)?;
        Ok(Self {
            height: p.float("height", 0.0)?,
            radius,
            inner: p.float_where("innerradius", 0.0, "0 to the radius", |v| {
                (0.0..radius).contains(&v)
            })?,
            phi_max: phi_max(p)?,
        })
    }

    /// The exact disk, if it is whole and stays round. `uses_uv`: the sense in which φ turns matters, and the
    /// stored form fixes it to be about the normal.
    pub(super) fn exact(&self, m: &DMat4, reverse: bool, uses_uv: bool) -> Option<Quadric64> {
        if self.inner > 0.0 || self.phi_max < 2.0 * PI || (uses_uv && mirrors(m) != reverse) {
            return None;
        }
        let (x, y) = (m.x_axis.truncate(), m.y_axis.truncate());
        let (lx, ly) = (x.length(), y.length());
        let round = (lx - ly).abs() <= 1e-5 * lx && x.dot(y).abs() <= 1e-5 * lx * ly;
        let normal = (normal_matrix(m) * DVec3::Z).normalize();
        round.then_some(Quadric64::Disk {
            center: m.transform_point3(DVec3::Z * self.height),
            normal: if reverse { -normal } else { normal },
            tangent: x / lx,
            radius: self.radius * 0.5 * (lx + ly),
        })
    }

    /// A fine flat mesh; v runs from the rim to the centre as in pbrt.
    pub(super) fn tessellate(&self) -> Mesh {
        grid(|u, v| {
            let phi = u * self.phi_max;
            let r = self.radius + v * (self.inner - self.radius);
            (DVec3::new(r * phi.cos(), r * phi.sin(), self.height), None)
        })
    }
}

/// A stored quadric as a fine mesh with its outside outside.
pub(in crate::scene) fn quadric_mesh(q: &Quadric) -> Mesh {
    let (mut mesh, to_world, center, turn) = match *q {
        Quadric::Sphere {
            center,
            radius,
            to_object,
            inward,
        } => {
            let radius = radius as f64;
            let whole = Sphere {
                radius,
                z_min: -radius,
                z_max: radius,
                phi_max: 2.0 * PI,
            };
            (whole.tessellate(), to_object.transpose(), center, inward)
        }
        Quadric::Disk {
            center,
            normal,
            tangent,
            radius,
        } => {
            let whole = Disk {
                height: 0.0,
                radius: radius as f64,
                inner: 0.0,
                phi_max: 2.0 * PI,
            };
            let axes = glam::Mat3::from_cols(tangent, normal.cross(tangent), normal);
            (whole.tessellate(), axes, center, false)
        }
    };
    let to_world = to_world.as_dmat3();
    for p in &mut mesh.positions {
        *p = center.as_dvec3() + to_world * *p;
    }
    for n in &mut mesh.normals {
        *n = to_world * *n * if turn { -1.0 } else { 1.0 };
    }
    // A rotation that mirrors turns the winding, too.
    if turn != (to_world.determinant() < 0.0) {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    mesh
}

/// A mesh over the unit square, cut so that u × v points to the outside; all of one pbrt shape.
fn grid(f: impl Fn(f64, f64) -> (DVec3, Option<DVec3>)) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..=ACROSS {
        for i in 0..=AROUND {
            let (u, v) = (i as f64 / AROUND as f64, j as f64 / ACROSS as f64);
            let (p, n) = f(u, v);
            mesh.positions.push(p);
            mesh.normals.extend(n);
            mesh.uvs.push(Vec2::new(u as f32, v as f32));
        }
    }
    // At a pole, or the middle of a disk, corners coincide but for roundings.
    let has_area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let edges = [b - a, c - b, a - c].map(DVec3::length_squared);
        (b - a).cross(c - a).length() > 1e-12 * edges.into_iter().fold(0.0, f64::max)
    };
    let row = AROUND as u32 + 1;
    for j in 0..ACROSS as u32 {
        for i in 0..AROUND as u32 {
            let a = j * row + i;
            let two = [[a, a + 1, a + row + 1], [a, a + row + 1, a + row]];
            mesh.triangles.extend(two.into_iter().filter(has_area));
        }
    }
    mesh.parts = vec![0; mesh.triangles.len()];
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(mesh: &Mesh) -> f64 {
        let of = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            (b - a).cross(c - a).length() / 2.0
        };
        mesh.triangles.iter().map(of).sum()
    }

    #[test]
    fn tessellations_have_the_area_of_the_surface_and_face_outwards() {
        let sphere = Sphere {
            radius: 2.0,
            z_min: 0.0,
            z_max: 1.0,
            phi_max: PI,
        };
        let mesh = sphere.tessellate();
        // A zone's area is angle · radius · height; inscribed facets lose less than (2π/256)² of it.
        let want = PI * 2.0 * 1.0;
        let loss = 1.0 - area(&mesh) / want;
        assert!((0.0..6.1e-4).contains(&loss), "{loss}");
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            assert!((b - a).cross(c - a).dot(a) > 0.0);
        }
        let whole = Sphere {
            radius: 2.0,
            z_min: -2.0,
            z_max: 2.0,
            phi_max: 2.0 * PI,
        };
        // Each pole is a fan of one triangle a step.
        let triangles = whole.tessellate().triangles.len();
        assert_eq!(triangles, 2 * AROUND * (ACROSS - 1));
        let disk = Disk {
            height: 1.0,
            radius: 2.0,
            inner: 1.0,
            phi_max: PI,
        };
        let mesh = disk.tessellate();
        let loss = 1.0 - area(&mesh) / (0.5 * PI * 3.0);
        assert!((0.0..6.1e-4).contains(&loss), "{loss}");
        let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
        assert!((b - a).cross(c - a).z > 0.0);
    }
}
