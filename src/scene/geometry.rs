//! Primitives of the world or of an object, numbered 0.. : triangles first, then quadrics.

use super::{Instance, PrimId};
use glam::{Mat3, Vec2, Vec3};
use std::sync::OnceLock;

/// "No such thing" in index fields.
pub const NONE: u32 = u32::MAX;

/// Longest edge over the height on it from which a triangle is a sliver: a test in f32 cannot tell on which side of it a
/// point is. docs/faults.md derives it.
pub const SLIVER: f64 = 1e3;

/// What a primitive belongs to: one pbrt `Shape` directive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Index into `Scene::materials`; [`NONE`] is pbrt's interface (no surface).
    pub material: u32,
    /// Per-vertex normals are given.
    pub has_normals: bool,
    /// Per-vertex texture coordinates are given.
    pub has_uvs: bool,
}

/// An exact curved primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quadric {
    /// A full sphere.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius > 0.
        radius: f32,
        /// Rotation world → object, for texture coordinates.
        to_object: Mat3,
        /// Geometric normal points inward.
        inward: bool,
    },
    /// A full disk.
    Disk {
        /// Centre.
        center: Vec3,
        /// Unit geometric normal (the emitting side).
        normal: Vec3,
        /// Unit vector in the plane where the angle φ is 0.
        tangent: Vec3,
        /// Radius > 0.
        radius: f32,
    },
}

/// All primitives of a scene in world space, and its objects with the places where they stand; or the primitives of one
/// object in a space of its own.
///
/// Primitive `i < triangles.len()` is a triangle; the others are `quadrics[i - triangles.len()]`.
/// A triangle's geometric normal is `(p1−p0)×(p2−p0)`: the loader has already turned the winding so that this
/// is the side pbrt-v4 would call outside.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Vertex positions. One spare vertex stands at the end so that 16-byte loads of the last stay inside.
    pub positions: Vec<Vec3>,
    /// Vertex normals, parallel to `positions`; empty if no shape has them.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, parallel to `positions`; empty if no shape has them.
    pub uvs: Vec<Vec2>,
    /// Vertex indices.
    pub triangles: Vec<[u32; 3]>,
    /// Curved primitives.
    pub quadrics: Vec<Quadric>,
    /// Shape of each primitive.
    pub prim_shape: Vec<u32>,
    /// Light of each primitive, or [`NONE`].
    pub prim_light: Vec<u32>,
    /// Shapes.
    pub shapes: Vec<Shape>,
    /// Objects, each in its own space; they have no objects in turn, and no lights.
    pub objects: Vec<Geometry>,
    /// Where objects stand.
    pub instances: Vec<Instance>,
    /// Rays leave out the slivers that they start on and end on: a plan says so where there are any.
    pub leave_out: bool,
    /// What a hit on a triangle asks for, gathered; a backend fills it when built.
    pub facets: OnceLock<Vec<Facet>>,
}

/// A triangle with everything that a hit on it asks for, in one cache line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Facet {
    /// Its corners.
    pub corners: [Vec3; 3],
    /// Unit geometric normal.
    pub ng: Vec3,
    /// How far an origin must stand off the plane, beside the error of its own coordinates.
    pub stand_off: f32,
    /// Index into [`Geometry::shapes`].
    pub shape: u32,
    /// Light, or [`NONE`].
    pub light: u32,
    /// [`Geometry::is_sliver`].
    pub sliver: bool,
}

const _: () = assert!(size_of::<Facet>() == 64);

impl Geometry {
    /// Number of primitives.
    pub fn prim_count(&self) -> usize {
        self.triangles.len() + self.quadrics.len()
    }

    /// The three corners of triangle `prim`.
    #[inline]
    pub fn corners(&self, prim: u32) -> [Vec3; 3] {
        let [a, b, c] = self.triangles[prim as usize];
        [
            self.positions[a as usize],
            self.positions[b as usize],
            self.positions[c as usize],
        ]
    }

    /// The quadric behind primitive `prim`, or `None` for a triangle.
    #[inline]
    pub fn quadric(&self, prim: u32) -> Option<&Quadric> {
        (prim as usize)
            .checked_sub(self.triangles.len())
            .map(|i| &self.quadrics[i])
    }

    /// A triangle, of the world or of an instance.
    pub fn is_triangle(&self, id: PrimId) -> bool {
        let (_, part, prim) = self.resolve(id);
        (prim as usize) < part.triangles.len()
    }

    /// Triangle `prim` is beyond [`SLIVER`].
    pub fn is_sliver(&self, prim: u32) -> bool {
        self.aspect_squared(prim) > SLIVER * SLIVER
    }

    /// Longest edge over the height on it, of triangle `prim`, squared.
    pub fn aspect_squared(&self, prim: u32) -> f64 {
        let [a, b, c] = self.corners(prim).map(|p| p.as_dvec3());
        let edges = [b - a, c - b, a - c].map(|e| e.length_squared());
        let longest = edges.into_iter().fold(0.0, f64::max);
        longest * longest / (b - a).cross(c - a).length_squared()
    }

    /// Surface area of a primitive in squared scene units.
    pub fn area(&self, prim: u32) -> f64 {
        match self.quadric(prim) {
            None => {
                let [a, b, c] = self.corners(prim).map(|p| p.as_dvec3());
                0.5 * (b - a).cross(c - a).length()
            }
            Some(Quadric::Sphere { radius, .. }) => {
                4.0 * std::f64::consts::PI * (*radius as f64).powi(2)
            }
            Some(Quadric::Disk { radius, .. }) => std::f64::consts::PI * (*radius as f64).powi(2),
        }
    }

    /// Axis-aligned bounds of a primitive.
    pub fn prim_bounds(&self, prim: u32) -> (Vec3, Vec3) {
        match self.quadric(prim) {
            None => {
                let [a, b, c] = self.corners(prim);
                (a.min(b).min(c), a.max(b).max(c))
            }
            Some(Quadric::Sphere { center, radius, .. }) => (*center - *radius, *center + *radius),
            Some(Quadric::Disk {
                center,
                normal,
                radius,
                ..
            }) => {
                let e = (Vec3::ONE - *normal * *normal)
                    .max(Vec3::ZERO)
                    .map(f32::sqrt)
                    * *radius
                    * (1.0 + 4.0 * f32::EPSILON);
                (*center - e, *center + e)
            }
        }
    }

    /// A box around everything, instances too; `None` when there is nothing.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let objects: Vec<_> = self.objects.iter().map(Self::bounds).collect();
        let own = (0..self.prim_count() as u32).map(|p| self.prim_bounds(p));
        let placed = self.instances.iter().filter_map(|i| {
            let (lo, hi) = i.bounds(objects[i.object as usize]?);
            Some((lo.as_vec3(), hi.as_vec3()))
        });
        own.chain(placed)
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// Centre and radius of a sphere around everything; (0, tiny) when there is nothing.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        let Some((lo, hi)) = self.bounds() else {
            return (Vec3::ZERO, f32::MIN_POSITIVE);
        };
        let c = 0.5 * (lo + hi);
        (c, ((hi - c).length() * (1.0 + 1e-5)).max(f32::MIN_POSITIVE))
    }
}
