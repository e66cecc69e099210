//! Fresnel reflectance of unpolarised light, and Snell's law, at a plane with normal z.

use crate::real::{Real, Vec3};

/// Reflectance of a dielectric interface whose index below (z < 0) over above is `eta`, for light along a direction
/// with cosine `cos` to z (negative below), and the cosine > 0 of the refracted direction (0 in total reflection).
#[inline]
pub fn dielectric_parts(cos: Real, eta: Real) -> (Real, Real) {
    let c = cos.abs().min(1.0);
    // No interface: exactly nothing is reflected, where the formula would leave roundings.
    if eta == 1.0 {
        return (0.0, c);
    }
    let eta = if cos < 0.0 { 1.0 / eta } else { eta };
    let sin2_t = (1.0 - c * c) / (eta * eta);
    if sin2_t >= 1.0 {
        return (1.0, 0.0);
    }
    let t = (1.0 - sin2_t).sqrt();
    let parallel = (eta * c - t) / (eta * c + t);
    let perpendicular = (c - eta * t) / (c + eta * t);
    (
        0.5 * (parallel * parallel + perpendicular * perpendicular),
        t,
    )
}

/// As [`dielectric_parts`], the reflectance alone.
#[inline]
pub fn dielectric(cos: Real, eta: Real) -> Real {
    dielectric_parts(cos, eta).0
}

/// Reflectance of a conductor of complex index `eta` + i·`k` at |cos θ| in 0..=1 (Born & Wolf 14.4.2). With
/// a + i·b = √((η + iκ)² − sin²θ), both polarisations are quotients of sums of squares, which no rounding makes negative.
#[inline]
pub fn conductor(cos: Real, eta: Real, k: Real) -> Real {
    // No interface; the quotients are 0/0 at the horizon.
    if eta == 1.0 && k == 0.0 {
        return 0.0;
    }
    let c2 = (cos * cos).min(1.0);
    let s2 = 1.0 - c2;
    let (e2, k2) = (eta * eta, k * k);
    let t0 = e2 - k2 - s2;
    let q = 4.0 * e2 * k2;
    // The larger of a² and b² is half of this, the other one would cancel: a²·b² = q/4.
    let sum = (t0 * t0 + q).sqrt() + t0.abs();
    let (large, small) = (0.5 * sum, if sum > 0.0 { 0.5 * q / sum } else { 0.0 });
    let (a2, b2) = if t0 >= 0.0 {
        (large, small)
    } else {
        (small, large)
    };
    let (a, c) = (a2.sqrt(), c2.sqrt());
    let square = |v: Real| v * v;
    let s = (square(a - c) + b2) / (square(a + c) + b2);
    let (ac, b2c2) = (a * c, b2 * c2);
    0.5 * s * (1.0 + (square(ac - s2) + b2c2) / (square(ac + s2) + b2c2))
}

/// Mirror of `w` in the plane z = 0's normal.
#[inline]
pub fn reflect(w: Vec3) -> Vec3 {
    Vec3::new(-w.x, -w.y, w.z)
}

/// The direction on the other side of the plane into which `w` is refracted; `None` in total reflection.
#[inline]
pub fn refract(w: Vec3, eta: Real) -> Option<Vec3> {
    if eta == 1.0 {
        return Some(-w);
    }
    let inv = if w.z > 0.0 { 1.0 / eta } else { eta };
    let (x, y) = (-w.x * inv, -w.y * inv);
    let cos2 = 1.0 - (x * x + y * y);
    (cos2 > 0.0).then(|| Vec3::new(x, y, -cos2.sqrt().copysign(w.z)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_incidence_has_the_textbook_values() {
        let r0 = |n: Real, k: Real| ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k);
        for (n, k) in [(1.5, 0.0), (0.2, 3.9), (1.0, 2.0), (3.0, 3.0), (0.05, 4.0)] {
            assert!((conductor(1.0, n, k) - r0(n, k)).abs() < 1e-6, "{n} {k}");
        }
        assert!((dielectric(1.0, 1.5) - 0.04).abs() < 1e-7);
        assert!((dielectric(-1.0, 1.5) - 0.04).abs() < 1e-7);
    }

    #[test]
    fn conductor_without_absorption_is_the_dielectric() {
        for i in 0..=100 {
            let c = i as Real / 100.0;
            for eta in [1.3, 1.5, 2.4] {
                let d = conductor(c, eta, 0.0) - dielectric(c, eta);
                assert!(d.abs() < 2e-6, "{c} {eta} {d}");
            }
        }
    }

    #[test]
    fn conductor_agrees_with_complex_arithmetic() {
        // Fresnel's amplitudes with complex numbers as (re, im), in f64.
        type C = (f64, f64);
        let mul = |a: C, b: C| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
        let norm2 = |a: C| a.0 * a.0 + a.1 * a.1;
        let sqrt = |a: C| {
            let r = norm2(a).sqrt().sqrt();
            let (s, c) = (0.5 * a.1.atan2(a.0)).sin_cos();
            (r * c, r * s)
        };
        let add = |a: C, b: C| (a.0 + b.0, a.1 + b.1);
        let sub = |a: C, b: C| (a.0 - b.0, a.1 - b.1);
        for (n, k) in [(0.05, 4.0), (0.2, 3.4), (2.7, 3.0), (1.0, 0.6), (1.4, 7.5)] {
            for i in 0..=64 {
                let c = f64::from(i) / 64.0;
                let m: C = (n, k);
                let z = sub(mul(m, m), (1.0 - c * c, 0.0));
                // m·cos θt = √(m² − sin²).
                let mt = sqrt(z);
                let m2c = mul(mul(m, m), (c, 0.0));
                let p = norm2(sub(m2c, mt)) / norm2(add(m2c, mt));
                let s = norm2(sub((c, 0.0), mt)) / norm2(add((c, 0.0), mt));
                let want = 0.5 * (p + s);
                let got = f64::from(conductor(c as Real, n as Real, k as Real));
                assert!((got - want).abs() < 2e-6, "{n} {k} {c}: {got} {want}");
            }
        }
    }

    #[test]
    fn both_sides_of_an_interface_reflect_the_same() {
        for i in 1..200 {
            let c = i as Real / 200.0;
            for eta in [0.7, 1.33, 1.5, 2.4] {
                let w = Vec3::new((1.0 - c * c).sqrt(), 0.0, c);
                if let Some(t) = refract(w, eta) {
                    // R changes by up to 4·2.4 per unit of either cosine, and a refracted cosine is wrong by 4ε/cos.
                    let tol = 40.0 * Real::EPSILON / c.min(t.z.abs());
                    assert!((dielectric(c, eta) - dielectric(t.z, eta)).abs() < tol);
                    assert!((refract(t, eta).unwrap() - w).length() < tol);
                } else {
                    assert_eq!(dielectric(c, eta), 1.0);
                }
            }
        }
        assert_eq!(dielectric(0.0, 1.5), 1.0);
        assert_eq!(dielectric(-0.3, 1.5), 1.0);
        assert_eq!(dielectric(0.0, 1.0), 0.0);
    }
}
