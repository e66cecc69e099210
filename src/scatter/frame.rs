//! Orthonormal frames: world ↔ local shading space.

use crate::real::{Real, Vec3};

/// An orthonormal frame with z along the (shading) normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Tangent.
    pub x: Vec3,
    /// Bitangent, z × x.
    pub y: Vec3,
    /// Normal.
    pub z: Vec3,
}

impl Frame {
    /// Any frame around the unit vector `z`, without a branch (Duff et al. 2017).
    #[inline]
    pub fn from_normal(z: Vec3) -> Self {
        let s = (1.0 as Real).copysign(z.z);
        let a = -1.0 / (s + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + s * z.x * z.x * a, s * b, -s * z.x),
            y: Vec3::new(b, s + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// The frame around the unit vector `z` whose x axis is `tangent` (∂p/∂u, any length) made orthogonal to z.
    /// Falls back on [`Self::from_normal`] where the tangent has no direction across z.
    #[inline]
    pub fn from_normal_tangent(z: Vec3, tangent: Vec3) -> Self {
        let t = tangent - z * z.dot(tangent);
        let len2 = t.length_squared();
        // Below this the difference is mostly rounding.
        if len2.is_finite() && len2 > 1e-10 * tangent.length_squared() {
            let x = t / len2.sqrt();
            Self {
                x,
                y: z.cross(x),
                z,
            }
        } else {
            Self::from_normal(z)
        }
    }

    /// World → local.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Local → world.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, warp};

    fn is_right_handed(f: &Frame, tol: Real) {
        for (a, b) in [(f.x, f.y), (f.y, f.z), (f.z, f.x)] {
            assert!(a.dot(b).abs() < tol, "{f:?}");
        }
        for a in [f.x, f.y, f.z] {
            assert!((a.length_squared() - 1.0).abs() < tol, "{f:?}");
        }
        assert!((f.x.cross(f.y) - f.z).length() < tol, "{f:?}");
    }

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        let mut rng = Rng::new(1, 0, 0, 0);
        let poles = [Vec3::Z, -Vec3::Z, Vec3::new(1e-4, 0.0, -1.0).normalize()];
        for i in 0..10_000 {
            let z = poles
                .get(i)
                .copied()
                .unwrap_or_else(|| warp::sphere(rng.next_vec2()));
            // Ten or so roundings of products of numbers up to 1.
            is_right_handed(&Frame::from_normal(z), 1e-6);
            let t = warp::sphere(rng.next_vec2());
            let f = Frame::from_normal_tangent(z, 37.0 * t);
            if z.dot(t).abs() < 0.99 {
                // What is left across z is shorter than the tangent, and its roundings count for more.
                is_right_handed(&f, 1e-6 / (1.0 - z.dot(t).powi(2)).sqrt());
                assert!(f.x.dot(t) > 0.0);
            }
            let v = warp::sphere(rng.next_vec2());
            assert!((f.to_world(f.to_local(v)) - v).length() < 2e-5);
        }
    }

    #[test]
    fn a_useless_tangent_still_gives_a_frame() {
        for t in [Vec3::ZERO, 3.0 * Vec3::Y, Vec3::NAN, Vec3::splat(Real::MAX)] {
            is_right_handed(&Frame::from_normal_tangent(Vec3::Y, t), 1e-6);
        }
    }
}
