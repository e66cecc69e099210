//! What in a scene calls for each effect, with its place.

use super::reach::{certain, is_black_material, used_shapes};
use super::{Effect, colour, objects, slivers};
use crate::scene::load::Location;
use crate::scene::material::ConductorFresnel;
use crate::scene::spectrum::Curve;
use crate::scene::{Light, Material, Scene, Source};
use serde::{Serialize, Serializer};

/// Something that calls for an effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cause {
    /// What it is, and why it does.
    pub what: String,
    /// Where it stands in the scene file; `None` for what the command line says.
    #[serde(serialize_with = "place")]
    pub at: Option<Location>,
}

fn place<S: Serializer>(at: &Option<Location>, s: S) -> Result<S::Ok, S::Error> {
    match at {
        Some(at) => s.collect_str(at),
        None => s.serialize_none(),
    }
}

impl std::fmt::Display for Cause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.at {
            Some(at) => write!(f, "{} ({at})", self.what),
            None => f.write_str(&self.what),
        }
    }
}

impl Cause {
    /// From what the command line says.
    pub fn option(what: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            at: None,
        }
    }

    fn of(source: Option<&Source>, otherwise: &str, why: &str) -> Self {
        let label = source.map_or(otherwise, |s| &s.label);
        let space = if why.is_empty() { "" } else { " " };
        Self {
            what: format!("{label}{space}{why}"),
            at: source.map(|s| s.at.clone()),
        }
    }

    pub(super) fn material(scene: &Scene, i: usize, why: &str) -> Self {
        Self::of(scene.sources.materials.get(i), "a material", why)
    }

    pub(super) fn shape(scene: &Scene, i: usize, why: &str) -> Self {
        Self::of(scene.sources.shapes.get(i), "a shape", why)
    }

    pub(super) fn light(scene: &Scene, i: usize, why: &str) -> Self {
        Self::of(scene.sources.lights.get(i), "a light", why)
    }
}

/// The causes of every effect but the perturbations, and the illuminant of the scene if it has no colour.
pub(super) struct Causes {
    by_effect: [Vec<Cause>; Effect::ALL.len()],
    pub(super) illuminant: Curve,
}

impl Causes {
    /// Looks through the scene; `live` materials, `lit` lights and shapes that are not `unseen` count. Objects may become
    /// `flat` more primitives in the world.
    pub(super) fn new(
        scene: &Scene,
        live: &[bool],
        lit: &[bool],
        unseen: &[bool],
        flat: u64,
    ) -> Self {
        let (colours, illuminant) = colour::colours(scene, live, lit);
        let mut all = Self {
            by_effect: Default::default(),
            illuminant,
        };
        all.by_effect[Effect::Colour as usize] = colours;
        let (mut specular, mut rough) = (Vec::new(), false);
        for (i, m) in scene.materials.iter().enumerate().filter(|m| live[m.0]) {
            let cause = |why: &str| Cause::material(scene, i, why);
            if m.is_dispersive() {
                all.add(
                    Effect::Dispersion,
                    cause("has an index that varies with the wavelength"),
                );
            }
            // A lobe that sends nothing on is none.
            let sends = !is_black_material(m);
            if sends && m.may_be_specular() {
                specular.push(cause("has a delta lobe"));
            }
            rough |= sends && m.may_be_non_specular();
            if let Some(what) = varies(m) {
                all.add(Effect::Textures, cause(&format!("has a textured {what}")));
            }
        }
        let depth = scene.settings.max_depth;
        let integrator = scene.sources.integrator.as_ref();
        if depth > 1 {
            let why = format!("lets light scatter up to {depth} times");
            all.add(
                Effect::Indirect,
                Cause::of(integrator, "the maximal depth", &why),
            );
        }
        // LS⁺DE, which both suit, scatters twice at least.
        for effect in [Effect::Caustic, Effect::MultiChain] {
            if rough && depth >= 2 {
                specular.iter().for_each(|c| all.add(effect, c.clone()));
            }
        }
        all.by_effect[Effect::Specular as usize] = specular;
        if scene.camera.lens_radius > 0.0 {
            let why = format!("has a lens of radius {}", scene.camera.lens_radius);
            let camera = scene.sources.camera.as_ref();
            all.add(Effect::Aperture, Cause::of(camera, "the camera", &why));
        }
        for (i, l) in scene.lights.iter().enumerate().filter(|l| lit[l.0]) {
            if is_environment(l) {
                let cause = Cause::light(scene, i, "shines from every direction");
                all.add(Effect::Environment, cause);
            }
        }
        let of_objects = scene.sources.objects.iter().map(|o| o.1.as_slice());
        let sources = std::iter::once(scene.sources.shapes.as_slice()).chain(of_objects);
        let used = used_shapes(scene, unseen);
        for ((part, used), sources) in scene.geometry.parts().zip(used).zip(sources) {
            for (i, aspect) in slivers::slivers(part) {
                if used[i] {
                    let why = format!("has a triangle {aspect:.1e} times as long as high");
                    all.add(Effect::Slivers, Cause::of(sources.get(i), "a shape", &why));
                }
            }
            for (i, s) in part.shapes.iter().enumerate() {
                if used[i] && s.has_normals {
                    let cause = Cause::of(sources.get(i), "a shape", "has vertex normals");
                    all.add(Effect::Normals, cause);
                }
            }
        }
        let uses = scene.geometry.uses();
        let instanced = objects::instanced(&scene.geometry, flat);
        for (i, (source, _)) in scene.sources.objects.iter().enumerate() {
            if instanced[i] {
                let count = scene.geometry.objects[i].prim_count();
                let why = format!("of {count} primitives stands in {} places", uses[i]);
                let cause = Cause::of(Some(source), "an object", &why);
                all.add(Effect::Instances, cause);
            }
        }
        for causes in &mut all.by_effect {
            unique(causes);
        }
        all
    }

    fn add(&mut self, effect: Effect, cause: Cause) {
        self.by_effect[effect as usize].push(cause);
    }

    /// What calls for `effect`, in the order of the scene file; empty if nothing does.
    pub(super) fn take(&mut self, effect: Effect) -> Vec<Cause> {
        std::mem::take(&mut self.by_effect[effect as usize])
    }
}

/// One cause for each place: a mesh of lights is one directive.
fn unique(causes: &mut Vec<Cause>) {
    let mut seen = std::collections::HashSet::new();
    causes.retain(|c| seen.insert((c.at.clone(), c.what.clone())));
}

/// A light that fills directions at infinity.
pub(super) fn is_environment(l: &Light) -> bool {
    matches!(
        l,
        Light::InfiniteConstant { .. } | Light::InfiniteImage { .. }
    )
}

/// What of a material comes from a texture.
fn varies(m: &Material) -> Option<&'static str> {
    let rough = |r: &crate::scene::material::Roughness| !r.is_uniform();
    Some(match m {
        Material::Diffuse { reflectance } | Material::CoatedDiffuse { reflectance, .. }
            if !reflectance.is_uniform() =>
        {
            "reflectance"
        }
        Material::Conductor {
            fresnel: ConductorFresnel::Reflectance(r),
            ..
        } if !r.is_uniform() => "reflectance",
        Material::Conductor { roughness, .. }
        | Material::Dielectric { roughness, .. }
        | Material::CoatedDiffuse { roughness, .. }
            if rough(roughness) =>
        {
            "roughness"
        }
        // Which part a point has is asked of the point, as with a texture.
        Material::Mix { .. } if certain(m).is_none() => "mixture",
        _ => return None,
    })
}
