//! A smooth interface between two dielectrics: a mirror and a refracted ray.

use super::{Mode, Specular, fresnel};
use crate::real::{Real, Vec3};
use crate::scene::spectrum::Spectrum;

/// A smooth dielectric interface. z > 0 is outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index inside over outside at lane 0.
    pub eta: Real,
    /// The index varies with wavelength.
    pub dispersive: bool,
}

impl Dielectric {
    /// Chooses by reflectance, and deflects. The probability is that of the mode.
    #[inline]
    pub fn sample(&self, from: Vec3, uc: Real) -> Option<(Vec3, Mode, Real)> {
        let r = fresnel::dielectric(from.z, self.eta);
        let (mode, prob) = if uc < r {
            (Mode::Reflect, r)
        } else {
            (Mode::Transmit, 1.0 - r)
        };
        self.deflect(from, mode).map(|to| (to, mode, prob))
    }

    /// Mirror or Snell. An interface of index 1 has no mirror.
    #[inline]
    pub fn deflect(&self, from: Vec3, mode: Mode) -> Option<Vec3> {
        match mode {
            Mode::Reflect if self.eta != 1.0 && from.z != 0.0 => Some(fresnel::reflect(from)),
            Mode::Transmit if from.z != 0.0 => fresnel::refract(from, self.eta),
            _ => None,
        }
    }

    /// R, or T·(n_e/n_l)²; radiance grows by the square of the index.
    #[inline]
    pub fn specular<const N: usize>(
        &self,
        w_l: Vec3,
        w_e: Vec3,
        mode: Mode,
    ) -> Option<Specular<N>> {
        let (r_e, r_l) = (
            fresnel::dielectric(w_e.z, self.eta),
            fresnel::dielectric(w_l.z, self.eta),
        );
        let same_side = w_l.z * w_e.z > 0.0;
        match mode {
            Mode::Reflect if same_side && r_e > 0.0 => Some(Specular {
                value: Spectrum::splat(r_e),
                prob_e: r_e,
                prob_l: r_l,
                jacobian: 1.0,
            }),
            // Within rounding of the critical angle one side may see total reflection: no light, then.
            Mode::Transmit if w_l.z * w_e.z < 0.0 && r_e < 1.0 && r_l < 1.0 => {
                let n2 = relative_index(w_e, self.eta).powi(2);
                Some(Specular {
                    value: Spectrum::splat((1.0 - r_e) * n2),
                    prob_e: 1.0 - r_e,
                    prob_l: 1.0 - r_l,
                    jacobian: n2 * (w_e.z / w_l.z).abs(),
                })
            }
            _ => None,
        }
    }
}

/// Index on the side of `w` over that on the other side.
#[inline]
pub(super) fn relative_index(w: Vec3, eta: Real) -> Real {
    if w.z > 0.0 { 1.0 / eta } else { eta }
}
