//! The closest hit with distance and barycentrics from the shared routine, whatever backend named the primitive.

use super::surface::facets;
use super::triangle::sheared;
use super::{Accel, Hit, OwnRay, Ray, edge, offset_origin, posed, quadric, surface};
use crate::real::{Convert, Real};
use crate::scene::{Facet, Geometry, PrimId};
use glam::Vec3;

/// Most attempts to get past a primitive that lies behind the origin although the backend named it.
const MAX_RETRIES: i32 = 12;

/// Weights nearer than this to an edge are left to the watertight test: in f32 those of [`inside`] are off by some roundings
/// of the coordinates over the height of the triangle, which this covers where that is more than 1/4000 of them. A test
/// in f32 has nothing to add to weights in f64.
const MARGIN: Real = if cfg!(feature = "double") {
    0.0
} else {
    1.0 / 256.0
};

/// The nearest hit along the ray. `Hit::clamped` marks those where backend and shared routine disagree by a rounding;
/// callers count them.
#[inline(always)]
pub fn closest<A: Accel>(accel: &A, ray: &OwnRay) -> Option<Hit> {
    closest_by(accel.geometry(), ray, |ray| accel.nearest(ray))
}

/// The same as if there were not these two triangles; see [`Accel::nearest_but`].
#[cold]
pub fn closest_but<A: Accel>(accel: &A, ray: &OwnRay, but: [PrimId; 2]) -> Option<Hit> {
    closest_by(accel.geometry(), ray, |ray| accel.nearest_but(ray, but))
}

#[inline(always)]
fn closest_by(
    geometry: &Geometry,
    ray: &OwnRay,
    nearest: impl Fn(&Ray) -> Option<PrimId>,
) -> Option<Hit> {
    let prim = asked(&nearest, ray)?;
    let hit = recompute(geometry, prim, ray);
    if hit.t > 0.0 && !hit.clamped {
        Some(hit)
    } else {
        settle(geometry, ray, hit, nearest)
    }
}

/// The primitive of the hit that [`closest`] makes of one that the backend named.
#[cold]
pub fn settled<A: Accel>(accel: &A, ray: &Ray, but: [PrimId; 2], named: PrimId) -> PrimId {
    let (geometry, own) = (accel.geometry(), ray.own());
    let hit = recompute(geometry, named, &own);
    if !hit.clamped {
        return named;
    }
    let nearest = |ray: &Ray| match but {
        [PrimId::NONE, PrimId::NONE] => accel.nearest(ray),
        but => accel.nearest_but(ray, but),
    };
    settle(geometry, &own, hit, nearest).map_or(named, |h| h.prim)
}

/// The hit where the shared routine does not meet what the backend named, or meets it behind the origin.
#[cold]
fn settle(
    geometry: &Geometry,
    ray: &OwnRay,
    hit: Hit,
    nearest: impl Fn(&Ray) -> Option<PrimId>,
) -> Option<Hit> {
    let across = || edge::across(geometry, ray, hit.prim, &|ray| asked(&nearest, ray));
    match hit.clamped.then(across).flatten() {
        Some(neighbour) => Some(neighbour),
        None if hit.t > 0.0 => Some(hit),
        None => step_past(geometry, ray, hit, nearest),
    }
}

/// The backend's answer.
#[inline(always)]
fn asked(nearest: &impl Fn(&Ray) -> Option<PrimId>, ray: &OwnRay) -> Option<PrimId> {
    // Not through a copy of what is f32 already.
    #[cfg(feature = "double")]
    let ray = &ray.single();
    nearest(ray)
}

/// The hit on a named primitive. Its t may be ≤ 0 where a backend's own arithmetic put the surface before an origin
/// that lies beyond it.
#[inline(always)]
pub fn recompute(geometry: &Geometry, prim: PrimId, ray: &OwnRay) -> Hit {
    if let Some(Facet { corners, .. }) = facets(geometry).get(prim.index()) {
        return match inside(corners, ray) {
            Some([t, b1, b2]) => Hit {
                prim,
                t,
                b1,
                b2,
                clamped: false,
            },
            None => on_the_edge(corners, prim, ray),
        };
    }
    if prim.instance().is_some() {
        return posed::recompute(geometry, prim, ray);
    }
    // Backends call the very same function, so `None` means they named it out of its range.
    let t = geometry
        .quadric(prim.prim())
        .and_then(|q| quadric::met(q, ray));
    Hit {
        prim,
        t: t.unwrap_or(0.0),
        b1: 0.0,
        b2: 0.0,
        clamped: false,
    }
}

/// Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", JGT 2(1), 1997. Which triangle is known, so
/// nothing needs to be watertight here; `None` if the ray passes outside, or nearer to an edge than [`MARGIN`].
#[inline(always)]
fn inside([p0, p1, p2]: &[Vec3; 3], ray: &OwnRay) -> Option<[Real; 3]> {
    let [p0, p1, p2] = [p0.real(), p1.real(), p2.real()];
    let (a, b, o) = (p1 - p0, p2 - p0, ray.o - p0);
    let n = ray.d.cross(b);
    let m = o.cross(a);
    let inverse = 1.0 / a.dot(n);
    let (b1, b2) = (o.dot(n) * inverse, ray.d.dot(m) * inverse);
    let t = b.dot(m) * inverse;
    (b1 >= MARGIN && b2 >= MARGIN && b1 + b2 <= 1.0 - MARGIN && t.is_finite())
        .then_some([t, b1, b2])
}

/// The watertight test, and the nearest point where even that says the backend is off by a rounding.
#[cold]
fn on_the_edge(corners: &[Vec3; 3], prim: PrimId, ray: &OwnRay) -> Hit {
    let sheared = sheared(ray);
    let (h, clamped) = match sheared.intersect(corners) {
        Some(h) => (h, false),
        None => (sheared.nearest_point(corners), true),
    };
    Hit {
        prim,
        t: h.t.real(),
        b1: h.b1.real(),
        b2: h.b2.real(),
        clamped,
    }
}

/// The origin lies beyond the surface that the backend named (a needle whose plane f32 cannot tell): asks again from
/// origins moved off that surface by growing multiples of its error bound.
#[cold]
fn step_past(
    geometry: &Geometry,
    ray: &OwnRay,
    mut hit: Hit,
    nearest: impl Fn(&Ray) -> Option<PrimId>,
) -> Option<Hit> {
    for k in 0..MAX_RETRIES {
        let s = surface(geometry, &hit, ray);
        let moved = OwnRay {
            o: offset_origin(ray.o, s.error * Real::from(2u8).powi(k), s.ng, ray.d),
            ..*ray
        };
        let prim = asked(&nearest, &moved)?;
        hit = recompute(geometry, prim, ray);
        if hit.t > 0.0 {
            return Some(hit);
        }
    }
    Some(Hit {
        t: Real::MIN_POSITIVE,
        clamped: true,
        ..hit
    })
}

#[cfg(all(test, not(feature = "double")))]
mod tests {
    use super::super::Ray;
    use super::super::testing::{Rng, soup};
    use super::*;

    /// Names one primitive for some calls, then nothing.
    struct Stubborn<'a>(&'a Geometry, PrimId, std::sync::atomic::AtomicI32);

    impl Accel for Stubborn<'_> {
        fn geometry(&self) -> &Geometry {
            self.0
        }
        fn nearest(&self, _: &Ray) -> Option<PrimId> {
            let left = self.2.fetch_sub(1, std::sync::atomic::Ordering::Relaxed);
            (left > 0).then_some(self.1)
        }
        fn occluded(&self, _: &Ray) -> bool {
            false
        }
        fn nearest_but(&self, ray: &Ray, _: [PrimId; 2]) -> Option<PrimId> {
            self.nearest(ray)
        }
        fn occluded_but(&self, _: &Ray, _: [PrimId; 2]) -> bool {
            false
        }
        fn name(&self) -> String {
            "stubborn".into()
        }
        fn memory_bytes(&self) -> usize {
            0
        }
    }

    #[test]
    fn a_surface_behind_the_origin_is_asked_about_again() {
        let geometry = soup(&mut Rng(1), 1);
        let s = super::super::surface::surface_at(&geometry, 0, 0.3, 0.3);
        let ray = OwnRay {
            o: offset_origin(s.p, s.error, s.ng, s.ng),
            d: s.ng,
            t_max: Real::INFINITY,
        };
        let answer = |calls: i32| closest(&Stubborn(&geometry, PrimId::of(0), calls.into()), &ray);
        assert_eq!(answer(1), None);
        assert_eq!(answer(3), None);
        assert!(answer(1000).expect("gives up with a flag").clamped);
    }

    #[test]
    fn a_primitive_missed_by_a_rounding_is_clamped_to_its_edge() {
        let geometry = soup(&mut Rng(2), 1);
        let [p0, p1, p2] = geometry.corners(0);
        let out = (p0 + p1) * 0.5 + ((p0 + p1) * 0.5 - p2) * 1e-4;
        let ng = (p1 - p0).cross(p2 - p0).normalize();
        let ray = OwnRay {
            o: out + ng,
            d: -ng,
            t_max: Real::INFINITY,
        };
        let hit = recompute(&geometry, PrimId::of(0), &ray);
        assert!(hit.clamped && hit.b2 == 0.0 && (hit.b1 - 0.5).abs() < 0.1);
        let off = surface(&geometry, &hit, &ray).p - out;
        assert!(off.dot(ng).abs() < 1e-6 && off.length() < 1e-3 && off != Vec3::ZERO);
    }
}
