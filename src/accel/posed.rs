//! Primitives of instances: the canonical hit on them and the surface there.
//!
//! A backend carries the ray into the object's space and names a primitive. What stands in the world is the object's
//! f32 corners under the instance's f32 map, exactly; here that is worked out in f64, whose roundings are nothing beside
//! the one of the result, so a point is off by that one alone and both backends give the same bits.

use super::normal::{facing, normal};
use super::quadric;
use super::surface::{Surface, dpdu, facets, gamma, quadric_surface};
use super::triangle::sheared;
use super::{Hit, OwnRay};
use crate::real::{Convert, Real, Vec2, Vec3};
use crate::scene::{Geometry, Instance, PrimId, Quadric};
use glam::{DAffine3, DMat3, DVec3};

/// The corners of a triangle of an object, in the world.
#[inline]
fn corners(instance: &Instance, object: &Geometry, prim: u32) -> [DVec3; 3] {
    let m = instance.to_world();
    let facet = &facets(object)[prim as usize];
    facet.corners.map(|p| m.transform_point3(p.double()))
}

/// As [`super::canonical::recompute`], for a primitive of an instance.
#[inline(never)]
pub fn recompute(geometry: &Geometry, id: PrimId, ray: &OwnRay) -> Hit {
    let (Some(instance), object, prim) = geometry.resolve(id) else {
        unreachable!("only asked for primitives of instances")
    };
    let hit = |t: Real, b1: Real, b2: Real, clamped| Hit {
        prim: id,
        t,
        b1,
        b2,
        clamped,
    };
    match object.quadric(prim) {
        None => {
            let corners = corners(instance, object, prim);
            match inside(corners, ray) {
                Some([t, b1, b2]) => hit(t, b1, b2, false),
                None => {
                    let h = sheared(ray).nearest_point(&corners.map(|p| p.as_vec3()));
                    hit(h.t.real(), h.b1.real(), h.b2.real(), true)
                }
            }
        }
        Some(q) => {
            let (o, d) = carried(instance, ray);
            let (t, clamped) = quadric::on_line(q, o, d);
            hit(t as Real, 0.0, 0.0, clamped)
        }
    }
}

/// A ray in an instance's space, in f64; distances along it stay.
fn carried(instance: &Instance, ray: &OwnRay) -> (DVec3, DVec3) {
    let inverse = instance.linear.double().inverse();
    let o = ray.o.double() - instance.translation.double();
    (inverse * o, inverse * ray.d.double())
}

/// Möller and Trumbore's test in f64; `None` outside.
#[inline]
fn inside([p0, p1, p2]: [DVec3; 3], ray: &OwnRay) -> Option<[Real; 3]> {
    let d = ray.d.double();
    let (a, b, o) = (p1 - p0, p2 - p0, ray.o.double() - p0);
    let n = d.cross(b);
    let m = o.cross(a);
    let inverse = 1.0 / a.dot(n);
    let (b1, b2) = (o.dot(n) * inverse, d.dot(m) * inverse);
    let t = (b.dot(m) * inverse) as Real;
    (b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0 && t.is_finite())
        .then_some([t, b1 as Real, b2 as Real])
}

/// As [`super::surface::surface`], for a primitive of an instance.
#[inline(never)]
pub fn surface(geometry: &Geometry, hit: &Hit, ray: &OwnRay) -> Surface {
    let (Some(instance), object, prim) = geometry.resolve(hit.prim) else {
        unreachable!("only asked for primitives of instances")
    };
    match object.quadric(prim) {
        None => on_triangle(instance, object, prim, hit.b1, hit.b2),
        Some(q) => {
            let (o, d) = carried(instance, ray);
            on_quadric(instance, q, quadric::place(q, o + d * hit.t as f64))
        }
    }
}

/// As [`super::surface::surface_again`], for a primitive of an instance.
pub fn surface_again(geometry: &Geometry, id: PrimId, at: Vec2) -> Surface {
    let (Some(instance), object, prim) = geometry.resolve(id) else {
        unreachable!("only asked for primitives of instances")
    };
    match object.quadric(prim) {
        None => on_triangle(instance, object, prim, at.x, at.y),
        Some(q) => on_quadric(instance, q, at),
    }
}

