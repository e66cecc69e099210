//! Lambertian reflection, on the side the light comes from, whichever it is.

use super::{BsdfSample, Mode};
use crate::real::consts::FRAC_1_PI;
use crate::real::{Real, Vec2, Vec3};
use crate::sampling::warp;
use crate::scene::spectrum::Spectrum;

/// f_s = ρ/π on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse<const N: usize> {
    /// ρ/π.
    value: [Real; N],
}

impl<const N: usize> Diffuse<N> {
    /// From the albedo, held in 0..=1.
    #[inline]
    pub fn new(albedo: Spectrum<N>) -> Self {
        Self {
            value: albedo.0.map(|a| a.clamp(0.0, 1.0) * FRAC_1_PI),
        }
    }

    /// ρ/π: f_s of any two directions on the same side.
    #[inline]
    pub fn value(&self) -> Spectrum<N> {
        Spectrum(self.value)
    }

    /// f_s.
    #[inline]
    pub fn eval(&self, a: Vec3, b: Vec3) -> Spectrum<N> {
        if a.z * b.z > 0.0 {
            Spectrum(self.value)
        } else {
            Spectrum::ZERO
        }
    }

    /// cos θ/π.
    #[inline]
    pub fn pdf(&self, from: Vec3, to: Vec3) -> Real {
        if from.z * to.z > 0.0 {
            warp::cosine_hemisphere_pdf(to.z.abs())
        } else {
            0.0
        }
    }

    /// A direction on the side of `from`.
    #[inline]
    pub fn sample(&self, from: Vec3, u: Vec2) -> Option<BsdfSample> {
        let mut to = warp::cosine_hemisphere(u);
        to.z = to.z.copysign(from.z);
        let pdf = self.pdf(from, to);
        (pdf > 0.0).then_some(BsdfSample {
            to,
            mode: Mode::NonSpecular,
            pdf,
        })
    }
}
