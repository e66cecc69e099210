//! Directives that make up the scene: options, materials, textures, shapes, lights, objects.

use super::error::{Location, Result, SceneError};
use super::material::MaterialRef;
use super::objects::Definition;
use super::params::{Params, Type};
use super::state::{ATTRIBUTE_TARGETS, Library, Loader, Pending, source};
use super::token::Tokenizer;
use glam::DMat4;
use std::rc::Rc;

impl Loader {
    pub(super) fn scene_directive(
        &mut self,
        word: &str,
        t: &mut Tokenizer<'_>,
        at: &Location,
    ) -> Result<()> {
        match word {
            "Camera" => {
                if let Some((view, name)) = self.settings.view() {
                    self.gs.start_active = true;
                    self.gs.ctm = DMat4::IDENTITY;
                    self.read_text(&view, &name)?;
                }
                let pending = self.prelude(word, "camera", t, at)?;
                let to_world = self.gs.ctm.inverse();
                self.coordinate_systems.insert("camera".into(), to_world);
                self.prelude.camera = Some((pending, self.gs.ctm));
            }
            "Film" => self.prelude.film = Some(self.prelude(word, "film", t, at)?),
            "PixelFilter" => self.prelude.filter = Some(self.prelude(word, "filter", t, at)?),
            "Sampler" => self.prelude.sampler = Some(self.prelude(word, "sampler", t, at)?),
            "Integrator" => {
                self.prelude.integrator = Some(self.prelude(word, "integrator", t, at)?)
            }
            "Accelerator" => drop(pending(word, t, at)?),
            "Material" => {
                let p = self.named_params(word, "material", t, at)?;
                self.gs.material = self.make_material(&p.kind, p.kind.clone(), &p.params)?;
            }
            "MakeNamedMaterial" => self.make_named_material(t, at)?,
            "NamedMaterial" => {
                let name = t.string("the name of a material")?;
                let Some(m) = self.library.names.get(&name) else {
                    return Err(SceneError::value(&t.at(), "unknown material")
                        .found(format!("\"{name}\""))
                        .expected(self.material_names()));
                };
                self.gs.material = *m;
            }
            "Texture" => self.texture(t, at)?,
            "Shape" => {
                let p = self.named_params(word, "shape", t, at)?;
                self.shape(&p.kind, &p.params)?;
            }
            "AreaLightSource" => {
                let mut p = self.named_params(word, "light", t, at)?;
                self.settings.apply_to_light(1, &mut p.params)?;
                let made = self.library.area_light(&p.kind, &p.params);
                self.gs.area_light = self.tolerate(made)?.map(Rc::new);
                if self.gs.area_light.is_some() {
                    self.complain(p.params.unused(&[]))?;
                }
            }
            "LightSource" => {
                let mut p = self.named_params(word, "light", t, at)?;
                self.settings.apply_to_light(0, &mut p.params)?;
                let ctm = self.gs.ctm;
                let made = self.library.light(&p.kind, &p.params, &ctm);
                if let Some(light) = self.tolerate(made)? {
                    self.lights.push(light);
                    self.complain(p.params.unused(&[]))?;
                }
            }
            "MakeNamedMedium" | "MediumInterface" => {
                t.string("the name of a medium")?;
                if word == "MediumInterface" {
                    if t.peek() == Some(b'"') {
                        t.string("the name of a medium")?;
                    }
                } else {
                    Params::parse(t, word.into(), at.clone())?;
                }
                let e = SceneError::unsupported(at, "participating media are not supported")
                    .found(word);
                self.complain(vec![e])?;
            }
            "ObjectBegin" => self.object_begin(t, at)?,
            "ObjectEnd" => {
                let Some(object) = self.object.take() else {
                    return Err(SceneError::syntax(at, "ObjectEnd without ObjectBegin"));
                };
                self.pop("ObjectBegin", word, at)?;
                self.objects.define(object);
            }
            "ObjectInstance" => self.object_instance(t, at)?,
            _ => self.skip(word, t, at)?,
        }
        Ok(())
    }

    /// A directive before WorldBegin, with the changes to it.
    fn prelude(
        &mut self,
        word: &str,
        target: &str,
        t: &mut Tokenizer<'_>,
        at: &Location,
    ) -> Result<Pending> {
        let mut p = pending(word, t, at)?;
        self.settings.apply(target, &mut p.params)?;
        Ok(p)
    }

    /// A directive with its kind and parameters, followed by the defaults of `Attribute`.
    fn named_params(
        &self,
        word: &str,
        target: &str,
        t: &mut Tokenizer<'_>,
        at: &Location,
    ) -> Result<Pending> {
        let mut p = pending(word, t, at)?;
        self.add_defaults(&mut p.params, target);
        Ok(p)
    }

