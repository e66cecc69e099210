//! Material → BSDF at a point and at the path's wavelengths.

use super::coated::CoatedDiffuse;
use super::conductor::{Conductor, Index, RoughConductor};
use super::dielectric::Dielectric;
use super::diffuse::Diffuse;
use super::ggx::Ggx;
use super::rough_dielectric::RoughDielectric;
use super::thin_dielectric::ThinDielectric;
use super::{Bsdf, mix};
use crate::real::{Real, Vec2};
use crate::scene::Scene;
use crate::scene::material::{ConductorFresnel, Material, Roughness};
use crate::scene::spectrum::{Curve, Lanes};
use crate::scene::texture::{Image, SpectrumTexture};

/// The BSDF of `material` at `uv` and the wavelengths of `lanes`; black where there is no such material.
///
/// A mix should have been resolved by [`mix::resolve`], which knows the point; one that still comes here is resolved
/// by its texture coordinates.
#[inline]
pub fn shade<const N: usize>(scene: &Scene, material: u32, uv: Vec2, lanes: &Lanes<N>) -> Bsdf<N> {
    match scene.materials.get(material as usize) {
        Some(Material::Diffuse {
            reflectance: SpectrumTexture::Constant(c),
        }) => Bsdf::Diffuse(Diffuse::new(c.eval(lanes))),
        Some(Material::Mix { .. }) => {
            let leaf = mix::resolve(scene, material, uv, uv.extend(0.0));
            match scene.materials.get(leaf as usize) {
                Some(m) => shade_material(m, &scene.images, uv, lanes),
                None => Bsdf::Black,
            }
        }
        Some(m) => shade_material(m, &scene.images, uv, lanes),
        None => Bsdf::Black,
    }
}

/// As [`shade`], for a material that is not a mix (a mix is black here).
pub fn shade_material<const N: usize>(
    material: &Material,
    images: &[Image],
    uv: Vec2,
    lanes: &Lanes<N>,
) -> Bsdf<N> {
    match material {
        Material::Diffuse { reflectance } => {
            Bsdf::Diffuse(Diffuse::new(reflectance.eval(uv, lanes, images)))
        }
        Material::Conductor { fresnel, roughness } => {
            let index = match fresnel {
                ConductorFresnel::EtaK { eta, k } => Index {
                    eta: eta.eval(lanes).0,
                    k: k.eval(lanes).0,
                },
                ConductorFresnel::Reflectance(r) => {
                    Index::from_reflectance(r.eval(uv, lanes, images))
                }
            };
            match facets(roughness, uv, images) {
                None => Bsdf::Conductor(Conductor { index }),
                Some(ggx) => Bsdf::RoughConductor(RoughConductor { index, ggx }),
            }
        }
        Material::Dielectric { eta, roughness } => {
            let (eta, dispersive) = hero_index(eta, lanes);
            match facets(roughness, uv, images) {
                Some(ggx) if (eta - 1.0).abs() * ggx.ax.max(ggx.ay) >= LEAST_SPREAD => {
                    Bsdf::RoughDielectric(RoughDielectric {
                        eta,
                        ggx,
                        dispersive,
                    })
                }
                _ => Bsdf::Dielectric(Dielectric { eta, dispersive }),
            }
        }
        Material::ThinDielectric { eta } => Bsdf::ThinDielectric(ThinDielectric {
            eta: eta.eval(lanes).map(or_one).0,
        }),
        Material::CoatedDiffuse {
            reflectance,
            eta,
            roughness,
        } => {
            let (eta, dispersive) = hero_index(eta, lanes);
            Bsdf::CoatedDiffuse(CoatedDiffuse::new(
                reflectance.eval(uv, lanes, images),
                eta,
                facets(roughness, uv, images),
                dispersive,
            ))
        }
        Material::Mix { .. } => Bsdf::Black,
    }
}

/// Index at lane 0, and whether it varies.
#[inline]
fn hero_index<const N: usize>(eta: &Curve, lanes: &Lanes<N>) -> (Real, bool) {
    (or_one(eta.at(lanes.lambda[0])), !eta.is_constant())
}

/// Facets spread what passes a step |η − 1| in the index over about |η − 1|·α rad. Where that is less than 1024 roundings
/// of a unit direction, the facet that joins two directions is mostly rounding (for η = 1 there is none), so the interface
/// counts as smooth; a tenth of a pixel's angle hides the difference.
///
/// Roundings of f32 in either build, so that both take the same interfaces for smooth.
const LEAST_SPREAD: Real = 1024.0 * 0.5 * f32::EPSILON as Real;

/// An index of 0 stands for 1, as pbrt-v4 has it; the same for what is no number.
#[inline]
fn or_one(eta: Real) -> Real {
    if eta > 0.0 && eta.is_finite() {
        eta
    } else {
        1.0
    }
}

#[inline]
fn facets(r: &Roughness, uv: Vec2, images: &[Image]) -> Option<Ggx> {
    let (u, v) = (r.u.eval(uv, images), r.v.eval(uv, images));
    if r.remap {
        Ggx::new(u.max(0.0).sqrt(), v.max(0.0).sqrt())
    } else {
        Ggx::new(u, v)
    }
}
