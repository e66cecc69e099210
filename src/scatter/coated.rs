//! A Lambertian base under a dielectric coat, smooth or rough.
//!
//! The model is the exact sum of all paths through pbrt-v4's default layered stack (an absorbing layer of optical
//! thickness 0.01, no scattering between coat and base): with t and r of [`super::coat_table`],
//! f_s = coat reflection + t(θ_l)·t(θ_e)·ρ / (π·η²·(1 − ρ·r)).
//! For an anisotropic coat t and r are those of the isotropic coat of α = √(αx·αy). A coat rarer than what is outside
//! (η < 1, total reflection from above) is taken for smooth.

use super::coat_table::{RoughCoat, smooth_return, smooth_transmittance};
use super::conductor::{half, mirror, reflection, reflection_pdf};
use super::ggx::Ggx;
use super::{BsdfSample, Mode, Specular, fresnel};
use crate::real::consts::FRAC_1_PI;
use crate::real::{Real, Vec2, Vec3};
use crate::sampling::warp;
use crate::scene::spectrum::Spectrum;

/// Least albedo the choice between coat and base reckons with: the other lanes may be brighter than lane 0.
const LEAST_ALBEDO: Real = 0.1;

/// A coated Lambertian surface, the same from both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoatedDiffuse<const N: usize> {
    /// ρ/(π·η²·(1 − ρ·r)).
    base: [Real; N],
    /// Albedo of the base in the choice of lobes.
    weight: Real,
    eta: Real,
    coat: Coat,
    /// The index varies with wavelength.
    pub dispersive: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Coat {
    Smooth,
    Rough(Ggx, RoughCoat),
}

impl<const N: usize> CoatedDiffuse<N> {
    /// From the base's albedo (held in 0..=1), the coat's index and its facets (`None`: smooth).
    #[inline]
    pub fn new(albedo: Spectrum<N>, eta: Real, ggx: Option<Ggx>, dispersive: bool) -> Self {
        let (coat, r) = match ggx.filter(|_| eta > 1.0) {
            None => (Coat::Smooth, smooth_return(eta)),
            Some(ggx) => {
                let rough = RoughCoat::new(eta, ggx.mean_alpha());
                (Coat::Rough(ggx, rough), rough.base_return())
            }
        };
        let albedo = albedo.0.map(|a| a.clamp(0.0, 1.0));
        let k = FRAC_1_PI / (eta * eta);
        Self {
            base: albedo.map(|a| k * a / (1.0 - a * r)),
            weight: albedo[0].max(LEAST_ALBEDO),
            eta,
            coat,
            dispersive,
        }
    }

    /// The coat is a delta lobe.
    #[inline]
    pub fn has_specular(&self) -> bool {
        matches!(self.coat, Coat::Smooth) && self.eta != 1.0
    }

    /// f_s without the mirror of a smooth coat.
    #[inline]
    pub fn eval(&self, w_l: Vec3, w_e: Vec3) -> Spectrum<N> {
        let Some((m, cos)) = half(w_l, w_e) else {
            return Spectrum::ZERO;
        };
        let base = Spectrum(self.base);
        match &self.coat {
            Coat::Smooth => {
                base * (smooth_transmittance(w_l.z, self.eta)
                    * smooth_transmittance(w_e.z, self.eta))
            }
            Coat::Rough(ggx, rough) => {
                let f = fresnel::dielectric(cos, self.eta);
                base * (rough.transmittance(w_l.z) * rough.transmittance(w_e.z))
                    + Spectrum::splat(f * reflection(ggx, w_l, w_e, m))
            }
        }
    }

    /// Probability of the coat's reflection, by macroscopic reflectance against what the base may return.
    #[inline]
    fn coat_probability(&self, from: Vec3) -> Real {
        let r = fresnel::dielectric(from.z.abs(), self.eta);
        r / (r + (1.0 - r) * self.weight)
    }

    /// Probability that [`Self::sample`] takes a lobe that is not a delta.
    #[inline]
    pub fn non_specular_probability(&self, from: Vec3) -> Real {
        match &self.coat {
            Coat::Smooth => 1.0 - self.coat_probability(from),
            Coat::Rough(..) => 1.0,
        }
    }

    /// Density over both non-specular lobes.
    #[inline]
    pub fn pdf(&self, from: Vec3, to: Vec3) -> Real {
        let Some((m, _)) = half(from, to) else {
            return 0.0;
        };
        let p = self.coat_probability(from);
        let base = (1.0 - p) * warp::cosine_hemisphere_pdf(to.z.abs());
        match &self.coat {
            Coat::Smooth => base,
            Coat::Rough(ggx, _) => base + p * reflection_pdf(ggx, from, m),
        }
    }

    /// Coat by `uc`, else the base.
    #[inline]
    pub fn sample(&self, from: Vec3, uc: Real, u: Vec2) -> Option<BsdfSample> {
        let p = self.coat_probability(from);
        let to = if uc < p {
            match &self.coat {
                Coat::Smooth => {
                    return self.deflect(from).map(|to| BsdfSample {
                        to,
                        mode: Mode::Reflect,
                        pdf: p,
                    });
                }
                Coat::Rough(ggx, _) => mirror(from, ggx.sample_visible(from, u)),
            }
        } else {
            let mut to = warp::cosine_hemisphere(u);
            to.z = to.z.copysign(from.z);
            to
        };
        let pdf = self.pdf(from, to);
        (pdf > 0.0).then_some(BsdfSample {
            to,
            mode: Mode::NonSpecular,
            pdf,
        })
    }

    /// The mirror of a smooth coat.
    #[inline]
    pub fn deflect(&self, from: Vec3) -> Option<Vec3> {
        (self.has_specular() && from.z != 0.0).then(|| fresnel::reflect(from))
    }

    /// R of a smooth coat.
    #[inline]
    pub fn specular(&self, w_l: Vec3, w_e: Vec3) -> Option<Specular<N>> {
        (self.has_specular() && w_l.z * w_e.z > 0.0).then(|| Specular {
            value: Spectrum::splat(fresnel::dielectric(w_e.z.abs(), self.eta)),
            prob_e: self.coat_probability(w_e),
            prob_l: self.coat_probability(w_l),
            jacobian: 1.0,
        })
    }
}
