//! Scenes with an effect taken out, or put in without changing the image.
//!
//! Taking out is what `--without` does: the last cause goes. Putting in is what `--force` does: a cause that is really
//! simulated and whose part of the image is nothing, so that it shows what simulating it costs.

use super::Effect;
use super::causes::is_environment;
use super::reach::certain;
use crate::real::{Convert, Real};
use crate::scene::flatten::{flatten, put_behind};
use crate::scene::material::{ConductorFresnel, Roughness};
use crate::scene::spectrum::{Curve, rgb_albedo};
use crate::scene::texture::{FloatTexture, Image, SpectrumTexture, UvMapping};
use crate::scene::{Light, Material, Scene};
use glam::{Vec2, Vec3};

/// Wavelength of the index that glass keeps without dispersion: the yellow helium line that n_d stands for, nm.
const D_LINE: Real = 587.6;

/// Radius of a forced aperture over the width of a pixel at the distance in focus: far below what can be seen.
const PINPRICK: f32 = 1e-3;

/// Takes every cause of `effect` out of the scene. What is a matter of how it is simulated alone — colour, slivers and
/// the perturbations — is not a matter of the scene; alpha the loader has dealt with.
pub fn remove(effect: Effect, scene: &mut Scene) {
    match effect {
        Effect::Dispersion => {
            for m in &mut scene.materials {
                if let Material::Dielectric { eta, .. } | Material::CoatedDiffuse { eta, .. } = m {
                    *eta = Curve::Constant(eta.at(D_LINE).single());
                }
            }
        }
        Effect::Specular => scene.materials.iter_mut().for_each(matt),
        Effect::Aperture => scene.camera.lens_radius = 0.0,
        Effect::Environment => {
            for l in &mut scene.lights {
                if is_environment(l) {
                    let radiance = Curve::Constant(0.0);
                    *l = Light::InfiniteConstant { radiance };
                }
            }
        }
        Effect::Textures => {
            for i in 0..scene.materials.len() {
                plain(&mut scene.materials[i], &scene.images);
            }
            fold(scene);
        }
        Effect::Normals => scene
            .geometry
            .shapes_mut()
            .for_each(|s| s.has_normals = false),
        Effect::Instances => flatten(scene, |_| true),
        Effect::Indirect => scene.settings.max_depth = scene.settings.max_depth.min(1),
        Effect::Colour | Effect::Caustic | Effect::MultiChain | Effect::Alpha | Effect::Slivers => {
        }
    }
}

/// Puts a cause of `effect` into the scene that changes nothing in its image. As with [`remove`] some effects are not a
/// matter of the scene.
pub fn insert(effect: Effect, scene: &mut Scene) {
    match effect {
        Effect::Aperture if scene.camera.lens_radius <= 0.0 => {
            let c = &mut scene.camera;
            let pixel = (c.screen[1] - c.screen[0]).abs() / c.resolution[0].max(1) as f32;
            c.lens_radius = (PINPRICK * pixel * c.focal_distance).max(f32::MIN_POSITIVE);
            // Where everything is in focus the lens may stay that small in the scene's own units.
            let (_, radius) = scene.geometry.bounding_sphere();
            c.lens_radius = c.lens_radius.min(PINPRICK * pixel * radius);
        }
        Effect::Environment => {
            let radiance = Curve::Constant(0.0);
            scene.lights.push(Light::InfiniteConstant { radiance });
        }
        Effect::Textures => {
            let identity = UvMapping {
                scale: Vec2::ONE,
                offset: Vec2::ZERO,
            };
            for m in &mut scene.materials {
                if let Material::Diffuse { reflectance: t }
                | Material::CoatedDiffuse { reflectance: t, .. }
                | Material::Conductor {
                    fresnel: ConductorFresnel::Reflectance(t),
                    ..
                } = m
                    && t.is_uniform()
                {
                    let same = t.clone();
                    *t = SpectrumTexture::Checkerboard(identity, same.clone().into(), same.into());
                }
            }
        }
        Effect::Normals => {
            let g = &mut scene.geometry;
            let (objects, world) = (std::mem::take(&mut g.objects), g);
            let mut objects = objects;
            for part in objects.iter_mut().chain([&mut *world]) {
                // A normal of length 0 stands for the geometric one.
                part.normals.resize(part.positions.len(), Vec3::ZERO);
                part.shapes.iter_mut().for_each(|s| s.has_normals = true);
            }
            world.objects = objects;
        }
        Effect::Instances if scene.geometry.instances.is_empty() => put_behind(scene),
        _ => {}
    }
}

