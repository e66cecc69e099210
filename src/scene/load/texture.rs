//! `Texture` directives and parameters that may name one.

use super::error::{Result, SceneError};
use super::image::Encoding;
use super::params::{Param, Params, Type};
use super::spectra::{Role, SPECTRUM, curve};
use super::state::Library;
use crate::scene::spectrum::Curve;
use crate::scene::texture::{FloatTexture, ImageMap, SpectrumTexture, UvMapping, Wrap};
use glam::Vec2;

/// Parameters that choose a texture filter: they change how fast noise goes, not the image it goes to.
const HARMLESS: [&str; 2] = ["filter", "maxanisotropy"];

/// Most parts of one texture. Each use of a name copies what it names, so a chain of textures that use their
/// predecessor twice would double at every step.
const MAX_PARTS: usize = 4096;

impl Library {
    /// Defines a named texture.
    pub(super) fn define_texture(
        &mut self,
        name: &str,
        kind: &str,
        class: &str,
        params: &Params,
    ) -> Result<Vec<SceneError>> {
        match kind {
            "float" => {
                let t = self.float_class(class, params)?;
                too_large(float_parts(&t), params)?;
                self.float_textures.insert(name.into(), t);
            }
            "spectrum" | "color" => {
                let t = self.spectrum_class(class, params)?;
                too_large(spectrum_parts(&t), params)?;
                self.spectrum_textures.insert(name.into(), t);
            }
            other => {
                return Err(SceneError::value(&params.at, "unknown kind of texture")
                    .found(format!("\"{other}\""))
                    .expected("\"float\" or \"spectrum\""));
            }
        }
        Ok(params.unused(&HARMLESS))
    }

    /// What a lenient reader takes for a texture that is not supported: a middling constant.
    pub(super) fn stand_in_texture(&mut self, name: &str, kind: &str) {
        if kind == "float" {
            let t = FloatTexture::Constant(0.5);
            self.float_textures.insert(name.into(), t);
        } else {
            let t = SpectrumTexture::Constant(Curve::Constant(0.5));
            self.spectrum_textures.insert(name.into(), t);
        }
    }

    fn float_class(&mut self, class: &str, p: &Params) -> Result<FloatTexture> {
        Ok(match class {
            "constant" => FloatTexture::Constant(p.float("value", 1.0)? as f32),
            "scale" => {
                let tex = self.float_texture(p, "tex", 1.0)?;
                let scale = self.float_texture(p, "scale", 1.0)?;
                FloatTexture::Scale(tex.into(), scale.into())
            }
            "checkerboard" => {
                let mapping = checker_mapping(p)?;
                let a = self.float_texture(p, "tex1", 1.0)?;
                let b = self.float_texture(p, "tex2", 0.0)?;
                FloatTexture::Checkerboard(mapping, a.into(), b.into())
            }
            "imagemap" => FloatTexture::Image(self.image_map(p)?),
            other => return Err(unknown_class(other, p)),
        })
    }

    fn spectrum_class(&mut self, class: &str, p: &Params) -> Result<SpectrumTexture> {
        Ok(match class {
            "constant" => self.spectrum_texture(p, "value", 1.0)?,
            "scale" => {
                let tex = self.spectrum_texture(p, "tex", 1.0)?;
                let scale = self.float_texture(p, "scale", 1.0)?;
                SpectrumTexture::Scale(tex.into(), scale.into())
            }
            "checkerboard" => {
                let mapping = checker_mapping(p)?;
                let a = self.spectrum_texture(p, "tex1", 1.0)?;
                let b = self.spectrum_texture(p, "tex2", 0.0)?;
                SpectrumTexture::Checkerboard(mapping, a.into(), b.into())
            }
            "imagemap" => SpectrumTexture::Image(self.image_map(p)?),
            other => return Err(unknown_class(other, p)),
        })
    }

    /// A number or the name of a texture of numbers.
    pub(super) fn float_texture(
        &self,
        p: &Params,
        name: &str,
        default: f64,
    ) -> Result<FloatTexture> {
        Ok(self
            .float_texture_opt(p, name)?
            .unwrap_or(FloatTexture::Constant(default as f32)))
    }

    /// As [`Self::float_texture`], `None` where the parameter is not given.
    pub(super) fn float_texture_opt(&self, p: &Params, name: &str) -> Result<Option<FloatTexture>> {
        match p.typed(name, &[Type::Float, Type::Texture])? {
            Some(q) if q.ty == Type::Texture => {
                named(q, &self.float_textures, "float texture").map(Some)
            }
            _ => Ok(p.float_opt(name)?.map(|v| FloatTexture::Constant(v as f32))),
        }
    }

    /// A reflectance or the name of a texture of reflectances.
    pub(super) fn spectrum_texture(
        &self,
        p: &Params,
        name: &str,
        default: f32,
    ) -> Result<SpectrumTexture> {
        Ok(self
            .spectrum_texture_opt(p, name)?
            .unwrap_or(SpectrumTexture::Constant(Curve::Constant(default))))
    }

