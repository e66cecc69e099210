//! Which of the faces around an edge a ray meets that passes it within the roundings.
//!
//! Each backend tells sides of an edge in arithmetic of its own, so one may name the face on this side and the other that
//! on the far side. The shared routine, for which neighbours compute the same edge function, decides between them, and
//! both backends then give the same hit.

use super::surface::{ROUNDOFF, facets};
use super::triangle::sheared;
use super::{Hit, OwnRay};
use crate::real::{Convert, Real};
use crate::scene::{Geometry, PrimId};

/// Roundings of the largest coordinate that any test of a side may be off by; see `referee.rs`.
const ROUNDINGS: Real = 16.0;
/// How far beside the ray a neighbour is looked for, in such bounds: the second for faces named from still farther off.
const STEPS: [Real; 2] = [1.0, 8.0];

/// The hit on a face that touches `of`, where a backend named `of` and the shared routine meets that other one. `None`
/// where there is no such face: at the rim of an open surface, or where what is behind a silhouette is met.
#[cold]
pub fn across(
    geometry: &Geometry,
    ray: &OwnRay,
    of: PrimId,
    nearest: &impl Fn(&OwnRay) -> Option<PrimId>,
) -> Option<Hit> {
    let corners = &facets(geometry).get(of.index())?.corners;
    let shear = sheared(ray);
    let far = corners.iter().map(|p| p.real().abs().max_element());
    let far = far.fold(ray.o.abs().max_element(), Real::max);
    for step in STEPS {
        let aside = ROUNDINGS * step * ROUNDOFF * far;
        for (beyond, way) in shear.ways_out(corners) {
            if beyond < -aside.single() {
                continue;
            }
            let moved = OwnRay {
                o: ray.o + way.real() * aside,
                ..*ray
            };
            let Some(other) = nearest(&moved).filter(|p| *p != of) else {
                continue;
            };
            let Some(facet) = facets(geometry).get(other.index()) else {
                continue;
            };
            if !corners.iter().any(|p| facet.corners.contains(p)) {
                continue;
            }
            if let Some(h) = shear.intersect(&facet.corners)
                && h.t > 0.0
                && h.t.real() < ray.t_max
            {
                return Some(Hit {
                    prim: other,
                    t: h.t.real(),
                    b1: h.b1.real(),
                    b2: h.b2.real(),
                    clamped: false,
                });
            }
        }
    }
    None
}
