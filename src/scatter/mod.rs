//! BSDF lobes. One lobe a file: eval, pdf, sample, in that order; transport direction explicit.
//!
//! Directions are unit vectors in the local shading frame (z = shading normal), pointing away from the surface.
//! `w_l` points towards the light side of the path, `w_e` towards the eye side, whoever generated the path.

mod coat_table;
pub mod coated;
pub mod conductor;
pub mod dielectric;
pub mod diffuse;
pub mod frame;
pub mod fresnel;
pub mod ggx;
pub mod mix;
pub mod rough_dielectric;
pub mod shade;
#[cfg(test)]
mod tests;
pub mod thin_dielectric;

pub use frame::Frame;
pub use mix::resolve as resolve_mix;
pub use shade::{shade, shade_material};

use crate::real::{Real, Vec2, Vec3};
use crate::scene::spectrum::Spectrum;

/// How a path scatters at a vertex: part of the path's state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    /// Any non-delta lobe.
    NonSpecular,
    /// Delta reflection.
    Reflect,
    /// Delta transmission.
    Transmit,
}

/// Which end the sub-path comes from when a direction is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// `from` points to the eye side; a direction to the light side is sampled.
    FromEye,
    /// `from` points to the light side; a direction to the eye side is sampled.
    FromLight,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// The new direction.
    pub to: Vec3,
    /// Its mode.
    pub mode: Mode,
    /// Non-specular: solid-angle density of `to`, of all non-specular lobes, times the probability of choosing them.
    /// Specular: the probability of choosing this mode.
    pub pdf: Real,
}

/// A delta lobe, both directions at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specular<const N: usize> {
    /// Coefficient c of radiance transport: L(w_e) = c · L(w_l). Includes (n_e/n_l)² in transmission.
    pub value: Spectrum<N>,
    /// Probability that sampling from the eye side chooses this mode.
    pub prob_e: Real,
    /// Probability that sampling from the light side chooses this mode.
    pub prob_l: Real,
    /// dω_l/dω_e = (n_e²·|cos e|)/(n_l²·|cos l|): 1 in reflection.
    pub jacobian: Real,
}

/// All lobes at a point, with their spectra at the path's wavelengths.
///
/// Every lobe here samples alike from both ends: a density does not depend on [`Transport`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf<const N: usize> {
    /// Scatters nothing.
    Black,
    /// Lambertian reflection.
    Diffuse(diffuse::Diffuse<N>),
    /// Mirror of metal.
    Conductor(conductor::Conductor<N>),
    /// Rough metal.
    RoughConductor(conductor::RoughConductor<N>),
    /// Smooth glass.
    Dielectric(dielectric::Dielectric),
    /// Rough glass.
    RoughDielectric(rough_dielectric::RoughDielectric),
    /// Sheet of glass.
    ThinDielectric(thin_dielectric::ThinDielectric<N>),
    /// Lambertian base under a dielectric coat.
    CoatedDiffuse(coated::CoatedDiffuse<N>),
}