    /// As [`Self::spectrum_texture`], `None` where the parameter is not given.
    pub(super) fn spectrum_texture_opt(
        &self,
        p: &Params,
        name: &str,
    ) -> Result<Option<SpectrumTexture>> {
        let types = [SPECTRUM[0], SPECTRUM[1], SPECTRUM[2], Type::Texture];
        match p.typed(name, &types)? {
            None => Ok(None),
            Some(q) if q.ty == Type::Texture => {
                named(q, &self.spectrum_textures, "spectrum texture").map(Some)
            }
            Some(q) => Ok(Some(SpectrumTexture::Constant(curve(
                q,
                Role::Albedo,
                &self.files,
            )?))),
        }
    }

    fn image_map(&mut self, p: &Params) -> Result<ImageMap> {
        let Some(file) = p.string_opt("filename")? else {
            return Err(SceneError::value(&p.at, "imagemap needs a \"filename\""));
        };
        let encoding = match p.string_opt("encoding")? {
            None => Encoding::Srgb,
            Some(text) => Encoding::parse(text).ok_or_else(|| {
                p.bad("encoding")
                    .found(format!("\"{text}\""))
                    .expected("\"sRGB\", \"linear\" or \"gamma …\"")
            })?,
        };
        let at = p.get("filename").map_or(&p.at, |q| &q.at);
        let image = self.images.load(&self.files.resolve(file), encoding, at)?;
        let wrap = match p.string("wrap", "repeat")? {
            "repeat" => Wrap::Repeat,
            "clamp" => Wrap::Clamp,
            "black" => Wrap::Black,
            other => {
                return Err(SceneError::unsupported(at, "unknown wrap of an image")
                    .found(format!("\"{other}\""))
                    .expected("\"repeat\", \"clamp\" or \"black\""));
            }
        };
        Ok(ImageMap {
            image,
            mapping: uv_mapping(p)?,
            wrap,
            point: p.string("filter", "bilinear")? == "point",
            invert: p.boolean("invert", false)?,
            scale: p.float("scale", 1.0)? as f32,
        })
    }
}

fn too_large(parts: usize, p: &Params) -> Result<()> {
    if parts <= MAX_PARTS {
        return Ok(());
    }
    Err(SceneError::value(&p.at, "the texture has too many parts")
        .found(parts)
        .expected(format!("at most {MAX_PARTS}")))
}

fn float_parts(t: &FloatTexture) -> usize {
    match t {
        FloatTexture::Constant(_) | FloatTexture::Image(_) => 1,
        FloatTexture::Scale(a, b) | FloatTexture::Checkerboard(_, a, b) => {
            1 + float_parts(a) + float_parts(b)
        }
    }
}

fn spectrum_parts(t: &SpectrumTexture) -> usize {
    match t {
        SpectrumTexture::Constant(_) | SpectrumTexture::Image(_) => 1,
        SpectrumTexture::Scale(a, b) => 1 + spectrum_parts(a) + float_parts(b),
        SpectrumTexture::Checkerboard(_, a, b) => 1 + spectrum_parts(a) + spectrum_parts(b),
    }
}

fn checker_mapping(p: &Params) -> Result<UvMapping> {
    match p.integer("dimension", 2, 2..=3)? {
        2 => uv_mapping(p),
        _ => {
            let at = p.get("dimension").map_or(&p.at, |q| &q.at);
            Err(SceneError::unsupported(
                at,
                "solid checkerboards are not supported",
            ))
        }
    }
}

fn uv_mapping(p: &Params) -> Result<UvMapping> {
    let mapping = p.string("mapping", "uv")?;
    if mapping != "uv" {
        let at = p.get("mapping").map_or(&p.at, |q| &q.at);
        return Err(
            SceneError::unsupported(at, "this texture mapping is not supported")
                .found(format!("\"{mapping}\""))
                .expected("\"uv\""),
        );
    }
    let pair =
        |a, b, d| -> Result<Vec2> { Ok(Vec2::new(p.float(a, d)? as f32, p.float(b, d)? as f32)) };
    Ok(UvMapping {
        scale: pair("uscale", "vscale", 1.0)?,
        offset: pair("udelta", "vdelta", 0.0)?,
    })
}

fn named<T: Clone>(
    p: &Param,
    table: &std::collections::HashMap<String, T>,
    what: &str,
) -> Result<T> {
    let name = p.strings().first().map_or("", String::as_str);
    table.get(name).cloned().ok_or_else(|| {
        SceneError::value(&p.at, format!("unknown {what}"))
            .found(format!("\"{name}\""))
            .expected(format!("the name of a {what} defined above"))
    })
}

fn unknown_class(class: &str, p: &Params) -> SceneError {
    SceneError::unsupported(&p.at, "this texture is not supported")
        .found(format!("\"{class}\""))
        .expected("\"constant\", \"scale\", \"checkerboard\" or \"imagemap\"")
}
