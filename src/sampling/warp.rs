//! Warps from the unit square to the domains a renderer samples, with their densities.

use crate::real::consts::{FRAC_1_PI, FRAC_PI_4, TAU};
use crate::real::{Real, Vec2, Vec3};

/// Uniform point on the unit disk by Shirley and Chiu's concentric map, which keeps neighbours together.
#[inline]
pub fn disk(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    if p.x.abs() > p.y.abs() {
        let (s, c) = sin_cos_octant(FRAC_PI_4 * (p.y / p.x));
        p.x * Vec2::new(c, s)
    } else if p.y != 0.0 {
        let (s, c) = sin_cos_octant(FRAC_PI_4 * (p.x / p.y));
        p.y * Vec2::new(s, c)
    } else {
        Vec2::ZERO
    }
}

/// sin and cos for |x| ≤ π/4 by Taylor's series, whose next terms are below 2·10⁻⁹ and 3·10⁻⁸ there: a diffuse bounce
/// spends most of its time in the general functions, which also differ between systems.
#[inline]
#[cfg(not(feature = "double"))]
fn sin_cos_octant(x: Real) -> (Real, Real) {
    let y = x * x;
    let s = 1.0 / 362_880.0;
    let s = (((s * y - 1.0 / 5040.0) * y + 1.0 / 120.0) * y - 1.0 / 6.0) * y + 1.0;
    let c = 1.0 / 40_320.0;
    let c = (((c * y - 1.0 / 720.0) * y + 1.0 / 24.0) * y - 0.5) * y + 1.0;
    (x * s, c)
}

#[cfg(feature = "double")]
fn sin_cos_octant(x: Real) -> (Real, Real) {
    x.sin_cos()
}

/// Uniform point on the unit circle.
#[inline]
pub fn circle(u: Real) -> Vec2 {
    let t = 4.0 * u;
    let quarter = t as u32;
    let (s, c) = sin_cos_octant(2.0 * FRAC_PI_4 * (t - quarter as Real - 0.5));
    let v = if quarter & 1 == 0 {
        Vec2::new(c, s)
    } else {
        Vec2::new(-s, c)
    };
    if quarter & 2 == 0 { v } else { -v }
}

/// e^x for |x| ≤ 80 to a few roundings: 2^n by its bits times Taylor's series of the rest, whose next term is below
/// 2·10⁻⁸. The same on every system, unlike that of a maths library.
#[inline]
#[cfg(not(feature = "double"))]
pub fn exp(x: Real) -> Real {
    use crate::real::consts::{LN_2, LOG2_E};
    let t = x * LOG2_E;
    let n = t.round_ties_even();
    let y = (t - n) * LN_2;
    let p = (((1.0 / 720.0 * y + 1.0 / 120.0) * y + 1.0 / 24.0) * y + 1.0 / 6.0) * y + 0.5;
    let p = (p * y + 1.0) * y + 1.0;
    p * f32::from_bits(((n as i32 + 127) as u32) << 23)
}

/// e^x.
#[cfg(feature = "double")]
pub fn exp(x: Real) -> Real {
    x.exp()
}

/// Density of [`disk`] per unit area.
pub const DISK_PDF: Real = FRAC_1_PI;

/// Direction in the hemisphere z ≥ 0 with density cos θ/π (Malley's method).
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = disk(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Solid-angle density of [`cosine_hemisphere`] at |cos θ|.
#[inline]
pub fn cosine_hemisphere_pdf(cos: Real) -> Real {
    cos * FRAC_1_PI
}

/// Uniform direction.
#[inline]
pub fn sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    // sin θ = 2·√(u(1−u)) keeps its digits at the poles.
    let r = 2.0 * (u.x * (1.0 - u.x)).max(0.0).sqrt();
    let (s, c) = (TAU * u.y).sin_cos();
    Vec3::new(r * c, r * s, z)
}

/// Solid-angle density of [`sphere`].
pub const SPHERE_PDF: Real = FRAC_1_PI / 4.0;

/// Uniform direction in the cone cos θ ≥ `cos_max` around +z.
#[inline]
pub fn cone(u: Vec2, cos_max: Real) -> Vec3 {
    let d = u.x * (1.0 - cos_max);
    let z = 1.0 - d;
    let r = (d * (2.0 - d)).max(0.0).sqrt();
    let (s, c) = (TAU * u.y).sin_cos();
    Vec3::new(r * c, r * s, z)
}

/// Solid-angle density of [`cone`].
#[inline]
pub fn cone_pdf(cos_max: Real) -> Real {
    1.0 / (TAU * (1.0 - cos_max))
}