impl<const N: usize> Bsdf<N> {
    /// Non-specular f_s(w_l → w_e) in sr⁻¹ for radiance, without cosine. 0 where only delta lobes exist.
    #[inline]
    pub fn eval(&self, w_l: Vec3, w_e: Vec3) -> Spectrum<N> {
        match self {
            Self::Diffuse(b) => b.eval(w_l, w_e),
            Self::RoughConductor(b) => b.eval(w_l, w_e),
            Self::RoughDielectric(b) => b.eval(w_l, w_e),
            Self::CoatedDiffuse(b) => b.eval(w_l, w_e),
            Self::Black | Self::Conductor(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => {
                Spectrum::ZERO
            }
        }
    }

    /// Solid-angle density with which [`Self::sample`] returns `to` as non-specular.
    #[inline]
    pub fn pdf(&self, from: Vec3, to: Vec3, _dir: Transport) -> Real {
        match self {
            Self::Diffuse(b) => b.pdf(from, to),
            Self::RoughConductor(b) => b.pdf(from, to),
            Self::RoughDielectric(b) => b.pdf(from, to),
            Self::CoatedDiffuse(b) => b.pdf(from, to),
            Self::Black | Self::Conductor(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => 0.0,
        }
    }

    /// Samples a direction and a mode. `uc` chooses the lobe, `u` the direction.
    /// The density returned has the bits that [`Self::pdf`] or [`Self::specular`] returns for the same pair.
    #[inline]
    pub fn sample(&self, from: Vec3, _dir: Transport, uc: Real, u: Vec2) -> Option<BsdfSample> {
        let delta =
            |s: Option<(Vec3, Mode, Real)>| s.map(|(to, mode, pdf)| BsdfSample { to, mode, pdf });
        match self {
            Self::Black => None,
            Self::Diffuse(b) => b.sample(from, u),
            Self::Conductor(_) => {
                delta((from.z != 0.0).then(|| (fresnel::reflect(from), Mode::Reflect, 1.0)))
            }
            Self::RoughConductor(b) => b.sample(from, u),
            Self::Dielectric(b) => delta(b.sample(from, uc)),
            Self::RoughDielectric(b) => b.sample(from, uc, u),
            Self::ThinDielectric(b) => delta(b.sample(from, uc)),
            Self::CoatedDiffuse(b) => b.sample(from, uc, u),
        }
    }

    /// The direction into which the delta lobe `mode` sends `from`; `None` if there is no such lobe or total reflection.
    #[inline]
    pub fn deflect(&self, from: Vec3, mode: Mode, _dir: Transport) -> Option<Vec3> {
        match self {
            Self::Dielectric(b) => b.deflect(from, mode),
            Self::ThinDielectric(b) => b.deflect(from, mode),
            Self::Conductor(_) if mode == Mode::Reflect && from.z != 0.0 => {
                Some(fresnel::reflect(from))
            }
            Self::CoatedDiffuse(b) if mode == Mode::Reflect => b.deflect(from),
            _ => None,
        }
    }

    /// Value and probabilities of the delta lobe `mode` for a pair that [`Self::deflect`] made; `None` where there is
    /// no such lobe or it carries nothing.
    #[inline]
    pub fn specular(&self, w_l: Vec3, w_e: Vec3, mode: Mode) -> Option<Specular<N>> {
        match self {
            Self::Dielectric(b) => b.specular(w_l, w_e, mode),
            Self::ThinDielectric(b) => b.specular(w_l, w_e, mode),
            Self::Conductor(b) if mode == Mode::Reflect => b.specular(w_l, w_e),
            Self::CoatedDiffuse(b) if mode == Mode::Reflect => b.specular(w_l, w_e),
            _ => None,
        }
    }

    /// Some lobe is non-delta.
    #[inline]
    pub fn has_non_specular(&self) -> bool {
        matches!(
            self,
            Self::Diffuse(_)
                | Self::RoughConductor(_)
                | Self::RoughDielectric(_)
                | Self::CoatedDiffuse(_)
        )
    }

    /// Probability that [`Self::sample`] takes a non-delta lobe.
    #[inline]
    pub fn non_specular_probability(&self, from: Vec3, _dir: Transport) -> Real {
        match self {
            Self::CoatedDiffuse(b) => b.non_specular_probability(from),
            _ => self.has_non_specular() as u8 as Real,
        }
    }

    /// Some lobe is delta.
    #[inline]
    pub fn has_specular(&self) -> bool {
        match self {
            Self::Conductor(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => true,
            Self::CoatedDiffuse(b) => b.has_specular(),
            _ => false,
        }
    }

    /// The geometry of scattering depends on the wavelength (only lane 0 counts then).
    #[inline]
    pub fn is_dispersive(&self) -> bool {
        match self {
            Self::Dielectric(b) => b.dispersive,
            Self::RoughDielectric(b) => b.dispersive,
            Self::CoatedDiffuse(b) => b.dispersive,
            _ => false,
        }
    }
}

// A path vertex stores one of these.
#[cfg(not(feature = "double"))]
const _: () = assert!(size_of::<Bsdf<4>>() <= 52 && size_of::<Bsdf<1>>() <= 40);
