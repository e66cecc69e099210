//! Rays that leave surfaces, and visibility between points on them.
//!
//! Origins move off a surface by the error bound of the point (PBRT 6.8.6), never by a length in scene units: a scene
//! scaled by 10⁻⁶ … 10⁶ is traced the same.

use super::surface::{ROUNDOFF, Surface};
use super::{Accel, OwnRay, Ray};
use crate::real::{Convert, Real, Vec3};
use crate::scene::PrimId;

/// A point moved off its surface to the side that `direction` points to: far enough along the normal to leave the box
/// of half width `error` around it. A normal of 0 moves nothing.
///
/// [`Surface::error`] holds room for the rounding of the sum, so there is no need to go on to the next float.
#[inline]
pub fn offset_origin(p: Vec3, error: Real, ng: Vec3, direction: Vec3) -> Vec3 {
    // The factor covers the roundings of the distance itself.
    let distance = error * (1.0 + 16.0 * ROUNDOFF) * (ng.x.abs() + ng.y.abs() + ng.z.abs());
    p + ng * distance.copysign(direction.dot(ng))
}

impl Surface {
    /// The ray from here in direction `d`, to infinity.
    #[inline]
    pub fn ray(&self, d: Vec3) -> OwnRay {
        Ray {
            o: offset_origin(self.p, self.error, self.ng, d),
            d,
            t_max: Real::INFINITY,
        }
    }
}

/// Nothing lies between two points, each given with its error bound and geometric normal; a point of a lens or light
/// that lies on no surface has the normal 0. Both ways give the same answer, since one of them is always asked.
#[inline]
pub fn visible<A: Accel>(
    accel: &A,
    p0: Vec3,
    e0: Real,
    ng0: Vec3,
    p1: Vec3,
    e1: Real,
    ng1: Vec3,
) -> bool {
    visible_by(|ray| accel.occluded(ray), (p0, e0, ng0), (p1, e1, ng1))
}

/// An end of a line of sight: a point, its error bound, its geometric normal.
pub type End = (Vec3, Real, Vec3);

/// The same as if there were not these two triangles; see [`Accel::nearest_but`].
#[cold]
pub fn visible_but<A: Accel>(accel: &A, a: End, b: End, but: [PrimId; 2]) -> bool {
    visible_by(|ray| accel.occluded_but(ray, but), a, b)
}

#[inline(always)]
fn visible_by(occluded: impl Fn(&Ray) -> bool, a: End, b: End) -> bool {
    let key = |(p, ..): End| (p.x, p.y, p.z);
    if key(b) < key(a) {
        return segment_free(occluded, b, a);
    }
    segment_free(occluded, a, b)
}

/// Visibility of the ends in the given order.
#[inline(always)]
fn segment_free(occluded: impl Fn(&Ray) -> bool, a: End, b: End) -> bool {
    let d = b.0 - a.0;
    // Beside the points' own error: a test's distance along the ray is rounded in proportion to the length, so the far
    // end stands off by that much more; 8 roundings cover the dot products of numerator and denominator.
    let along = 8.0 * ROUNDOFF * d.abs().max_element();
    let o = offset_origin(a.0, a.1 + along, a.2, d).single();
    let e = offset_origin(b.0, b.1 + along, b.2, -d).single();
    let between = e - o;
    // Closer than their errors: nothing fits between.
    if between.dot(d.single()) <= 0.0 {
        return true;
    }
    !occluded(&Ray {
        o,
        d: between,
        t_max: 1.0 - f32::EPSILON,
    })
}

/// Nothing lies in direction `d` of a surface point, out to infinity.
#[inline]
pub fn escapes<A: Accel>(accel: &A, p: Vec3, error: Real, ng: Vec3, d: Vec3) -> bool {
    !accel.occluded(&Ray {
        o: offset_origin(p, error, ng, d).single(),
        d: d.single(),
        t_max: f32::INFINITY,
    })
}

#[cfg(all(test, not(feature = "double")))]
mod tests {
    use super::*;

    #[test]
    fn offsets_scale_with_the_error_and_round_outward() {
        let p = Vec3::new(1.0, -2.0, 1e-20);
        let n = Vec3::new(0.6, 0.0, -0.8);
        // The least error of a point at 2 is two roundings, 2·2⁻²⁴·2.
        for error in [2.4e-7f32, 1e-6, 1e-3] {
            for d in [n, -n] {
                let moved = (offset_origin(p, error, n, d) - p).double();
                assert!(moved.dot(d.double()) > 0.0);
                // Away from the box of half width `error`.
                let box_reach = (error as f64 - 2.4e-7) * 1.4;
                assert!(moved.dot(d.double()) >= box_reach);
            }
        }
        assert_eq!(offset_origin(p, 1.0, Vec3::ZERO, n), p);
    }
}