/// Uniform barycentric weights (b0, b1, b2 = 1 − b0 − b1) on a triangle by Heitz's low-distortion map.
#[inline]
pub fn triangle(u: Vec2) -> [Real; 3] {
    let (b0, b1) = if u.x < u.y {
        let b0 = 0.5 * u.x;
        (b0, u.y - b0)
    } else {
        let b1 = 0.5 * u.y;
        (u.x - b1, b1)
    };
    [b0, b1, (1.0 - b0 - b1).max(0.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circle_and_exponential_are_what_they_say() {
        for i in 0..1000 {
            let u = (i as Real + 0.37) / 1000.0;
            // The angle starts at −45°.
            let (s, c) = (TAU * (u - 0.125)).sin_cos();
            assert!((circle(u) - Vec2::new(c, s)).length() < 1e-6, "{u}");
            let x = 160.0 * u - 80.0;
            // x·log₂e is rounded: a relative error of |x|·2⁻²⁴ beside that of the series.
            let bound = (4.0 + x.abs()) as f64 * Real::EPSILON as f64;
            assert!(
                (exp(x) as f64 / (x as f64).exp() - 1.0).abs() < bound,
                "{x}"
            );
        }
    }
    use crate::sampling::Rng;

    const N: u32 = 1 << 16;

    /// Mean of `f` over the unit square lies within 5 standard errors of `mean`.
    fn mean_is(mean: f64, f: impl Fn(Vec2) -> Real) {
        let mut rng = Rng::new(11, 0, 0, 0);
        let (mut s, mut s2) = (0.0f64, 0.0f64);
        for _ in 0..N {
            let v = f64::from(f(rng.next_vec2()));
            s += v;
            s2 += v * v;
        }
        let n = f64::from(N);
        let se = ((s2 / n - (s / n).powi(2)).max(0.0) / n).sqrt();
        assert!(
            (s / n - mean).abs() <= 5.0 * se,
            "{} ± {se}, not {mean}",
            s / n
        );
    }

    #[test]
    fn moments_are_those_of_the_density() {
        mean_is(0.0, |u| disk(u).x);
        mean_is(0.25, |u| disk(u).y.powi(2));
        mean_is(0.5, |u| disk(u).length_squared());
        mean_is(2.0 / 3.0, |u| cosine_hemisphere(u).z);
        mean_is(0.5, |u| cosine_hemisphere(u).z.powi(2));
        mean_is(0.0, |u| sphere(u).z);
        mean_is(1.0 / 3.0, |u| sphere(u).x.powi(2));
        mean_is(0.2, |u| sphere(u).z.powi(4));
        mean_is(0.9, |u| cone(u, 0.8).z);
        for i in 0..3 {
            mean_is(1.0 / 3.0, |u| triangle(u)[i]);
            mean_is(1.0 / 6.0, |u| triangle(u)[i].powi(2));
        }
        mean_is(1.0 / 12.0, |u| triangle(u)[0] * triangle(u)[1]);
    }

    #[test]
    fn octant_series_is_sine_and_cosine_to_rounding() {
        for i in -1000..=1000 {
            let x = FRAC_PI_4 * i as Real / 1000.0;
            let (s, c) = sin_cos_octant(x);
            let (ws, wc) = f64::from(x).sin_cos();
            assert!((f64::from(s) - ws).abs() < f64::from(Real::EPSILON), "{x}");
            assert!((f64::from(c) - wc).abs() < f64::from(Real::EPSILON), "{x}");
        }
    }

    #[test]
    fn results_lie_in_their_domains() {
        let mut rng = Rng::new(12, 0, 0, 0);
        for i in 0..N {
            let mut u = rng.next_vec2();
            // Corners and centre lines are where the maps branch.
            match i {
                0 => u = Vec2::ZERO,
                1 => u = Vec2::new(0.5, 0.5),
                2 => u = Vec2::new(1.0 - Real::EPSILON, 0.0),
                3 => u = Vec2::splat(1.0 - Real::EPSILON),
                _ => {}
            }
            assert!(disk(u).length_squared() <= 1.0 + 4.0 * Real::EPSILON);
            for d in [cosine_hemisphere(u), sphere(u), cone(u, 0.999)] {
                assert!(
                    (d.length_squared() - 1.0).abs() < 8.0 * Real::EPSILON,
                    "{u} {d}"
                );
            }
            assert!(cosine_hemisphere(u).z >= 0.0);
            assert!(cone(u, 0.999).z >= 0.999 - Real::EPSILON);
            let b = triangle(u);
            assert!(b.iter().all(|&v| (0.0..=1.0).contains(&v)));
            assert!((b.iter().sum::<Real>() - 1.0).abs() <= 2.0 * Real::EPSILON);
        }
    }
}
