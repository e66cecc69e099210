//! How lights are chosen: each with a probability in proportion to its luminous power.
//!
//! Power is known without rays, so every light that takes part has its chance, however few paths would find it. What a
//! look with rays finds of a light is no better guide: the light that is hardest to find it does not find, and a
//! probability of almost 0 for it would leave it to rare and bright samples. What power does not know is what stands in a
//! light's way; where that matters the bidirectional samples and the chain make up for it.

use super::Cause;
use crate::scene::spectrum::{Curve, luminance};
use crate::scene::{Light, Scene};
use serde::Serialize;
use std::f64::consts::PI;

/// Luminous power of each light (radiant power weighted with ȳ, no factor of 683 lm/W) that reaches the sphere around the
/// scene, for lights at infinity through its disk; 0 where `lit` does not hold.
pub fn light_powers<'s>(scene: &'s Scene, lit: impl Fn(usize) -> bool) -> Vec<f64> {
    let (_, radius) = scene.bounding_sphere();
    let disk = PI * (radius as f64).powi(2);
    // The triangles of a lamp share their spectrum, whose integral is most of the work.
    let mut last: Option<(&'s Curve, f64)> = None;
    let mut y = |c: &'s Curve| match last {
        Some((known, y)) if known == c => y,
        _ => {
            let y = luminance(c) as f64;
            last = Some((c, y));
            y
        }
    };
    let mut power = |light: &'s Light| match light {
        Light::Area {
            prim,
            two_sided,
            radiance,
        } => {
            let sides = if *two_sided { 2.0 } else { 1.0 };
            y(radiance) * scene.geometry.area(*prim) * PI * sides
        }
        Light::Point { intensity, .. } => 4.0 * PI * y(intensity),
        Light::Spot {
            intensity,
            cos_start,
            cos_end,
            ..
        } => 2.0 * PI * (1.0 - 0.5 * (cos_start + cos_end) as f64) * y(intensity),
        Light::Distant { irradiance, .. } => disk * y(irradiance),
        Light::InfiniteConstant { radiance } => PI * disk * y(radiance),
        Light::InfiniteImage {
            image, illuminant, ..
        } => {
            let image = &scene.images[*image as usize];
            let (mut sum, mut count) = (0.0, 0usize);
            for c in image.rgb() {
                sum += ((c[0] + c[1] + c[2]) / 3.0) as f64;
                count += 1;
            }
            PI * disk * y(illuminant) * (sum / count.max(1) as f64)
        }
    };
    let lights = scene.lights.iter().enumerate();
    lights
        .map(|(i, light)| if lit(i) { power(light) } else { 0.0 })
        .collect()
}

/// How often the lights of one directive are chosen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Chosen {
    /// Where they stand, and what they are.
    pub light: Cause,
    /// Lights of this directive that take part: a mesh has one for each triangle.
    pub count: usize,
    /// Their part of the luminous power, which is the probability that one of them is chosen.
    pub part: f64,
}

/// The lights that take part by directive, those that are chosen most often first.
pub(super) fn chosen(scene: &Scene, lit: &[bool], power: &[f64]) -> Vec<Chosen> {
    let total: f64 = power.iter().sum();
    let mut all: Vec<Chosen> = Vec::new();
    let mut place = std::collections::HashMap::new();
    for (i, power) in power.iter().enumerate().filter(|p| lit[p.0]) {
        let light = Cause::light(scene, i, "");
        let part = if total > 0.0 { power / total } else { 0.0 };
        let at = *place
            .entry((light.at.clone(), light.what.clone()))
            .or_insert(all.len());
        match all.get_mut(at) {
            Some(c) => {
                c.count += 1;
                c.part += part;
            }
            None => all.push(Chosen {
                light,
                count: 1,
                part,
            }),
        }
    }
    all.sort_by(|a, b| b.part.total_cmp(&a.part));
    all
}
