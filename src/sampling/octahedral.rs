//! The equal-area map between the unit square and the sphere (Clarberg 2008) in pbrt-v4's orientation: the square's
//! centre is +z, its corners are −z, and the square's x and y run along the sphere's.

use crate::real::consts::{FRAC_2_PI, FRAC_PI_4};
use crate::real::{Real, Vec2, Vec3};

/// Solid-angle density of a unit density on the square.
pub const PDF: Real = crate::real::consts::FRAC_1_PI / 4.0;

/// Point of the unit square → unit direction.
pub fn to_sphere(p: Vec2) -> Vec3 {
    let s = 2.0 * p - Vec2::ONE;
    let a = s.abs();
    // Positive in the inner diamond, which is the upper hemisphere.
    let inner = 1.0 - (a.x + a.y);
    let r = 1.0 - inner.abs();
    let phi = if r == 0.0 {
        FRAC_PI_4
    } else {
        ((a.y - a.x) / r + 1.0) * FRAC_PI_4
    };
    let (sin, cos) = phi.sin_cos();
    let rho = r * (2.0 - r * r).max(0.0).sqrt();
    Vec3::new(
        (rho * cos).copysign(s.x),
        (rho * sin).copysign(s.y),
        (1.0 - r * r).copysign(inner),
    )
}

/// Unit direction → point of the unit square.
pub fn to_square(d: Vec3) -> Vec2 {
    let a = d.abs();
    // 1 − |z| from x and y, which keeps its digits near the poles.
    let r = ((a.x * a.x + a.y * a.y) / (1.0 + a.z)).min(1.0).sqrt();
    let phi = if a.x == 0.0 && a.y == 0.0 {
        0.5
    } else {
        a.y.atan2(a.x) * FRAC_2_PI
    };
    let mut v = phi * r;
    let mut u = r - v;
    if d.z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    0.5 * (Vec2::new(u.copysign(d.x), v.copysign(d.y)) + Vec2::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, warp};

    #[test]
    fn there_and_back() {
        let mut rng = Rng::new(2, 0, 0, 0);
        for _ in 0..20_000 {
            let p = rng.next_vec2();
            let d = to_sphere(p);
            assert!((d.length_squared() - 1.0).abs() < 1e-6);
            // A few roundings of numbers near 1 each way.
            assert!((to_square(d) - p).abs().max_element() < 2e-6, "{p}");
            let d = warp::sphere(rng.next_vec2());
            assert!((to_sphere(to_square(d)) - d).length() < 4e-6, "{d}");
        }
    }

    #[test]
    fn landmarks_are_those_of_pbrt() {
        for (p, d) in [
            ((0.5, 0.5), Vec3::Z),
            ((0.0, 0.0), -Vec3::Z),
            ((1.0, 0.5), Vec3::X),
            ((0.0, 0.5), -Vec3::X),
            ((0.5, 1.0), Vec3::Y),
            ((0.5, 0.0), -Vec3::Y),
        ] {
            let p = Vec2::from(p);
            assert!((to_sphere(p) - d).length() < 1e-6, "{p}");
            assert!((to_sphere(to_square(d)) - d).length() < 1e-6, "{d}");
        }
    }

    #[test]
    fn equal_squares_have_equal_solid_angles() {
        // The Jacobian by central differences: |∂d/∂x × ∂d/∂y| = 4π.
        let h = 1e-2 as Real;
        let mut rng = Rng::new(3, 0, 0, 0);
        for _ in 0..2000 {
            let p = Vec2::splat(0.02) + 0.96 * rng.next_vec2();
            let s = (2.0 * p - Vec2::ONE).abs();
            // Not across a fold, where the derivative jumps.
            if s.min_element() < 4.0 * h || (s.x + s.y - 1.0).abs() < 8.0 * h {
                continue;
            }
            let dx = (to_sphere(p + Vec2::X * h) - to_sphere(p - Vec2::X * h)) / (2.0 * h);
            let dy = (to_sphere(p + Vec2::Y * h) - to_sphere(p - Vec2::Y * h)) / (2.0 * h);
            // Relative truncation h²·|d'''|/6 with third derivatives up to (2π/r)³, r ≥ 0.08 out of the folds.
            assert!((dx.cross(dy).length() * PDF - 1.0).abs() < 0.05, "{p}");
        }
    }
}