/// Replaces mixes that are certainly one of their parts by that part, wherever a surface is made of one.
pub fn fold(scene: &mut Scene) {
    for s in scene.geometry.shapes_mut() {
        let mut steps = scene.materials.len();
        while let Some(part) = scene.materials.get(s.material as usize).and_then(certain)
            && steps > 0
        {
            s.material = part;
            steps -= 1;
        }
    }
}

/// A material without its delta lobes.
fn matt(m: &mut Material) {
    if !m.may_be_specular() {
        return;
    }
    let reflectance = match m {
        Material::CoatedDiffuse { reflectance, .. } => reflectance.clone(),
        _ => SpectrumTexture::Constant(Curve::Constant(0.0)),
    };
    *m = Material::Diffuse { reflectance };
}

/// A material with one value in place of each texture.
fn plain(m: &mut Material, images: &[Image]) {
    let spectrum = |t: &mut SpectrumTexture| *t = SpectrumTexture::Constant(one(t, images));
    let rough = |r: &mut Roughness| {
        for t in [&mut r.u, &mut r.v] {
            *t = FloatTexture::Constant(number(t, images));
        }
    };
    match m {
        Material::Diffuse { reflectance } => spectrum(reflectance),
        Material::Conductor { fresnel, roughness } => {
            rough(roughness);
            if let ConductorFresnel::Reflectance(r) = fresnel {
                spectrum(r);
            }
        }
        Material::Dielectric { roughness, .. } => rough(roughness),
        Material::CoatedDiffuse {
            reflectance,
            roughness,
            ..
        } => {
            spectrum(reflectance);
            rough(roughness);
        }
        // The part with the greater weight.
        Material::Mix { amount, .. } => {
            let heavier = number(amount, images).round();
            *amount = FloatTexture::Constant(heavier);
        }
        Material::ThinDielectric { .. } => {}
    }
}

/// The mean of an image's texels, as the map shows them.
fn mean(m: &crate::scene::texture::ImageMap, images: &[Image]) -> [f32; 3] {
    let Some(image) = images.get(m.image as usize) else {
        return [0.0; 3];
    };
    let mut sum = [0.0f64; 3];
    for c in image.rgb() {
        (0..3).for_each(|i| sum[i] += c[i] as f64);
    }
    let n = (image.width as f64 * image.height as f64).max(1.0);
    sum.map(|v| {
        let v = (v / n) as f32 * m.scale;
        if m.invert { (1.0 - v).max(0.0) } else { v }
    })
}

fn number(t: &FloatTexture, images: &[Image]) -> f32 {
    match t {
        FloatTexture::Constant(v) => *v,
        FloatTexture::Image(m) => mean(m, images).iter().sum::<f32>() / 3.0,
        FloatTexture::Scale(a, b) => number(a, images) * number(b, images),
        FloatTexture::Checkerboard(_, a, b) => 0.5 * (number(a, images) + number(b, images)),
    }
}

fn one(t: &SpectrumTexture, images: &[Image]) -> Curve {
    match t {
        SpectrumTexture::Constant(c) => c.clone(),
        SpectrumTexture::Image(m) => rgb_albedo(mean(m, images)),
        SpectrumTexture::Scale(a, b) => one(a, images).scaled(number(b, images)),
        // Of two colours the first: their mean may be no curve of the same kind.
        SpectrumTexture::Checkerboard(_, a, _) => one(a, images),
    }
}
