//! Shapes go into world space: positions in double precision, orientation baked into the winding.

use super::error::{Location, Result, SceneError};
use super::light::AreaLight;
use super::quadric::{self, Quadric64};
use super::transform::{mirrors, normal_matrix};
use crate::scene::geometry::{NONE, Shape};
use crate::scene::spectrum::Curve;
use glam::{DMat4, DVec3, Vec2, Vec3};
use std::rc::Rc;
use std::sync::Arc;

/// A triangle mesh in object space.
#[derive(Debug, Default)]
pub(in crate::scene) struct Mesh {
    pub(in crate::scene) positions: Vec<DVec3>,
    /// Parallel to `positions`, or empty.
    pub(in crate::scene) normals: Vec<DVec3>,
    /// Parallel to `positions`, or empty.
    pub(in crate::scene) uvs: Vec<Vec2>,
    pub(in crate::scene) triangles: Vec<[u32; 3]>,
    /// The pbrt shape each triangle is a part of (a patch or quadric that was tessellated); empty: each its own.
    pub(super) parts: Vec<u32>,
}

/// The body of a shape in object space.
#[derive(Clone, Debug)]
pub(super) enum Body {
    Mesh(Rc<Mesh>),
    Sphere(quadric::Sphere),
    Disk(quadric::Disk),
}

/// A shape that can be put into the world, once or by instances.
#[derive(Clone, Debug)]
pub(super) struct Placeable {
    pub(super) body: Body,
    pub(super) to_world: DMat4,
    pub(super) reverse: bool,
    pub(super) material: u32,
    /// The material reads texture coordinates.
    pub(super) uses_uv: bool,
    pub(super) area_light: Option<Rc<AreaLight>>,
    pub(super) at: Location,
    pub(super) label: Arc<str>,
}

/// Emission of a primitive, before the primitive has its number.
#[derive(Clone, Debug)]
pub(super) struct Emission {
    pub(super) radiance: Curve,
    pub(super) two_sided: bool,
    pub(super) at: Location,
}

/// The world under construction; the same arrays as [`crate::scene::Geometry`], positions in f64.
#[derive(Default)]
pub(super) struct World {
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Shape and index into `emissions` of each triangle.
    pub(super) triangle_owner: Vec<(u32, u32)>,
    pub(super) quadrics: Vec<Quadric64>,
    /// The same for the quadrics.
    pub(super) quadric_owner: Vec<(u32, u32)>,
    pub(super) emissions: Vec<Emission>,
    pub(super) shapes: Vec<Shape>,
    /// Place and name of each shape.
    pub(super) shape_places: Vec<(Arc<str>, Location)>,
}

impl World {
    /// Puts a shape into the world, through an instance's transform if there is one.
    pub(super) fn place(&mut self, s: &Placeable, instance: Option<&DMat4>) -> Result<()> {
        let m = instance.map_or(s.to_world, |i| *i * s.to_world);
        if !m.is_finite() {
            return Err(SceneError::value(&s.at, "the transform overflows"));
        }
        match &s.body {
            Body::Mesh(mesh) => self.place_mesh(s, mesh, &m),
            Body::Sphere(sphere) => match sphere.exact(&m, s.reverse) {
                Some(q) => self.place_quadric(s, q),
                None => self.place_mesh(s, &sphere.tessellate(), &m),
            },
            Body::Disk(disk) => match disk.exact(&m, s.reverse, s.uses_uv) {
                Some(q) => self.place_quadric(s, q),
                None => self.place_mesh(s, &disk.tessellate(), &m),
            },
        }
    }

    fn new_shape(&mut self, s: &Placeable, has_normals: bool, has_uvs: bool) -> u32 {
        self.shapes.push(Shape {
            material: s.material,
            has_normals,
            has_uvs,
        });
        self.shape_places.push((s.label.clone(), s.at.clone()));
        (self.shapes.len() - 1) as u32
    }

    fn emission(&mut self, s: &Placeable, area: f64) -> u32 {
        let Some(light) = s.area_light.as_ref().filter(|_| area > 0.0) else {
            return NONE;
        };
        self.emissions.push(Emission {
            radiance: light.radiance(area),
            two_sided: light.two_sided,
            at: light.at.clone(),
        });
        (self.emissions.len() - 1) as u32
    }

    fn place_quadric(&mut self, s: &Placeable, q: Quadric64) -> Result<()> {
        let shape = self.new_shape(s, false, false);
        let light = self.emission(s, q.area());
        self.quadrics.push(q);
        self.quadric_owner.push((shape, light));
        Ok(())
    }

