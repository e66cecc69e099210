//! BSDF lobes. One lobe a file: eval, pdf, sample, in that order; transport direction explicit.
//!
//! Directions are unit vectors in the local shading frame (z = shading normal), pointing away from the surface.
//! `w_l` points towards the light side of the path, `w_e` towards the eye side, whoever generated the path.

use crate::scene::spectrum::Spectrum;
use glam::{Vec2, Vec3};

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
    pub pdf: f32,
}

/// A delta lobe, both directions at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specular<const N: usize> {
    /// Coefficient c of radiance transport: L(w_e) = c · L(w_l). Includes (n_e/n_l)² in transmission.
    pub value: Spectrum<N>,
    /// Probability that sampling from the eye side chooses this mode.
    pub prob_e: f32,
    /// Probability that sampling from the light side chooses this mode.
    pub prob_l: f32,
    /// dω_l/dω_e = (n_e²·|cos e|)/(n_l²·|cos l|): 1 in reflection.
    pub jacobian: f32,
}

/// All lobes at a point, with their spectra at the path's wavelengths.
#[derive(Clone, Copy, Debug)]
pub enum Bsdf<const N: usize> {
    /// Scatters nothing.
    Black,
}

impl<const N: usize> Bsdf<N> {
    /// Non-specular f_s(w_l → w_e) in sr⁻¹ for radiance, without cosine. 0 where only delta lobes exist.
    pub fn eval(&self, _w_l: Vec3, _w_e: Vec3) -> Spectrum<N> {
        Spectrum::ZERO
    }
    /// Solid-angle density with which [`Self::sample`] returns `to` as non-specular.
    pub fn pdf(&self, _from: Vec3, _to: Vec3, _dir: Transport) -> f32 {
        0.0
    }
    /// Samples a direction and a mode. `uc` chooses the lobe, `u` the direction.
    pub fn sample(&self, _from: Vec3, _dir: Transport, _uc: f32, _u: Vec2) -> Option<BsdfSample> {
        None
    }
    /// The direction into which the delta lobe `mode` sends `from`; `None` if there is no such lobe or total reflection.
    pub fn deflect(&self, _from: Vec3, _mode: Mode, _dir: Transport) -> Option<Vec3> {
        None
    }
    /// Value and probabilities of the delta lobe `mode` for a pair that [`Self::deflect`] made.
    pub fn specular(&self, _w_l: Vec3, _w_e: Vec3, _mode: Mode) -> Option<Specular<N>> {
        None
    }
    /// Some lobe is non-delta.
    pub fn has_non_specular(&self) -> bool {
        false
    }
    /// Some lobe is delta.
    pub fn has_specular(&self) -> bool {
        false
    }
    /// The geometry of scattering depends on the wavelength (only lane 0 counts then).
    pub fn is_dispersive(&self) -> bool {
        false
    }
}
