//! Normals of primitives: of their planes, and interpolated ones.

use super::surface::ROUNDOFF;
use crate::real::{Convert, Vec3};
use crate::scene::Facet;

/// Unit normal of a triangle, and how far from its plane a ray–triangle test in f32 may believe a nearby origin to be.
///
/// With L the longest edge and h the height on it, a test that works on corners relative to the origin rounds each by
/// u·L, so the edges by 3u·L, the components of their cross product by 9u·L², and corner · normal by √3·9u·L³ + 4u·L·|N|
/// with |N| = L·h: a distance of 4u·L + 16u·L²/h. Past a needle of h/L = 10⁻³ that exceeds the width of the triangle;
/// there the offset stays at h/8, and `closest` asks again instead.
pub(super) fn plane(corners: [glam::Vec3; 3]) -> (Vec3, f32) {
    // In f64 because the squares of small scenes underflow f32.
    let [p0, p1, p2] = corners.map(|p| p.double());
    let (a, b, c) = (p1 - p0, p2 - p0, p2 - p1);
    let cross = a.cross(b);
    let area2 = cross.length();
    let longest2 = a
        .length_squared()
        .max(b.length_squared())
        .max(c.length_squared());
    if area2 == 0.0 {
        return (a.real().any_normal(), 0.0);
    }
    let longest = longest2.sqrt();
    let height = area2 / longest;
    let u = ROUNDOFF as f64;
    let bound = 4.0 * u * longest + (16.0 * u * longest2 / height).min(0.125 * height);
    ((cross / area2).real(), bound as f32)
}

/// The unit normal of a triangle: that of its facet, or made from the corners anew where f32 does not hold its digits.
#[inline(always)]
pub(super) fn normal(facet: &Facet) -> Vec3 {
    #[cfg(not(feature = "double"))]
    return facet.ng;
    #[cfg(feature = "double")]
    return plane(facet.corners).0;
}

/// A normal that is of unit length to f32's digits, to those of this build.
#[inline(always)]
pub(super) fn unit(normal: glam::Vec3) -> Vec3 {
    #[cfg(not(feature = "double"))]
    return normal;
    #[cfg(feature = "double")]
    return normal.real().normalize();
}

/// A unit normal to a vector, also to 0.
pub(super) trait AnyNormal {
    /// Of unit length.
    fn any_normal(self) -> Vec3;
}

impl AnyNormal for Vec3 {
    fn any_normal(self) -> Vec3 {
        let d = self.normalize_or(Vec3::Z);
        d.any_orthonormal_vector()
    }
}

/// The interpolated normal, of unit length and on the side of `ng`. pbrt-v4 turns the geometric normal instead; the
/// loader has done that for whole faces, so that ng stays a function of the primitive alone, as light sampling needs.
#[inline]
pub(super) fn facing(n: Vec3, ng: Vec3) -> Vec3 {
    let length2 = n.length_squared();
    if length2 > 0.0 {
        let n = n * length2.sqrt().recip();
        if n.dot(ng) < 0.0 { -n } else { n }
    } else {
        ng
    }
}
