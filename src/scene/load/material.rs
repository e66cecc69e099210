//! `Material` and `MakeNamedMaterial` → [`Material`].

use super::error::{Result, SceneError};
use super::params::{Params, Type};
use super::spectra::{Role, curve};
use super::state::Library;
use crate::real::Real;
use crate::scene::material::{ConductorFresnel, Material, Roughness};
use crate::scene::spectrum::{self, Curve};
use crate::scene::texture::{FloatTexture, SpectrumTexture};

/// What a shape is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MaterialRef {
    /// pbrt's default, a diffuse grey of 0.5.
    Default,
    /// One of the scene's materials.
    Index(u32),
    /// No surface at all.
    Interface,
}

/// Parameters of the layered model's random walk in pbrt; the model here is evaluated in closed form.
const WALK: [&str; 3] = ["maxdepth", "nsamples", "g"];

/// pbrt-v4's default thickness of a coat, the one that the layered model here is tabulated for.
const THICKNESS: f32 = 0.01;

/// Deepest nesting of mixes: what looks at all of a mix takes 2^depth steps.
const MAX_MIX_DEPTH: u32 = 8;

impl Library {
    /// Builds a material; `None` is the interface.
    pub(super) fn material(&self, kind: &str, p: &Params) -> Result<Option<Material>> {
        Ok(Some(match kind {
            "" | "none" | "interface" => return Ok(None),
            "diffuse" => Material::Diffuse {
                reflectance: self.spectrum_texture(p, "reflectance", 0.5)?,
            },
            "dielectric" => Material::Dielectric {
                eta: self.eta(p)?,
                roughness: self.roughness(p)?,
            },
            "thindielectric" => Material::ThinDielectric { eta: self.eta(p)? },
            "conductor" => Material::Conductor {
                fresnel: self.conductor(p)?,
                roughness: self.roughness(p)?,
            },
            "coateddiffuse" => {
                self.refuse_absorption(p)?;
                Material::CoatedDiffuse {
                    reflectance: self.spectrum_texture(p, "reflectance", 0.5)?,
                    eta: self.eta(p)?,
                    roughness: self.roughness(p)?,
                }
            }
            "mix" => self.mix(p)?,
            other => {
                return Err(
                    SceneError::unsupported(&p.at, "this material is not supported")
                        .found(format!("\"{other}\""))
                        .expected(
                            "\"diffuse\", \"dielectric\", \"thindielectric\", \"conductor\", \
                         \"coateddiffuse\", \"mix\" or \"interface\"",
                        ),
                );
            }
        }))
    }

