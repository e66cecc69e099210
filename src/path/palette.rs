//! Spectra at one set of wavelengths, remembered.
//!
//! A chain keeps its wavelengths for many steps, and most surfaces look the same all over: their lobes are computed once
//! for each set of wavelengths instead of once a hit.

use crate::scatter::{Bsdf, shade};
use crate::scene::spectrum::{Lanes, Spectrum};
use crate::scene::{Light, NONE, Scene};
use glam::Vec2;
use std::cell::Cell;

/// Materials and lights remembered at once; those whose numbers differ by a multiple of it displace each other.
const SLOTS: usize = 16;

/// Wavelengths with what surfaces and lights are at them.
pub struct Palette<const N: usize> {
    lanes: Lanes<N>,
    /// Which material each of `lobes` belongs to.
    materials: [Cell<u32>; SLOTS],
    lobes: [Cell<Bsdf<N>>; SLOTS],
    /// Which light each of `emissions` belongs to.
    lights: [Cell<u32>; SLOTS],
    emissions: [Cell<Spectrum<N>>; SLOTS],
}

impl<const N: usize> Palette<N> {
    /// Nothing remembered yet.
    pub fn new(lanes: Lanes<N>) -> Self {
        Self {
            lanes,
            materials: [const { Cell::new(NONE) }; SLOTS],
            lobes: [const { Cell::new(Bsdf::Black) }; SLOTS],
            lights: [const { Cell::new(NONE) }; SLOTS],
            emissions: [const { Cell::new(Spectrum::ZERO) }; SLOTS],
        }
    }

    /// The wavelengths.
    #[inline]
    pub fn lanes(&self) -> &Lanes<N> {
        &self.lanes
    }

    /// Changes to other wavelengths, if they are others.
    #[inline]
    pub fn tune(&mut self, lanes: &Lanes<N>) {
        if self.lanes.u != lanes.u {
            self.lanes = *lanes;
            self.materials = [const { Cell::new(NONE) }; SLOTS];
            self.lights = [const { Cell::new(NONE) }; SLOTS];
        }
    }

    /// The lobes of a material that is no mix.
    #[inline]
    pub fn lobes(&self, scene: &Scene, material: u32, uv: Vec2) -> Bsdf<N> {
        if material == NONE {
            return Bsdf::Black;
        }
        let slot = material as usize % SLOTS;
        if self.materials[slot].get() == material {
            return self.lobes[slot].get();
        }
        let bsdf = shade(scene, material, uv, &self.lanes);
        if scene
            .materials
            .get(material as usize)
            .is_some_and(|m| m.is_uniform())
        {
            self.materials[slot].set(material);
            self.lobes[slot].set(bsdf);
        }
        bsdf
    }

    /// What light `light` emits, before the part that depends on the direction; 0 where there is none.
    #[inline]
    pub fn emission(&self, scene: &Scene, light: u32) -> Spectrum<N> {
        if light == NONE {
            return Spectrum::ZERO;
        }
        let slot = light as usize % SLOTS;
        if self.lights[slot].get() != light {
            self.lights[slot].set(light);
            self.emissions[slot].set(emission(scene, light, &self.lanes));
        }
        self.emissions[slot].get()
    }
}

/// Radiance of an area light, intensity of a point, irradiance of a distant light; 0 for the sky's parts, whose emission
/// depends on the direction.
pub(super) fn emission<const N: usize>(scene: &Scene, light: u32, lanes: &Lanes<N>) -> Spectrum<N> {
    match scene.lights.get(light as usize) {
        Some(Light::Area { radiance: c, .. })
        | Some(Light::Point { intensity: c, .. })
        | Some(Light::Spot { intensity: c, .. })
        | Some(Light::Distant { irradiance: c, .. }) => c.eval(lanes),
        _ => Spectrum::ZERO,
    }
}
