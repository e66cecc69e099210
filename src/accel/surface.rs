//! The surface at a hit: point with error bound, normals, texture coordinates, tangent.
//!
//! The point comes from barycentrics, not from o + t·d: its error does not grow with t (PBRT 6.8.4). Sidedness follows
//! the winding, which the loader has turned to pbrt-v4's outside.

use super::normal::{AnyNormal, facing, normal, plane, unit};
use super::{Hit, OwnRay, posed, quadric};
use crate::real::consts::{PI, TAU};
use crate::real::{Convert, Real, Vec2, Vec3};
use crate::scene::{Facet, Geometry, PrimId, Quadric};
use glam::DVec3;

/// Unit roundoff u = 2⁻²⁴ of f32, in which rays are traced whatever transport counts in.
pub const ROUNDOFF: Real = 0.5 * f32::EPSILON as Real;

/// γ_n = n·u/(1 − n·u): bound on the relative error of n roundings (PBRT 6.8.1, equation 6.19).
#[inline]
pub const fn gamma(n: u32) -> Real {
    n as Real * ROUNDOFF / (1.0 - n as Real * ROUNDOFF)
}

/// Everything a hit needs to know about the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The point, in stored world coordinates.
    pub p: Vec3,
    /// Bound on |p − true| of each coordinate, plus what any backend's plane test may be off at p, plus two roundings
    /// of p, so that an origin moved by this much stays moved when it is rounded.
    pub error: Real,
    /// Unit geometric normal, on the side pbrt-v4 calls outside.
    pub ng: Vec3,
    /// Unit shading normal, on the side of `ng`.
    pub ns: Vec3,
    /// Texture coordinates (pbrt-v4's parametrisation where the scene gives none).
    pub uv: Vec2,
    /// Barycentrics (b1, b2) on a triangle, the two numbers of [`quadric::place`] on a quadric. With the primitive they
    /// say which point this is, to the last bit: see [`surface_again`].
    pub at: Vec2,
}

/// Gathers what hits ask for, once; a backend calls this when it is built.
pub fn prepare(geometry: &Geometry) {
    for part in geometry.parts() {
        facets(part);
    }
}

/// The facets of all triangles.
#[inline(always)]
pub fn facets(geometry: &Geometry) -> &[Facet] {
    geometry.facets.get_or_init(|| gather(geometry))
}

/// A triangle, of the world or of an instance, that is many times as long as high.
#[inline]
pub fn is_sliver(geometry: &Geometry, id: PrimId) -> bool {
    let (_, part, prim) = geometry.resolve(id);
    let facet = facets(part).get(prim as usize);
    facet.is_some_and(|f| f.sliver)
}

#[cold]
fn gather(geometry: &Geometry) -> Vec<Facet> {
    let triangles = 0..geometry.triangles.len();
    triangles
        .map(|t| {
            let corners = geometry.corners(t as u32);
            let (ng, stand_off) = plane(corners);
            Facet {
                corners,
                ng: ng.single(),
                stand_off,
                shape: geometry.prim_shape[t],
                light: geometry.prim_light[t],
                sliver: geometry.is_sliver(t as u32),
            }
        })
        .collect()
}

/// The surface at a hit of `ray`.
#[inline(always)]
pub fn surface(geometry: &Geometry, hit: &Hit, ray: &OwnRay) -> Surface {
    match hit.prim.index().checked_sub(geometry.triangles.len()) {
        None => surface_at(geometry, hit.prim.prim(), hit.b1, hit.b2),
        Some(i) => match geometry.quadrics.get(i) {
            Some(q) => quadric_at(q, ray.o.double() + ray.d.double() * hit.t as f64),
            None => posed::surface(geometry, hit, ray),
        },
    }
}

/// The surface at barycentrics (b1, b2) of triangle `prim`, for points that are sampled rather than hit.
#[inline(always)]
pub fn surface_at(geometry: &Geometry, prim: u32, b1: Real, b2: Real) -> Surface {
    let facet = &facets(geometry)[prim as usize];
    let [p0, p1, p2] = facet.corners.real();
    let b0 = 1.0 - b1 - b2;
    let (q0, q1, q2) = (p0 * b0, p1 * b1, p2 * b2);
    let shape = &geometry.shapes[facet.shape as usize];
    let ng = normal(facet);
    let p = q0 + q1 + q2;
    let rounding = gamma(9) * (q0.abs() + q1.abs() + q2.abs()).max_element();

    let corners = || geometry.triangles[prim as usize].map(|i| i as usize);
    let ns = if shape.has_normals {
        let (n, [i0, i1, i2]) = (&geometry.normals, corners());
        let [n0, n1, n2] = [n[i0].real(), n[i1].real(), n[i2].real()];
        facing(n0 * b0 + n1 * b1 + n2 * b2, ng)
    } else {
        ng
    };
    let uv = if shape.has_uvs {
        let (t, [i0, i1, i2]) = (&geometry.uvs, corners());
        let [t0, t1, t2] = [t[i0].real(), t[i1].real(), t[i2].real()];
        t0 * b0 + t1 * b1 + t2 * b2
    } else {
        // pbrt-v4's default corners (0,0), (1,0), (1,1).
        Vec2::new(b1 + b2, b2)
    };
    Surface {
        p,
        error: rounding + facet.stand_off.real(),
        ng,
        ns,
        uv,
        at: Vec2::new(b1, b2),
    }
}

