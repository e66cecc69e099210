//! Objects that stand in several places: geometry once, in a space of its own, and a transform for each place.

use super::{Geometry, Shape};
use glam::{DAffine3, DMat3, DVec3, Mat3, Vec3};
use std::fmt;

/// A primitive as a ray meets it: its number in the world, or an instance and the number in its object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PrimId(u64);

/// Most instances of a scene: their numbers fit three bytes of a path's vertex.
pub const MOST_INSTANCES: u32 = (1 << 24) - 1;

impl PrimId {
    /// No primitive.
    pub const NONE: Self = Self(u64::MAX);

    /// Primitive `prim` of the world.
    #[inline]
    pub const fn of(prim: u32) -> Self {
        Self(prim as u64)
    }

    /// Primitive `prim` of the object that stands as instance `instance` (below 2³² − 1).
    #[inline]
    pub const fn through(instance: u32, prim: u32) -> Self {
        Self((instance as u64 + 1) << 32 | prim as u64)
    }

    /// From what [`Self::raw`] gave.
    #[inline]
    pub const fn from_raw(raw: u64) -> Self {
        Self(raw)
    }

    /// The number as a backend in C writes it: primitives of the world by themselves, those of instance i with i + 1 in
    /// the upper half.
    #[inline]
    pub const fn raw(self) -> u64 {
        self.0
    }

    /// Index among the primitives of the world; beyond all of them for one of an instance.
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// The number in the world or in the object.
    #[inline]
    pub const fn prim(self) -> u32 {
        self.0 as u32
    }

    /// The instance, unless the primitive stands in the world itself.
    #[inline]
    pub const fn instance(self) -> Option<u32> {
        match (self.0 >> 32) as u32 {
            0 => None,
            i => Some(i - 1),
        }
    }
}

const _: () = assert!(usize::BITS == 64, "PrimId::index needs 64 bits");

impl PartialEq<u32> for PrimId {
    fn eq(&self, prim: &u32) -> bool {
        *self == Self::of(*prim)
    }
}

impl fmt::Display for PrimId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.instance() {
            None => write!(f, "primitive {}", self.prim()),
            Some(i) => write!(f, "primitive {} of instance {i}", self.prim()),
        }
    }
}

/// A place where an object stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Geometry::objects`].
    pub object: u32,
    /// Linear part of the map from the object's space to the world.
    pub linear: Mat3,
    /// Where that map puts the origin of the object's space.
    pub translation: Vec3,
    /// How far off a ray is in the world, in each coordinate, after f32 has carried it into the object's space: see
    /// [`Self::new`].
    pub error: f32,
    /// How far off a plane test in the object's space is for a ray across the whole scene, in units of that space.
    pub stretch: f32,
}

impl Instance {
    /// An object that reaches `radius` world units from its origin, in a scene whose coordinates, those of camera and
    /// lamps too, are at most `reach`. `None` if f32 cannot carry rays into the object's space, where the transform is so
    /// skewed or so small that nothing would be left of their digits.
    ///
    /// Let A be the linear part, W its inverse, b the translation, u = 2⁻²⁴, and |·| of a matrix or vector that of its
    /// entries. A backend in f32 makes W from cofactors: each is a difference of two products, so off by 2u of the sum
    /// W⁺·|det| of their magnitudes; the determinant by 5u·ρ with ρ the ratio of its sum of magnitudes to itself; the
    /// reciprocal and the product with it by 4u: |ΔW| ≤ (6 + 5ρ)u·W⁺. It makes w = −W·b, off by 3u·W⁺|b| more, and
    /// carries a ray o + t·d as W·o + w (4u·W⁺(|o| + |b|)) and W·d (3u·W⁺|d|). The same W is in both terms of the
    /// origin, so ΔW moves a point x of the ray by ΔW·(x − b), where x lies on the object: |x − b| ≤ `radius`. With
    /// |o| ≤ reach and |t·d| ≤ 2·reach, back in the world
    ///
    /// > |Δx| ≤ u·|A|·W⁺·((6 + 5ρ)·radius + 7|b| + 10·reach).
    ///
    /// `stretch` is 8u of a ray's length in the object's space, ‖W‖·2·reach, the part of a plane test's rounding that
    /// grows with that length and that a visibility test between two points allows for in the world's measure only.
    pub fn new(object: u32, to_world: &DAffine3, radius: f64, reach: f64) -> Option<Self> {
        let linear = to_world.matrix3.as_mat3();
        let translation = to_world.translation.as_vec3();
        let m = Measure::of(&linear.as_dmat3());
        let fits = Self::carries(&to_world.matrix3) && translation.is_finite();
        if !fits || m.shrink * reach > COORDINATE_MOST {
            return None;
        }
        let u = 2f64.powi(-24);
        let b = translation.abs().max_element() as f64;
        let error = u * m.gain * ((6.0 + 5.0 * m.rho) * radius + 7.0 * b + 10.0 * reach);
        Some(Self {
            object,
            linear,
            translation,
            error: error as f32,
            stretch: (16.0 * u * reach * m.shrink) as f32,
        })
    }

    /// F32 can carry rays through a map with this linear part.
    pub fn carries(linear: &DMat3) -> bool {
        let linear = linear.as_mat3();
        let m = Measure::of(&linear.as_dmat3());
        let sound = (DET_LEAST..=1.0 / DET_LEAST).contains(&m.det);
        linear.is_finite() && sound && m.gain * m.rho < GAIN_MOST
    }

    /// The map from the object's space to the world. What stands in the world is this applied without any rounding.
    #[inline]
    pub fn to_world(&self) -> DAffine3 {
        DAffine3 {
            matrix3: self.linear.as_dmat3(),
            translation: self.translation.as_dvec3(),
        }
    }

