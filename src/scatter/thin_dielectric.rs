//! A thin sheet: both interfaces of a dielectric at once, so rays pass unbent.

use super::{Mode, Specular, fresnel};
use crate::real::{Real, Vec3};
use crate::scene::spectrum::Spectrum;

/// A sheet of index η, all internal reflections summed. Directions do not depend on η, so every lane has its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric<const N: usize> {
    /// Index in each lane.
    pub eta: [Real; N],
}

impl<const N: usize> ThinDielectric<N> {
    /// R + T·R·T + T·R³·T + … = 2R/(1 + R) in one lane, R of one interface.
    #[inline]
    fn reflectance(&self, cos: Real, lane: usize) -> Real {
        let r = fresnel::dielectric(cos.abs(), self.eta[lane]);
        2.0 * r / (1.0 + r)
    }

    /// Chooses by lane 0's reflectance.
    #[inline]
    pub fn sample(&self, from: Vec3, uc: Real) -> Option<(Vec3, Mode, Real)> {
        let r = self.reflectance(from.z, 0);
        let (mode, prob) = if uc < r {
            (Mode::Reflect, r)
        } else {
            (Mode::Transmit, 1.0 - r)
        };
        self.deflect(from, mode).map(|to| (to, mode, prob))
    }

    /// Mirror, or straight on. A sheet of index 1 has no mirror.
    #[inline]
    pub fn deflect(&self, from: Vec3, mode: Mode) -> Option<Vec3> {
        match mode {
            Mode::Reflect if self.eta[0] != 1.0 && from.z != 0.0 => Some(fresnel::reflect(from)),
            Mode::Transmit if from.z != 0.0 => Some(-from),
            _ => None,
        }
    }

    /// The sheet's R or 1 − R; the medium is the same on both sides.
    #[inline]
    pub fn specular(&self, w_l: Vec3, w_e: Vec3, mode: Mode) -> Option<Specular<N>> {
        let r = Spectrum::from_fn(|i| self.reflectance(w_e.z, i));
        let (value, cosines) = match mode {
            Mode::Reflect => (r, w_l.z * w_e.z),
            Mode::Transmit => (Spectrum::ONE - r, -w_l.z * w_e.z),
            Mode::NonSpecular => return None,
        };
        (cosines > 0.0 && value[0] > 0.0).then_some(Specular {
            value,
            prob_e: value[0],
            prob_l: value[0],
            jacobian: 1.0,
        })
    }
}
