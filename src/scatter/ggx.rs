//! The GGX microfacet distribution (Trowbridge & Reitz 1975; Walter et al. 2007), anisotropic, with Smith's
//! height-correlated masking (Heitz 2014) and sampling of the visible normals.

use crate::real::consts::{FRAC_1_PI, TAU};
use crate::real::{Convert, Real, Vec2, Vec3};
use crate::scene::material::SMOOTH;

/// Least α of a rough direction, so that one smooth direction of two does not divide by 0 (as pbrt-v4).
const LEAST: Real = 1e-4;

/// A GGX distribution of normals around z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    /// α along x.
    pub ax: Real,
    /// α along y.
    pub ay: Real,
}

impl Ggx {
    /// The distribution, or `None` where the surface counts as smooth.
    #[inline]
    pub fn new(ax: Real, ay: Real) -> Option<Self> {
        // A NaN counts as smooth.
        (ax.max(ay).single() >= SMOOTH).then(|| Self {
            ax: ax.max(LEAST),
            ay: ay.max(LEAST),
        })
    }

    /// The isotropic α of about the same roughness.
    #[inline]
    pub fn mean_alpha(&self) -> Real {
        (self.ax * self.ay).sqrt()
    }

    /// D(m): area of facets with normal m per unit area and solid angle; ∫ D·cos dm = 1.
    #[inline]
    pub fn d(&self, m: Vec3) -> Real {
        let (x, y) = (m.x / self.ax, m.y / self.ay);
        let q = x * x + y * y + m.z * m.z;
        FRAC_1_PI / (self.ax * self.ay * q * q)
    }

    /// Smith's Λ(w); infinite at the horizon.
    #[inline]
    pub fn lambda(&self, w: Vec3) -> Real {
        let (x, y) = (w.x * self.ax, w.y * self.ay);
        0.5 * ((1.0 + (x * x + y * y) / (w.z * w.z)).sqrt() - 1.0)
    }

    /// Share of the facets turned to `w` that `w` sees.
    #[inline]
    pub fn g1(&self, w: Vec3) -> Real {
        1.0 / (1.0 + self.lambda(w))
    }

    /// Share that both see, with heights correlated. pbrt-v4 takes the same form across an interface.
    #[inline]
    pub fn g2(&self, a: Vec3, b: Vec3) -> Real {
        1.0 / (1.0 + self.lambda(a) + self.lambda(b))
    }

    /// Density of the normals `w` sees: G1(w)·max(0, w·m)·D(m)/|cos θ_w|. `m` has m.z ≥ 0 and `w` may lie on either
    /// side; only facets turned to it count.
    #[inline]
    pub fn visible_pdf(&self, w: Vec3, m: Vec3) -> Real {
        let wm = w.dot(m) * (1.0 as Real).copysign(w.z);
        if wm <= 0.0 || w.z == 0.0 {
            return 0.0;
        }
        self.g1(w) * wm * self.d(m) / w.z.abs()
    }