    fn place_mesh(&mut self, s: &Placeable, mesh: &Mesh, m: &DMat4) -> Result<()> {
        let mirrored = mirrors(m);
        let normal_matrix = normal_matrix(m);
        // pbrt-v4 turns given normals, too, under ReverseOrientation.
        let sign = if s.reverse { -1.0 } else { 1.0 };
        let carry = |n: &DVec3| (normal_matrix * *n).try_normalize().unwrap_or(DVec3::ZERO) * sign;
        let positions: Vec<DVec3> = mesh
            .positions
            .iter()
            .map(|p| m.transform_point3(*p))
            .collect();
        let normals: Vec<DVec3> = mesh.normals.iter().map(carry).collect();
        let turns: Vec<bool> = mesh
            .triangles
            .iter()
            .map(|t| turned(t, &positions, &normals, mirrored != s.reverse))
            .collect();
        // pbrt's default coordinates (0,0) (1,0) (1,1) belong to the corners in the file's order; where the
        // winding turns and the material looks, they have to be written down.
        let spell_uvs = s.uses_uv && mesh.uvs.is_empty() && turns.contains(&true);
        let has_uvs = spell_uvs || !mesh.uvs.is_empty();
        let shape = self.new_shape(s, !mesh.normals.is_empty(), has_uvs);
        let lights = self.mesh_emissions(s, mesh, &positions);
        let base = self.positions.len();
        let added = if spell_uvs {
            3 * mesh.triangles.len()
        } else {
            positions.len()
        };
        // The last index stays free for the spare vertex and for `NONE`.
        if base + added >= NONE as usize - 1 {
            return Err(SceneError::value(&s.at, "too many vertices")
                .found(base + added)
                .expected("fewer than 2³² − 2"));
        }
        let base = base as u32;
        let normal = |i: u32| normals.get(i as usize).map_or(Vec3::ZERO, |n| n.as_vec3());
        if spell_uvs {
            for (k, t) in mesh.triangles.iter().enumerate() {
                for (c, &i) in t.iter().enumerate() {
                    self.positions.push(positions[i as usize]);
                    self.normals.push(normal(i));
                    self.uvs.push([Vec2::ZERO, Vec2::X, Vec2::ONE][c]);
                }
                let b = base + 3 * k as u32;
                self.triangles.push(wind([b, b + 1, b + 2], turns[k]));
            }
        } else {
            for i in 0..positions.len() as u32 {
                self.normals.push(normal(i));
                let uv = mesh.uvs.get(i as usize);
                self.uvs.push(uv.copied().unwrap_or(Vec2::ZERO));
            }
            self.positions.extend(positions);
            for (t, &turn) in mesh.triangles.iter().zip(&turns) {
                self.triangles.push(wind(t.map(|i| base + i), turn));
            }
        }
        let owners =
            (0..mesh.triangles.len()).map(|k| (shape, lights.get(k).copied().unwrap_or(NONE)));
        self.triangle_owner.extend(owners);
        Ok(())
    }

    /// The emission of each triangle; empty if the mesh is dark.
    fn mesh_emissions(&mut self, s: &Placeable, mesh: &Mesh, positions: &[DVec3]) -> Vec<u32> {
        if s.area_light.is_none() {
            return Vec::new();
        }
        let areas: Vec<f64> = mesh.triangles.iter().map(|t| area(t, positions)).collect();
        if mesh.parts.is_empty() {
            return areas.iter().map(|&a| self.emission(s, a)).collect();
        }
        let count = mesh.parts.iter().max().map_or(0, |m| *m as usize + 1);
        let mut totals = vec![0.0; count];
        for (&part, a) in mesh.parts.iter().zip(&areas) {
            totals[part as usize] += a;
        }
        let of_part: Vec<u32> = totals.iter().map(|&a| self.emission(s, a)).collect();
        mesh.parts.iter().map(|&p| of_part[p as usize]).collect()
    }
}

fn cross(t: &[u32; 3], positions: &[DVec3]) -> DVec3 {
    let [a, b, c] = t.map(|i| positions[i as usize]);
    (b - a).cross(c - a)
}

fn area(t: &[u32; 3], positions: &[DVec3]) -> f64 {
    0.5 * cross(t, positions).length()
}

/// The winding has to be turned so that the cross product is pbrt's outside: on the side of the given normals,
/// else the object-space side carried along, the other one under ReverseOrientation.
fn turned(t: &[u32; 3], positions: &[DVec3], normals: &[DVec3], flip: bool) -> bool {
    if normals.is_empty() {
        return flip;
    }
    // pbrt decides per hit point; the sum of the corners decides here once for the triangle.
    let n: DVec3 = t.iter().map(|&i| normals[i as usize]).sum();
    let side = cross(t, positions).dot(n);
    if side == 0.0 { flip } else { side < 0.0 }
}

fn wind([a, b, c]: [u32; 3], turn: bool) -> [u32; 3] {
    if turn { [a, c, b] } else { [a, b, c] }
}