    /// Parameters of a material that cannot change the image.
    pub(super) fn harmless(kind: &str) -> &'static [&'static str] {
        if kind == "coateddiffuse" { &WALK } else { &[] }
    }

    /// What a material asks for that its model here cannot follow; a lenient reader makes it without.
    pub(super) fn departures(&self, kind: &str, p: &Params) -> Result<Vec<SceneError>> {
        let mut all = Vec::new();
        if kind == "coateddiffuse"
            && let Some(t) = self.float_texture_opt(p, "thickness")?
            && t != FloatTexture::Constant(THICKNESS)
        {
            let at = p.get("thickness").map_or(&p.at, |q| &q.at);
            let e = SceneError::unsupported(at, "a coat of this thickness is not supported");
            let found = match t {
                FloatTexture::Constant(v) => v.to_string(),
                _ => "a texture".into(),
            };
            all.push(e.found(found).expected(THICKNESS));
        }
        Ok(all)
    }

    /// Refraction index: 1.5 unless given as a number or spectrum.
    fn eta(&self, p: &Params) -> Result<Curve> {
        let types = [Type::Float, Type::Spectrum, Type::Rgb];
        let Some(q) = p.typed("eta", &types)? else {
            return Ok(Curve::Constant(1.5));
        };
        if q.ty == Type::Float {
            let eta = p.float_where("eta", 1.5, "an index above 0", |v| v > 0.0)?;
            return Ok(Curve::Constant(eta as f32));
        }
        let c = curve(q, Role::Unbounded, &self.files)?;
        let lowest = (360..=830)
            .map(|l| c.at(l as Real))
            .fold(Real::INFINITY, Real::min);
        if lowest > 0.0 {
            return Ok(c);
        }
        Err(p
            .bad("eta")
            .found(lowest)
            .expected("an index above 0 from 360 to 830 nm"))
    }

    fn conductor(&self, p: &Params) -> Result<ConductorFresnel> {
        if let Some(r) = self.spectrum_texture_opt(p, "reflectance")? {
            if let Some(q) = p.get("eta").or(p.get("k")) {
                let message = "a conductor has either \"reflectance\" or \"eta\" and \"k\"";
                return Err(SceneError::value(&q.at, message).found("both"));
            }
            return Ok(ConductorFresnel::Reflectance(r));
        }
        let part = |name: &str, default: &str| -> Result<Curve> {
            let types = [Type::Spectrum, Type::Rgb, Type::Texture];
            match p.typed(name, &types)? {
                Some(q) if q.ty == Type::Texture => Err(SceneError::unsupported(
                    &q.at,
                    format!("a textured \"{name}\" is not supported"),
                )),
                Some(q) => curve(q, Role::Unbounded, &self.files),
                None => spectrum::named(default).ok_or_else(|| {
                    SceneError::unsupported(&p.at, format!("no table of {default}"))
                }),
            }
        };
        Ok(ConductorFresnel::EtaK {
            eta: part("eta", "metal-Cu-eta")?,
            k: part("k", "metal-Cu-k")?,
        })
    }

    fn roughness(&self, p: &Params) -> Result<Roughness> {
        let both = self.float_texture(p, "roughness", 0.0)?;
        let u = self.float_texture_opt(p, "uroughness")?;
        let v = self.float_texture_opt(p, "vroughness")?;
        let remap = p.boolean("remaproughness", true)?;
        let given = [
            (Some(&both), "roughness"),
            (u.as_ref(), "uroughness"),
            (v.as_ref(), "vroughness"),
        ];
        for (t, name) in given {
            if let Some(FloatTexture::Constant(a)) = t
                && *a < 0.0
            {
                return Err(p.bad(name).found(a).expected("no negative roughness"));
            }
        }
        let (u, v) = (u.unwrap_or(both.clone()), v.unwrap_or(both));
        Ok(match (u, v, remap) {
            // pbrt-v4's RoughnessToAlpha.
            (FloatTexture::Constant(u), FloatTexture::Constant(v), true) => Roughness {
                u: FloatTexture::Constant(u.sqrt()),
                v: FloatTexture::Constant(v.sqrt()),
                remap: false,
            },
            (u, v, remap) => Roughness { u, v, remap },
        })
    }

    /// A coat that absorbs has no counterpart in the layered model here.
    fn refuse_absorption(&self, p: &Params) -> Result<()> {
        match self.spectrum_texture_opt(p, "albedo")? {
            None | Some(SpectrumTexture::Constant(Curve::Constant(0.0))) => Ok(()),
            Some(_) => {
                let at = p.get("albedo").map_or(&p.at, |q| &q.at);
                Err(SceneError::unsupported(
                    at,
                    "a coat with a medium (\"albedo\" above 0) is not supported",
                ))
            }
        }
    }

    fn mix(&self, p: &Params) -> Result<Material> {
        let names = p
            .typed("materials", &[Type::String])?
            .map_or(&[][..], |q| q.strings());
        let [a, b] = names else {
            return Err(p
                .bad("materials")
                .found(format!("{} names", names.len()))
                .expected("two names of materials"));
        };
        let index = |name: &String| match self.names.get(name) {
            Some(MaterialRef::Index(i)) => Ok(*i),
            Some(_) => Err(SceneError::unsupported(
                &p.at,
                format!("the mix contains the interface \"{name}\""),
            )),
            None => Err(p
                .bad("materials")
                .found(format!("\"{name}\""))
                .expected("the name of a material defined above")),
        };
        let (a, b) = (index(a)?, index(b)?);
        if self.mix_depth(a).max(self.mix_depth(b)) >= MAX_MIX_DEPTH {
            return Err(
                SceneError::value(&p.at, "mixes of mixes are nested too deeply")
                    .expected(format!("at most {MAX_MIX_DEPTH} levels")),
            );
        }
        Ok(Material::Mix {
            amount: self.float_texture(p, "amount", 0.5)?,
            a,
            b,
        })
    }

    fn mix_depth(&self, material: u32) -> u32 {
        match &self.materials[material as usize] {
            Material::Mix { a, b, .. } => 1 + self.mix_depth(*a).max(self.mix_depth(*b)),
            _ => 0,
        }
    }

    /// Texture coordinates change how this material looks.
    pub(super) fn uses_uv(&self, material: u32) -> bool {
        let rough = |r: &Roughness| r.u != r.v || varies(&r.u) || varies(&r.v);
        match &self.materials[material as usize] {
            Material::Diffuse { reflectance } => spectrum_varies(reflectance),
            Material::Conductor { fresnel, roughness } => {
                rough(roughness)
                    || matches!(fresnel, ConductorFresnel::Reflectance(r) if spectrum_varies(r))
            }
            Material::Dielectric { roughness, .. } => rough(roughness),
            Material::ThinDielectric { .. } => false,
            Material::CoatedDiffuse {
                reflectance,
                roughness,
                ..
            } => spectrum_varies(reflectance) || rough(roughness),
            Material::Mix { amount, a, b } => {
                varies(amount) || self.uses_uv(*a) || self.uses_uv(*b)
            }
        }
    }
}

fn varies(t: &FloatTexture) -> bool {
    !matches!(t, FloatTexture::Constant(_))
}

fn spectrum_varies(t: &SpectrumTexture) -> bool {
    !matches!(t, SpectrumTexture::Constant(_))
}