/// The very surface, bit for bit, of which `at` of primitive `prim` was kept.
pub fn surface_again(geometry: &Geometry, prim: PrimId, at: Vec2) -> Surface {
    if prim.instance().is_some() {
        return posed::surface_again(geometry, prim, at);
    }
    match geometry.quadric(prim.prim()) {
        None => surface_at(geometry, prim.prim(), at.x, at.y),
        Some(q) => quadric_surface(q, at),
    }
}

/// The texture coordinates at `at` of primitive `prim`.
pub fn uv_again(geometry: &Geometry, prim: PrimId, at: Vec2) -> Vec2 {
    let (_, part, prim) = geometry.resolve(prim);
    surface_again(part, PrimId::of(prim), at).uv
}

/// ∂p/∂u at a point of `prim`: not 0, not of unit length, in the plane of the primitive. Apart from [`Surface`] because
/// only anisotropic lobes ask for it.
pub fn dpdu(geometry: &Geometry, prim: PrimId, s: &Surface) -> Vec3 {
    if prim.instance().is_some() {
        return posed::dpdu_through(geometry, prim, s);
    }
    let prim = prim.prim();
    match geometry.quadric(prim) {
        None => {
            let corners = geometry.corners(prim).real();
            let shape = &geometry.shapes[geometry.prim_shape[prim as usize] as usize];
            if shape.has_uvs {
                let uvs =
                    geometry.triangles[prim as usize].map(|i| geometry.uvs[i as usize].real());
                tangent(corners, uvs, s.ng)
            } else {
                nonzero(corners[1] - corners[0], s.ng)
            }
        }
        Some(&Quadric::Sphere {
            center,
            radius,
            to_object,
            ..
        }) => {
            let (center, radius, to_object) = (center.real(), radius.real(), to_object.real());
            let n = to_object * ((s.p - center) / radius);
            let turn = Vec3::new(-n.y, n.x, 0.0) * (TAU * radius);
            let turn = if turn == Vec3::ZERO { Vec3::Y } else { turn };
            // to_object is a rotation: its transpose is its inverse.
            to_object.transpose() * turn
        }
        Some(&Quadric::Disk {
            center,
            normal,
            tangent,
            ..
        }) => {
            let (center, normal, tangent) = (center.real(), normal.real(), tangent.real());
            let (r, bitangent) = (s.p - center, normal.cross(tangent));
            let (x, y) = (r.dot(tangent), r.dot(bitangent));
            nonzero((bitangent * x - tangent * y) * TAU, normal)
        }
    }
}

/// `v`, or some tangent where it is 0.
#[inline]
fn nonzero(v: Vec3, ng: Vec3) -> Vec3 {
    if v == Vec3::ZERO { ng.any_normal() } else { v }
}

/// ∂p/∂u of a triangle with texture coordinates (PBRT 6.5.3).
#[inline]
fn tangent([p0, p1, p2]: [Vec3; 3], [t0, t1, t2]: [Vec2; 3], ng: Vec3) -> Vec3 {
    let (a, b) = (t0 - t2, t1 - t2);
    let det = a.x * b.y - a.y * b.x;
    // The areas of texture space that pbrt-v4 calls degenerate.
    if det.abs() < 1e-9 {
        return ng.any_normal();
    }
    nonzero(((p0 - p2) * b.y - (p1 - p2) * a.y) / det, ng)
}

/// Bound on the error of each coordinate of a point of a quadric: one rounding of each, one of the f64 arithmetic's guard,
/// two of an offset, γ4 of the largest coordinate.
#[inline]
fn quadric_error(q: &Quadric) -> Real {
    let (Quadric::Sphere { center, radius, .. } | Quadric::Disk { center, radius, .. }) = *q;
    gamma(4) * (center.abs().max_element() + radius).real()
}

/// The surface of a quadric at the point nearest to `near`, for points that are sampled rather than hit.
#[inline]
pub fn quadric_at(q: &Quadric, near: DVec3) -> Surface {
    quadric_surface(q, quadric::place(q, near))
}

/// The surface of a quadric at a [`quadric::place`], of which it is a function: nothing else need be kept of a point.
#[inline]
pub(super) fn quadric_surface(q: &Quadric, at: Vec2) -> Surface {
    let (p, outward) = quadric::point(q, at);
    let (ng, uv) = match *q {
        Quadric::Sphere {
            to_object, inward, ..
        } => {
            let n = outward.real();
            (if inward { -n } else { n }, sphere_uv(to_object.real() * n))
        }
        Quadric::Disk { normal, radius, .. } => (
            unit(normal),
            Vec2::new(angle(at.x, at.y) / TAU, 1.0 - at.length() / radius.real()),
        ),
    };
    Surface {
        p: p.real(),
        error: quadric_error(q),
        ng,
        ns: ng,
        uv,
        at,
    }
}