    fn add_defaults(&self, p: &mut Params, target: &str) {
        let i = ATTRIBUTE_TARGETS.iter().position(|k| *k == target);
        p.defaults = i.map_or(Vec::new(), |i| self.gs.defaults[i].clone());
    }

    /// Makes a material; a lenient reader puts the default one in the place of one that is not supported.
    fn make_material(&mut self, kind: &str, label: String, p: &Params) -> Result<MaterialRef> {
        let made = self.library.material(kind, p);
        let Some(made) = self.tolerate(made)? else {
            return Ok(MaterialRef::Default);
        };
        let departures = self.library.departures(kind, p)?;
        self.complain(departures)?;
        self.complain(p.unused(Library::harmless(kind)))?;
        Ok(match made {
            None => MaterialRef::Interface,
            Some(m) => self.add_material(m, source(label, &p.at)),
        })
    }

    fn make_named_material(&mut self, t: &mut Tokenizer<'_>, at: &Location) -> Result<()> {
        let name = t.string("the name of a material")?;
        let owner = format!("MakeNamedMaterial \"{name}\"");
        let mut p = Params::parse(t, owner, at.clone())?;
        self.settings.apply(&format!("material {name}"), &mut p)?;
        self.add_defaults(&mut p, "material");
        let Some(kind) = p.typed("type", &[Type::String])? else {
            return Err(
                SceneError::value(at, format!("material \"{name}\" has no type"))
                    .expected("\"string type\""),
            );
        };
        let kind = kind.strings().first().cloned().unwrap_or_default();
        if self.library.names.contains_key(&name) {
            return Err(SceneError::value(at, "a material of this name exists")
                .found(format!("\"{name}\"")));
        }
        let m = self.make_material(&kind, format!("{kind} \"{name}\""), &p)?;
        self.library.names.insert(name, m);
        Ok(())
    }

    /// The known materials, for an error message.
    fn material_names(&self) -> String {
        let mut names: Vec<_> = self
            .library
            .names
            .keys()
            .filter(|n| !n.starts_with('\0'))
            .map(|n| format!("\"{n}\""))
            .collect();
        names.sort();
        match names.len() {
            0 => "a MakeNamedMaterial above".into(),
            1..=12 => format!("one of {}", names.join(", ")),
            n => format!("one of {n} names such as {}", names[..8].join(", ")),
        }
    }

    fn texture(&mut self, t: &mut Tokenizer<'_>, at: &Location) -> Result<()> {
        let name = t.string("the name of a texture")?;
        let kind = t.string("\"float\" or \"spectrum\"")?;
        let class = t.string("a kind of texture")?;
        let mut p = Params::parse(t, format!("Texture \"{name}\""), at.clone())?;
        self.settings.apply(&format!("texture {name}"), &mut p)?;
        self.add_defaults(&mut p, "texture");
        let made = self.library.define_texture(&name, &kind, &class, &p);
        match self.tolerate(made)? {
            Some(unused) => self.complain(unused),
            None => {
                self.library.stand_in_texture(&name, &kind);
                Ok(())
            }
        }
    }

    fn object_begin(&mut self, t: &mut Tokenizer<'_>, at: &Location) -> Result<()> {
        let name = t.string("the name of an object")?;
        if self.object.is_some() {
            return Err(SceneError::syntax(at, "ObjectBegin inside an object"));
        }
        if self.objects.knows(&name) {
            return Err(
                SceneError::value(at, "an object of this name exists").found(format!("\"{name}\""))
            );
        }
        self.push("ObjectBegin", at);
        self.object = Some(Definition {
            name,
            at: at.clone(),
            shapes: Vec::new(),
        });
        Ok(())
    }

    fn object_instance(&mut self, t: &mut Tokenizer<'_>, at: &Location) -> Result<()> {
        let name = t.string("the name of an object")?;
        if self.object.is_some() {
            return Err(SceneError::syntax(at, "ObjectInstance inside an object"));
        }
        if !self.objects.knows(&name) {
            return Err(SceneError::value(&t.at(), "unknown object")
                .found(format!("\"{name}\""))
                .expected("a name given to ObjectBegin above"));
        }
        self.objects.place(&name, &self.gs.ctm, at)
    }
}

fn pending(word: &str, t: &mut Tokenizer<'_>, at: &Location) -> Result<Pending> {
    let kind = t.string(&format!("the kind of {word}"))?;
    let params = Params::parse(t, format!("{word} \"{kind}\""), at.clone())?;
    Ok(Pending { kind, params })
}
