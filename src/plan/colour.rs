//! Whether a scene has colour beyond that of its light: some spectrum that is not a multiple of the one illuminant.
//!
//! Multiples are told at every whole nanometre, to within the rounding of the numbers compared. What depends on a texture
//! is grey only if all its texels are, to the bit.

use super::Cause;
use super::reach::is_black_texture;
use crate::real::{Convert, Real};
use crate::scene::material::ConductorFresnel;
use crate::scene::spectrum::Curve;
use crate::scene::texture::{Image, SpectrumTexture};
use crate::scene::{Light, Material, Scene};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Two spectra whose ratio varies by less than this are the same but for a factor: some roundings of f32.
const SAME: f32 = 1e-6;

/// What gives the scene colour, and the illuminant that all lights share if nothing does.
pub(super) fn colours(scene: &Scene, live: &[bool], lit: &[bool]) -> (Vec<Cause>, Curve) {
    let mut causes = Vec::new();
    let mut greys = Greys::new(&scene.images);
    for (i, m) in scene.materials.iter().enumerate() {
        if live[i] && !greys.material(m) {
            causes.push(Cause::material(scene, i, "has a colour"));
        }
    }
    let mut illuminant: Option<(usize, &Curve)> = None;
    for (i, l) in scene.lights.iter().enumerate().filter(|l| lit[l.0]) {
        let curve = spectrum(l);
        if let Light::InfiniteImage { image, .. } = l
            && !greys.image(*image)
        {
            causes.push(Cause::light(scene, i, "has an image with colours"));
        }
        match illuminant {
            None => illuminant = Some((i, curve)),
            Some((first, one)) if !is_multiple(curve, one) => {
                let other = scene.sources.lights.get(first);
                let other = other.map_or(String::new(), |s| format!(" than {s}"));
                let text = format!("has another spectrum{other}");
                causes.push(Cause::light(scene, i, &text));
            }
            Some(_) => {}
        }
    }
    let curve = illuminant.map_or(Curve::Constant(1.0), |(_, c)| c.clone());
    (causes, curve)
}

/// What a light emits, up to the colours of its image.
pub(super) fn spectrum(light: &Light) -> &Curve {
    match light {
        Light::Area { radiance: c, .. }
        | Light::Point { intensity: c, .. }
        | Light::Spot { intensity: c, .. }
        | Light::Distant { irradiance: c, .. }
        | Light::InfiniteConstant { radiance: c }
        | Light::InfiniteImage { illuminant: c, .. } => c,
    }
}

/// Which materials are grey. Images are looked through once.
struct Greys<'a> {
    images: &'a [Image],
    known: BTreeMap<u32, bool>,
}

impl<'a> Greys<'a> {
    fn new(images: &'a [Image]) -> Self {
        let known = BTreeMap::new();
        Self { images, known }
    }

    fn image(&mut self, image: u32) -> bool {
        let images = self.images;
        *self.known.entry(image).or_insert_with(|| {
            let texels = images.get(image as usize).into_iter().flat_map(Image::rgb);
            texels.into_iter().all(|[r, g, b]| r == g && g == b)
        })
    }

    fn texture(&mut self, t: &SpectrumTexture) -> bool {
        match t {
            SpectrumTexture::Constant(c) => is_flat(c),
            SpectrumTexture::Image(m) => self.image(m.image),
            SpectrumTexture::Scale(a, _) => is_black_texture(t) || self.texture(a),
            SpectrumTexture::Checkerboard(_, a, b) => self.texture(a) && self.texture(b),
        }
    }

    /// A mix is what its parts are, which are live themselves.
    fn material(&mut self, m: &Material) -> bool {
        match m {
            Material::Diffuse { reflectance } => self.texture(reflectance),
            Material::Conductor { fresnel, .. } => match fresnel {
                ConductorFresnel::EtaK { eta, k } => is_flat(eta) && is_flat(k),
                ConductorFresnel::Reflectance(r) => self.texture(r),
            },
            Material::Dielectric { eta, .. } | Material::ThinDielectric { eta } => is_flat(eta),
            Material::CoatedDiffuse {
                reflectance, eta, ..
            } => self.texture(reflectance) && is_flat(eta),
            Material::Mix { .. } => true,
        }
    }
}

/// The same at every wavelength.
fn is_flat(c: &Curve) -> bool {
    match c {
        Curve::Constant(_) => true,
        _ => is_multiple(c, &Curve::Constant(1.0)),
    }
}

/// One is the other times a number.
fn is_multiple(a: &Curve, b: &Curve) -> bool {
    match (a, b) {
        (Curve::Constant(_), Curve::Constant(_)) => return true,
        (Curve::Table { table: a, .. }, Curve::Table { table: b, .. }) if Arc::ptr_eq(a, b) => {
            return true;
        }
        (
            Curve::Illuminant {
                table: a, shape: s, ..
            },
            Curve::Illuminant {
                table: b, shape: t, ..
            },
        ) if Arc::ptr_eq(a, b) && s == t => return true,
        _ => {}
    }
    let samples = |c: &Curve| -> Vec<Real> { (360..=830).map(|l| c.at(l as Real)).collect() };
    let (a, b) = (samples(a), samples(b));
    let Some(top) = (0..b.len()).max_by(|i, j| b[*i].total_cmp(&b[*j])) else {
        return true;
    };
    let (a_top, b_top) = (a[top], b[top]);
    let pairs = a.iter().zip(&b);
    pairs
        .into_iter()
        .all(|(a, b)| (a * b_top - b * a_top).abs() <= SAME.real() * a_top.abs() * b_top.abs())
}