    /// Cofactors of the linear part, which turn normals, and its determinant, whose sign says which way:
    /// A⁻ᵀ = cofactors / determinant.
    #[inline]
    pub fn cofactors(&self) -> (DMat3, f64) {
        cofactors(&self.linear.as_dmat3())
    }

    /// In the object's space, how far f32 may put off, in each coordinate, a point of a ray that begins within `near` of
    /// the world's origin and is met after `length`: the bound of [`Self::new`] before it is brought back, for any ray.
    pub fn carried(&self, near: f64, length: f64) -> f64 {
        let m = Measure::of(&self.linear.as_dmat3());
        let b = self.translation.abs().max_element() as f64;
        2f64.powi(-24) * m.rows * (13.0 + 5.0 * m.rho) * (near + b + length)
    }

    /// Mirrors left and right.
    pub fn mirrors(&self) -> bool {
        self.cofactors().1 < 0.0
    }

    /// A box in the world that holds the object's box.
    pub fn bounds(&self, (lo, hi): (Vec3, Vec3)) -> (DVec3, DVec3) {
        let (c, e) = ((lo + hi).as_dvec3() * 0.5, (hi - lo).as_dvec3() * 0.5);
        let m = self.to_world();
        let (c, e) = (m.transform_point3(c), absolute(&m.matrix3) * e);
        (c - e, c + e)
    }
}

/// Least and, inverted, largest determinant that f32 is trusted with: its cofactors and their sums have room beside it.
const DET_LEAST: f64 = 1e-30;
/// Largest growth of roundings by |A|·W⁺ and ρ; 2⁻²⁴ of it is still a thousandth.
const GAIN_MOST: f64 = 1e3;
/// Largest coordinate of a ray in an object's space; beyond 1.8·10¹⁸ Embree leaves things out.
const COORDINATE_MOST: f64 = 1e17;

/// What roundings do in a matrix and its inverse.
struct Measure {
    /// |det|.
    det: f64,
    /// ρ: the sum of magnitudes behind the determinant over it.
    rho: f64,
    /// Largest row sum of W⁺.
    rows: f64,
    /// Largest row sum of |A|·W⁺.
    gain: f64,
    /// Bound on ‖W‖: √(‖W‖₁·‖W‖∞).
    shrink: f64,
}

impl Measure {
    fn of(a: &DMat3) -> Self {
        let magnitudes = absolute(a);
        let [x, y, z] = [magnitudes.x_axis, magnitudes.y_axis, magnitudes.z_axis];
        let plus = |a: DVec3, b: DVec3| {
            DVec3::new(
                a.y * b.z + a.z * b.y,
                a.z * b.x + a.x * b.z,
                a.x * b.y + a.y * b.x,
            )
        };
        let (cof, det) = cofactors(a);
        let det = det.abs();
        let cof_plus = DMat3::from_cols(plus(y, z), plus(z, x), plus(x, y));
        // W = cofᵀ / det.
        let (w_plus, w) = (
            cof_plus.transpose() * (1.0 / det),
            absolute(&cof).transpose() * (1.0 / det),
        );
        let rows = |m: DMat3| (m * DVec3::ONE).max_element();
        Self {
            det,
            rho: x.dot(cof_plus.x_axis) / det,
            rows: rows(w_plus),
            gain: rows(magnitudes * w_plus),
            shrink: (rows(w) * rows(w.transpose())).sqrt(),
        }
    }
}

fn cofactors(a: &DMat3) -> (DMat3, f64) {
    let [x, y, z] = [a.x_axis, a.y_axis, a.z_axis];
    let cof = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    (cof, x.dot(cof.x_axis))
}

fn absolute(m: &DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

impl Geometry {
    /// The instance through which a primitive is seen, if any, the geometry it is part of, and its number there.
    #[inline]
    pub fn resolve(&self, id: PrimId) -> (Option<&Instance>, &Self, u32) {
        match id.instance() {
            None => (None, self, id.prim()),
            Some(i) => {
                let instance = &self.instances[i as usize];
                let object = &self.objects[instance.object as usize];
                (Some(instance), object, id.prim())
            }
        }
    }

    /// The material of a primitive and its light, each [`super::NONE`] if it has none.
    pub fn finish(&self, id: PrimId) -> (u32, u32) {
        let (_, part, prim) = self.resolve(id);
        let shape = part.prim_shape[prim as usize];
        let material = part.shapes[shape as usize].material;
        (material, part.prim_light[prim as usize])
    }

    /// This geometry and those of its objects.
    pub fn parts(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.objects)
    }

    /// The shapes of this geometry and of its objects, to be changed.
    pub fn shapes_mut(&mut self) -> impl Iterator<Item = &mut Shape> {
        let of_objects = self.objects.iter_mut().flat_map(|o| &mut o.shapes);
        self.shapes.iter_mut().chain(of_objects)
    }

    /// Triangles that are kept, of the world and of objects.
    pub fn triangle_count(&self) -> usize {
        self.parts().map(|p| p.triangles.len()).sum()
    }

    /// How often each object stands in the world.
    pub fn uses(&self) -> Vec<usize> {
        let mut uses = vec![0; self.objects.len()];
        for i in &self.instances {
            uses[i.object as usize] += 1;
        }
        uses
    }

    /// Primitives as if every instance had its own.
    pub fn flat_count(&self) -> u64 {
        let of = |(o, n): (&Self, usize)| o.prim_count() as u64 * n as u64;
        let instanced: u64 = self.objects.iter().zip(self.uses()).map(of).sum();
        self.prim_count() as u64 + instanced
    }
}