/// Roundings of a point of which each coordinate was rounded once: that one, and two of an origin moved off it.
fn rounding(p: Vec3) -> Real {
    gamma(4) * p.abs().max_element()
}

fn on_triangle(instance: &Instance, object: &Geometry, prim: u32, b1: Real, b2: Real) -> Surface {
    let [p0, p1, p2] = corners(instance, object, prim);
    let facet = &facets(object)[prim as usize];
    let [w1, w2] = [b1 as f64, b2 as f64];
    let p = (p0 * (1.0 - w1 - w2) + p1 * w1 + p2 * w2).real();
    let turn = Turn::new(instance);
    let (ng, narrow) = turn.normal(normal(facet));

    let shape = &object.shapes[facet.shape as usize];
    let indices = || object.triangles[prim as usize].map(|i| i as usize);
    let ns = if shape.has_normals {
        // Each corner's own normal is turned, so that they meet as they do where the object is put into the world.
        let [n0, n1, n2] = indices().map(|i| turn.unit(object.normals[i].real()));
        facing(n0 * (1.0 - b1 - b2) + n1 * b1 + n2 * b2, ng)
    } else {
        ng
    };
    let uv = if shape.has_uvs {
        let [t0, t1, t2] = indices().map(|i| object.uvs[i].real());
        t0 * (1.0 - b1 - b2) + t1 * b1 + t2 * b2
    } else {
        Vec2::new(b1 + b2, b2)
    };
    Surface {
        p,
        error: rounding(p)
            + instance.error.real()
            + (facet.stand_off + instance.stretch).real() * narrow,
        ng,
        ns,
        uv,
        at: Vec2::new(b1, b2),
    }
}

/// At a [`quadric::place`] in the object's space.
fn on_quadric(instance: &Instance, q: &Quadric, at: Vec2) -> Surface {
    let s = quadric_surface(q, at);
    let (exact, _) = quadric::point(q, at);
    let p = instance.to_world().transform_point3(exact).real();
    let (ng, _) = Turn::new(instance).normal(s.ng);
    Surface {
        p,
        error: rounding(p) + instance.error.real(),
        ng,
        ns: ng,
        ..s
    }
}

/// As [`dpdu`], for a primitive of an instance: tangents go as differences of points do.
#[cold]
pub fn dpdu_through(geometry: &Geometry, id: PrimId, s: &Surface) -> Vec3 {
    let (Some(instance), object, prim) = geometry.resolve(id) else {
        unreachable!("only asked for primitives of instances")
    };
    let ng = match facets(object).get(prim as usize) {
        Some(f) => normal(f),
        None => s.ng,
    };
    let inverse: DAffine3 = instance.to_world().inverse();
    let there = Surface {
        p: inverse.transform_point3(s.p.double()).real(),
        ng,
        ..*s
    };
    instance.linear.real() * dpdu(object, PrimId::of(prim), &there)
}

/// How normals go through an instance.
struct Turn {
    /// Cofactors with the sign of the determinant.
    cofactors: DMat3,
    /// Its magnitude.
    det: f64,
}

impl Turn {
    #[inline]
    fn new(instance: &Instance) -> Self {
        let (cofactors, det) = instance.cofactors();
        Self {
            cofactors: cofactors * 1f64.copysign(det),
            det: det.abs(),
        }
    }

    /// The unit normal in the world, and how many times as far apart there planes across it are: 1/|A⁻ᵀn|.
    #[inline]
    fn normal(&self, n: Vec3) -> (Vec3, Real) {
        let n = self.cofactors * n.double();
        let inverse = n.length().recip();
        ((n * inverse).real(), (self.det * inverse) as Real)
    }

    /// The same without the factor; 0 stays 0.
    #[inline]
    fn unit(&self, n: Vec3) -> Vec3 {
        let n = self.cofactors * n.double();
        n.normalize_or_zero().real()
    }
}
