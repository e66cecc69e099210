//! Spectra at one set of wavelengths, remembered.
//!
//! A chain keeps its wavelengths for many steps, and most surfaces look the same all over: their lobes are computed once
//! for each set of wavelengths instead of once a hit.

use crate::accel::Surface;
use crate::scatter::{Bsdf, resolve_mix, shade};
use crate::scene::spectrum::{Lanes, Spectrum};
use crate::scene::{Light, Material, NONE, Scene};
use std::cell::Cell;

/// Materials and lights remembered at once; those whose numbers differ by a multiple of it displace each other.
const SLOTS: usize = 16;

/// What a surface point is made of.
#[derive(Clone, Copy, Debug)]
pub struct Finish<const N: usize> {
    /// The material itself, or what a mixture is at this point.
    pub material: u32,
    /// Its lobes need a tangent.
    pub directed: bool,
    /// Lobes at the palette's wavelengths.
    pub bsdf: Bsdf<N>,
}

impl<const N: usize> Finish<N> {
    const BLACK: Self = Self {
        material: NONE,
        directed: false,
        bsdf: Bsdf::Black,
    };
}

/// Wavelengths with what surfaces and lights are at them.
pub struct Palette<const N: usize> {
    lanes: Lanes<N>,
    /// Which material each of `finishes` belongs to.
    materials: [Cell<u32>; SLOTS],
    finishes: [Cell<Finish<N>>; SLOTS],
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
            finishes: [const { Cell::new(Finish::BLACK) }; SLOTS],
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

    /// What a surface of `material` is made of at `s`.
    #[inline]
    pub fn finish(&self, scene: &Scene, material: u32, s: &Surface) -> Finish<N> {
        let slot = material as usize % SLOTS;
        if self.materials[slot].get() == material {
            return self.finishes[slot].get();
        }
        self.look_up(scene, material, s)
    }

    fn look_up(&self, scene: &Scene, material: u32, s: &Surface) -> Finish<N> {
        let leaf = match scene.materials.get(material as usize) {
            Some(Material::Mix { .. }) => resolve_mix(scene, material, s.uv, s.p),
            _ => material,
        };
        let finish = Finish {
            material: leaf,
            directed: scene
                .materials
                .get(leaf as usize)
                .is_some_and(Material::is_anisotropic),
            bsdf: shade(scene, leaf, s.uv, &self.lanes),
        };
        if scene
            .materials
            .get(material as usize)
            .is_some_and(Material::is_uniform)
        {
            let slot = material as usize % SLOTS;
            self.materials[slot].set(material);
            self.finishes[slot].set(finish);
        }
        finish
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
