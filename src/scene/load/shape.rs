//! `Shape` directives.

use super::error::{Result, SceneError};
use super::mesh::{bilinear_mesh, triangle_mesh};
use super::params::{Params, Type};
use super::place::{Body, Placeable};
use super::quadric::{Disk, Sphere};
use super::state::Loader;
use crate::scene::texture::FloatTexture;
use std::rc::Rc;

/// Parameters of shapes that do not change their image here: no displacement, no motion, numbers of faces unused.
const HARMLESS: [&str; 4] = ["S", "faceIndices", "edgelength", "splitdepth"];

impl Loader {
    /// Reads a shape and puts it into the world or the object being defined.
    pub(super) fn shape(&mut self, kind: &str, p: &Params) -> Result<()> {
        let read = self.bodies(kind, p);
        let Some(bodies) = self.tolerate(read)? else {
            return Ok(());
        };
        let alpha = self.alpha(p);
        let visible = self.tolerate(alpha)?.unwrap_or(true);
        self.complain(p.unused(&HARMLESS))?;
        if !visible {
            if self.gs.area_light.is_some() {
                self.warn(
                    &p.at,
                    "an emissive shape of alpha 0 is left out with its light",
                );
            }
            return Ok(());
        }
        let Some(material) = self.material_index(&p.at) else {
            // Without media an interface is nothing at all; pbrt-v4 drops its light, too.
            if self.gs.area_light.is_some() {
                self.warn(&p.at, "an interface emits no light");
            }
            return Ok(());
        };
        let mut area_light = self.gs.area_light.clone();
        if self.object.is_some() && area_light.is_some() {
            self.warn(&p.at, "shapes of an object do not emit, as in pbrt-v4");
            area_light = None;
        }
        for body in bodies {
            let s = Placeable {
                body,
                to_world: self.gs.ctm,
                reverse: self.gs.reverse,
                material,
                uses_uv: self.library.uses_uv(material),
                area_light: area_light.clone(),
                at: p.at.clone(),
                label: p.owner.as_str().into(),
            };
            match &mut self.object {
                Some(object) => object.shapes.push(s),
                None => self.world.place(&s, None)?,
            }
        }
        Ok(())
    }

    fn bodies(&self, kind: &str, p: &Params) -> Result<Vec<Body>> {
        let mesh = |m| Body::Mesh(Rc::new(m));
        Ok(match kind {
            "trianglemesh" => vec![mesh(triangle_mesh(p)?)],
            "bilinearmesh" => bilinear_mesh(p)?.into_iter().map(mesh).collect(),
            "plymesh" => {
                let Some(name) = p.string_opt("filename")? else {
                    return Err(SceneError::value(&p.at, "plymesh needs a \"filename\""));
                };
                let at = p.get("filename").map_or(&p.at, |q| &q.at);
                let path = self.library.files.resolve(name);
                super::ply::read(&path, at)?.into_iter().map(mesh).collect()
            }
            "loopsubdiv" => vec![mesh(super::subdivision::loop_subdivision(p)?)],
            "sphere" => vec![Body::Sphere(Sphere::parse(p)?)],
            "disk" => vec![Body::Disk(Disk::parse(p)?)],
            other => {
                return Err(
                    SceneError::unsupported(&p.at, "this shape is not supported")
                        .found(format!("\"{other}\""))
                        .expected(
                            "\"trianglemesh\", \"plymesh\", \"bilinearmesh\", \"loopsubdiv\", \
                         \"sphere\" or \"disk\"",
                        ),
                );
            }
        })
    }

    /// False for a shape that is transparent everywhere.
    fn alpha(&self, p: &Params) -> Result<bool> {
        if p.typed("alpha", &[Type::Float, Type::Texture])?.is_none() {
            return Ok(true);
        }
        match self.library.float_texture(p, "alpha", 1.0)? {
            FloatTexture::Constant(a) if a >= 1.0 => Ok(true),
            FloatTexture::Constant(a) if a <= 0.0 => Ok(false),
            _ => {
                let at = p.get("alpha").map_or(&p.at, |q| &q.at);
                Err(SceneError::unsupported(
                    at,
                    "an alpha that is neither 0 nor 1 everywhere is not supported",
                ))
            }
        }
    }
}
