//! A rough interface between two dielectrics: GGX reflection and refraction (Walter et al. 2007).

use super::conductor::{half, mirror, reflection, reflection_pdf};
use super::dielectric::relative_index;
use super::ggx::Ggx;
use super::{BsdfSample, Mode, fresnel};
use crate::real::{Real, Vec2, Vec3};
use crate::scene::spectrum::Spectrum;

/// A rough dielectric interface. z > 0 is outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    /// Index inside over outside at lane 0; not 1.
    pub eta: Real,
    /// Facets.
    pub ggx: Ggx,
    /// The index varies with wavelength.
    pub dispersive: bool,
}

impl RoughDielectric {
    /// f_s for radiance (eqs. 20 and 21). In transmission it holds n_e²: f_s(l→e)·n_l² = f_s(e→l)·n_e².
    #[inline]
    pub fn eval<const N: usize>(&self, w_l: Vec3, w_e: Vec3) -> Spectrum<N> {
        if let Some((m, cos)) = half(w_l, w_e) {
            let r = fresnel::dielectric(cos.copysign(w_e.z), self.eta);
            return Spectrum::splat(r * reflection(&self.ggx, w_l, w_e, m));
        }
        let Some(f) = Facet::refracting(w_e, w_l, self.eta) else {
            return Spectrum::ZERO;
        };
        let r = fresnel::dielectric(f.from_m, self.eta);
        let g = self.ggx.d(f.m) * self.ggx.g2(w_l, w_e);
        // Each divisor by itself: their product may underflow.
        let v = (1.0 - r) * g * (f.from_m * f.to_m).abs() / (w_l.z * w_e.z).abs();
        Spectrum::splat(v / f.denominator())
    }

    /// Density of the visible normal, times R or 1 − R at that facet, turned into that of the direction.
    #[inline]
    pub fn pdf(&self, from: Vec3, to: Vec3) -> Real {
        if let Some((m, cos)) = half(from, to) {
            let r = fresnel::dielectric(cos.copysign(from.z), self.eta);
            return r * reflection_pdf(&self.ggx, from, m);
        }
        let Some(f) = Facet::refracting(from, to, self.eta) else {
            return 0.0;
        };
        let t = 1.0 - fresnel::dielectric(f.from_m, self.eta);
        t * self.ggx.visible_pdf(from, f.m) * f.ratio * f.ratio * f.to_m.abs() / f.denominator()
    }

    /// A visible normal, then reflection or refraction there by `uc`; `None` when that leads to the wrong side.
    #[inline]
    pub fn sample(&self, from: Vec3, uc: Real, u: Vec2) -> Option<BsdfSample> {
        let m = self.ggx.sample_visible(from, u);
        let r = fresnel::dielectric(from.dot(m), self.eta);
        let to = if uc < r {
            let to = mirror(from, m);
            (to.z * from.z > 0.0).then_some(to)?
        } else {
            let to = refract_about(from, m, self.eta)?;
            (to.z * from.z < 0.0).then_some(to)?
        };
        let pdf = self.pdf(from, to);
        (pdf > 0.0).then_some(BsdfSample {
            to,
            mode: Mode::NonSpecular,
            pdf,
        })
    }
}

/// The facet that refracts one direction into another.
struct Facet {
    m: Vec3,
    from_m: Real,
    to_m: Real,
    /// n_to/n_from.
    ratio: Real,
}

impl Facet {
    /// `None` where no facet turned to both does it.
    #[inline]
    fn refracting(from: Vec3, to: Vec3, eta: Real) -> Option<Self> {
        if from.z * to.z > -Real::MIN_POSITIVE {
            return None;
        }
        let ratio = relative_index(to, eta);
        let h = to * ratio + from;
        let m = h.normalize_or_zero();
        let m = if m.z < 0.0 { -m } else { m };
        let (from_m, to_m) = (from.dot(m), to.dot(m));
        (from_m * from.z > 0.0 && to_m * to.z > 0.0).then_some(Self {
            m,
            from_m,
            to_m,
            ratio,
        })
    }

    /// (from·m + ratio·to·m)², the square of the unnormalised half vector.
    #[inline]
    fn denominator(&self) -> Real {
        let d = self.from_m + self.ratio * self.to_m;
        d * d
    }
}

/// Refracts `w` at a facet of normal `m` (z ≥ 0) on an interface of index `eta`; `None` in total reflection.
#[inline]
pub(super) fn refract_about(w: Vec3, m: Vec3, eta: Real) -> Option<Vec3> {
    let c = w.dot(m);
    let inv = if c > 0.0 { 1.0 / eta } else { eta };
    let cos2 = 1.0 - (1.0 - c * c).max(0.0) * inv * inv;
    (cos2 > 0.0).then(|| -w * inv + (c * inv - cos2.sqrt().copysign(c)) * m)
}