/// pbrt-v4's (u, v) on a full sphere in the direction `n` of object space: u = φ/2π, v from 0 at the pole −z to 1 at +z.
#[inline]
fn sphere_uv(n: Vec3) -> Vec2 {
    let v = 1.0 - n.z.clamp(-1.0, 1.0).acos() / PI;
    Vec2::new(angle(n.x, n.y) / TAU, v)
}

/// Polar angle in [0, 2π).
#[inline]
fn angle(x: Real, y: Real) -> Real {
    let phi = y.atan2(x);
    if phi < 0.0 { phi + TAU } else { phi }
}

#[cfg(all(test, not(feature = "double")))]
mod tests {
    use super::super::testing::{Rng, geometry, soup};
    use super::*;
    use crate::real::Mat3;

    fn close(a: Vec3, b: Vec3) -> bool {
        (a - b).abs().max_element() < 1e-5
    }

    #[test]
    fn the_tangent_says_how_the_point_moves_with_u() {
        let mut rng = Rng(21);
        for given in [false, true] {
            let mut g = soup(&mut rng, 1);
            g.shapes[0].has_uvs = given;
            g.uvs = (0..4).map(|_| Vec2::new(rng.next(), rng.next())).collect();
            let [p0, p1, p2] = g.corners(0);
            let at = |b1, b2| surface_at(&g, 0, b1, b2);
            // From any corner to another: Δp = ∂p/∂u·Δu + ∂p/∂v·Δv, and v is eliminated between two of them.
            let [s0, s1, s2] = [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)];
            let (a, b) = (s1.uv - s0.uv, s2.uv - s0.uv);
            let by_v = (p1 - p0) * b.y - (p2 - p0) * a.y;
            let det = a.x * b.y - a.y * b.x;
            assert!(
                close(dpdu(&g, PrimId::of(0), &s0) * det, by_v),
                "{given}: {s0:?}"
            );
        }
    }

    #[test]
    fn shading_normals_are_unit_and_on_the_side_of_the_winding() {
        let mut g = geometry(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]], vec![]);
        g.shapes[0].has_normals = true;
        let n = Vec3::new(0.3, 0.1, -2.0);
        g.normals = vec![n; 4];
        let s = surface_at(&g, 0, 0.2, 0.2);
        assert_eq!(s.ng, Vec3::Z);
        assert!(close(s.ns, -n.normalize()));
        // Normals that cancel leave the geometric one.
        g.normals = vec![Vec3::ZERO; 4];
        assert_eq!(surface_at(&g, 0, 0.2, 0.2).ns, Vec3::Z);
    }

    #[test]
    fn a_triangle_without_area_has_a_finite_frame() {
        let g = geometry(vec![Vec3::ZERO, Vec3::X, Vec3::X], vec![[0, 1, 2]], vec![]);
        let s = surface_at(&g, 0, 0.2, 0.2);
        assert!(s.ng.is_normalized() && s.ng.x.abs() < 1e-6 && s.error.is_finite());
    }

    #[test]
    fn spheres_and_disks_are_parametrised_as_in_pbrt() {
        // Object z is world x.
        let to_object = Mat3::from_cols(Vec3::Z, Vec3::X, Vec3::Y);
        let sphere = |inward| Quadric::Sphere {
            center: Vec3::ONE,
            radius: 2.0,
            to_object,
            inward,
        };
        // Object direction (cos 45°, sin 45°, 0): u = 1/8, v = 1/2.
        let n = to_object.transpose() * Vec3::new(1.0, 1.0, 0.0).normalize();
        let s = quadric_at(&sphere(false), (Vec3::ONE + n * 1.9).double());
        assert!(close(s.p, Vec3::ONE + n * 2.0) && close(s.ng, n));
        assert!((s.uv - Vec2::new(0.125, 0.5)).length() < 1e-6, "{s:?}");
        let turn = to_object.transpose() * Vec3::new(-1.0, 1.0, 0.0).normalize();
        let along_u =
            |q: Quadric, s: &Surface| dpdu(&geometry(vec![], vec![], vec![q]), PrimId::of(0), s);
        assert!(close(along_u(sphere(false), &s), turn * (2.0 * TAU)));
        let inward = quadric_at(&sphere(true), (Vec3::ONE + n).double());
        assert!(close(inward.ng, -n) && close(inward.p, s.p));
        let pole = quadric_at(&sphere(false), (Vec3::ONE + Vec3::X).double());
        assert!((pole.uv.y - 1.0).abs() < 1e-6 && along_u(sphere(false), &pole) != Vec3::ZERO);

        let disk = Quadric::Disk {
            center: Vec3::ONE,
            normal: Vec3::Z,
            tangent: Vec3::X,
            radius: 2.0,
        };
        let s = quadric_at(&disk, DVec3::new(1.0, 2.0, 1.5));
        assert!(close(s.p, Vec3::new(1.0, 2.0, 1.0)) && s.ng == Vec3::Z);
        assert!((s.uv - Vec2::new(0.25, 0.5)).length() < 1e-6, "{s:?}");
        assert!(close(along_u(disk, &s), Vec3::NEG_X * TAU));
    }
}