    /// A normal with z ≥ 0 out of those `w` sees: the reflection of `w` off the hemisphere the distribution becomes
    /// when stretched is uniform on a spherical cap (Dupuy & Benyoub 2023).
    #[inline]
    pub fn sample_visible(&self, w: Vec3, u: Vec2) -> Vec3 {
        let w = if w.z < 0.0 { -w } else { w };
        let i = Vec3::new(self.ax * w.x, self.ay * w.y, w.z).normalize();
        let z = (1.0 - u.x) * (1.0 + i.z) - i.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (s, c) = (TAU * u.y).sin_cos();
        let h = Vec3::new(r * c, r * s, z) + i;
        Vec3::new(self.ax * h.x, self.ay * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Rng;

    /// ∫ f(m) dm over the hemisphere by the midpoint rule in tan θ scaled by α, which resolves the peak.
    fn integrate(g: &Ggx, f: impl Fn(Vec3) -> Real) -> f64 {
        let (n, k) = (1000, 128);
        let mut sum = 0.0;
        for i in 0..n {
            // D·cos is uniform in t under tan²θ/α² = t/(1 − t) for isotropic α.
            // The mean slope falls off only as √(1 − t), so s = √(1 − t) is what is spaced evenly.
            let s = (f64::from(i) + 0.5) / f64::from(n);
            let t = 1.0 - s * s;
            let tan2 = t / (1.0 - t);
            for j in 0..k {
                let phi = (f64::from(j) + 0.5) / f64::from(k) * std::f64::consts::TAU;
                let (x, y) = (
                    f64::from(g.ax) * tan2.sqrt() * phi.cos(),
                    f64::from(g.ay) * tan2.sqrt() * phi.sin(),
                );
                let z = 1.0 / (1.0 + x * x + y * y).sqrt();
                let m = Vec3::new((x * z) as Real, (y * z) as Real, z as Real);
                // dm = cos³ dx dy of slopes; dx dy = αx·αy/2 · d(tan²)·dφ.
                let jac = z.powi(3) * f64::from(g.ax * g.ay) * 0.5 / (1.0 - t).powi(2) * 2.0 * s;
                sum += f64::from(f(m)) * jac;
            }
        }
        sum / f64::from(n) * std::f64::consts::TAU / f64::from(k)
    }

    fn cases() -> [Ggx; 5] {
        [
            (0.001, 0.001),
            (0.1, 0.1),
            (0.5, 0.5),
            (1.0, 1.0),
            (0.05, 0.4),
        ]
        .map(|(x, y)| Ggx::new(x, y).unwrap())
    }

    #[test]
    fn projected_area_of_the_facets_is_one() {
        for g in cases() {
            let a = integrate(&g, |m| g.d(m) * m.z);
            assert!((a - 1.0).abs() < 1e-4, "{g:?} {a}");
        }
    }

    #[test]
    fn visible_normals_are_a_density_from_either_side() {
        for g in cases() {
            for w in [(0.0, 1.0), (0.7, 0.5), (0.1, -0.2), (2.0, 0.1)] {
                let w = Vec3::new(w.0, 0.3 * w.0, w.1).normalize();
                let a = integrate(&g, |m| g.visible_pdf(w, m));
                // The edge w·m = 0 of the midpoint rule costs about 1/1000.
                assert!((a - 1.0).abs() < 3e-3, "{g:?} {w} {a}");
            }
        }
    }

    #[test]
    fn sampled_normals_have_the_moments_of_their_density() {
        for g in cases() {
            for w in [Vec3::Z, Vec3::new(0.8, 0.0, 0.6), Vec3::new(0.3, 0.9, -0.1)] {
                let w = w.normalize();
                let n = 1 << 16;
                let mut rng = Rng::new(3, 0, 0, 0);
                let (mut s, mut s2) = (0.0, 0.0);
                for _ in 0..n {
                    let m = g.sample_visible(w, rng.next_vec2());
                    let v = f64::from(m.z);
                    s += v;
                    s2 += v * v;
                }
                let mean = s / f64::from(n);
                let se = ((s2 / f64::from(n) - mean * mean).max(0.0) / f64::from(n)).sqrt();
                let want = integrate(&g, |m| g.visible_pdf(w, m) * m.z);
                assert!(
                    (mean - want).abs() < 5.0 * se + 3e-3,
                    "{g:?} {w} {mean} {want}"
                );
            }
        }
    }

    #[test]
    fn smoothness_threshold_is_that_of_pbrt() {
        assert!(Ggx::new(0.0, 0.0009).is_none());
        assert!(Ggx::new(Real::NAN, Real::NAN).is_none());
        assert_eq!(Ggx::new(0.0, 0.1).unwrap().ax, 1e-4);
        assert!(Ggx::new(0.001, 0.001).is_some());
    }
}
