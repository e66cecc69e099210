//! Materials as data: what a scene file says, before any wavelength is known.

use super::spectrum::Curve;
use super::texture::{FloatTexture, SpectrumTexture};
use crate::real::Real;

/// α below which a surface is taken for smooth, if both are (pbrt-v4's threshold).
pub const SMOOTH: f32 = 1e-3;

/// GGX roughness along the two tangents, as α (already remapped when the scene asks for it).
#[derive(Clone, Debug, PartialEq)]
pub struct Roughness {
    /// α along the tangent.
    pub u: FloatTexture,
    /// α along the bitangent.
    pub v: FloatTexture,
    /// Texture values still need α = √roughness (a textured roughness with `remaproughness`).
    pub remap: bool,
}

impl Roughness {
    /// The same everywhere.
    pub fn is_uniform(&self) -> bool {
        self.u.is_uniform() && self.v.is_uniform()
    }

    /// Some point may be rough.
    pub fn may_be_rough(&self) -> bool {
        let rough = |t: &FloatTexture| match t {
            FloatTexture::Constant(a) if self.remap => a.max(0.0).sqrt() >= SMOOTH,
            FloatTexture::Constant(a) => *a >= SMOOTH,
            _ => true,
        };
        rough(&self.u) || rough(&self.v)
    }

    /// Some point may be smooth. A roughness from a texture counts as one that may be.
    pub fn may_be_smooth(&self) -> bool {
        let alpha = |a: f32| if self.remap { a.max(0.0).sqrt() } else { a };
        match (&self.u, &self.v) {
            (FloatTexture::Constant(u), FloatTexture::Constant(v)) => {
                let largest = alpha(*u).max(alpha(*v));
                // A NaN counts as smooth.
                largest.is_nan() || largest < SMOOTH
            }
            _ => true,
        }
    }
}

/// How a conductor reflects.
#[derive(Clone, Debug, PartialEq)]
pub enum ConductorFresnel {
    /// Complex refraction index by wavelength.
    EtaK {
        /// Real part.
        eta: Curve,
        /// Imaginary part.
        k: Curve,
    },
    /// Reflectance at normal incidence; as pbrt-v4: eta = 1, k = 2·√(r/(1−r)).
    Reflectance(SpectrumTexture),
}

/// One surface material.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// Lambertian reflection.
    Diffuse {
        /// Albedo in 0..=1.
        reflectance: SpectrumTexture,
    },
    /// Metal, smooth when α is below the smoothness threshold.
    Conductor {
        /// Fresnel reflectance.
        fresnel: ConductorFresnel,
        /// GGX α.
        roughness: Roughness,
    },
    /// Glass, smooth or rough.
    Dielectric {
        /// Refraction index inside over outside, by wavelength.
        eta: Curve,
        /// GGX α.
        roughness: Roughness,
    },
    /// A thin sheet of glass: both interfaces at once, no bending.
    ThinDielectric {
        /// Refraction index.
        eta: Curve,
    },
    /// A dielectric coat over a Lambertian base.
    CoatedDiffuse {
        /// Base albedo.
        reflectance: SpectrumTexture,
        /// Refraction index of the coat.
        eta: Curve,
        /// GGX α of the coat.
        roughness: Roughness,
    },
    /// One of two materials, chosen by a fixed mixture weight.
    Mix {
        /// Weight of `b`, 0..=1.
        amount: FloatTexture,
        /// First material, index into `Scene::materials`.
        a: u32,
        /// Second material.
        b: u32,
    },
}

impl Material {
    /// Directions depend on the wavelength: a transmissive lobe whose index is not constant.
    pub fn is_dispersive(&self) -> bool {
        match self {
            Self::Dielectric { eta, .. } | Self::CoatedDiffuse { eta, .. } => !eta.is_constant(),
            _ => false,
        }
    }

    /// Some point may have a delta lobe; a mix has what its parts have.
    pub fn may_be_specular(&self) -> bool {
        match self {
            Self::Diffuse { .. } | Self::Mix { .. } => false,
            Self::ThinDielectric { .. } => true,
            // A coat without a step in the index mirrors nothing, one rarer than what is outside counts as smooth.
            Self::CoatedDiffuse { eta, roughness, .. } => {
                let smooth = roughness.may_be_smooth();
                somewhere(eta, |e| e < 1.0 || (smooth && e > 1.0))
            }
            // Facets without a step in the index bend nothing: such glass goes straight through, which is a delta too.
            Self::Dielectric { eta, roughness } => {
                roughness.may_be_smooth() || somewhere(eta, |e| e == 1.0)
            }
            Self::Conductor { roughness, .. } => roughness.may_be_smooth(),
        }
    }

    /// Some point may have a lobe that is not a delta; a mix has what its parts have.
    pub fn may_be_non_specular(&self) -> bool {
        match self {
            Self::Diffuse { .. } | Self::CoatedDiffuse { .. } => true,
            Self::ThinDielectric { .. } | Self::Mix { .. } => false,
            Self::Conductor { roughness, .. } | Self::Dielectric { roughness, .. } => {
                roughness.may_be_rough()
            }
        }
    }

    /// Looks the same everywhere: nothing in it is a texture.
    pub fn is_uniform(&self) -> bool {
        match self {
            Self::Diffuse { reflectance } => reflectance.is_uniform(),
            Self::Conductor { fresnel, roughness } => {
                roughness.is_uniform()
                    && match fresnel {
                        ConductorFresnel::EtaK { .. } => true,
                        ConductorFresnel::Reflectance(r) => r.is_uniform(),
                    }
            }
            Self::Dielectric { roughness, .. } => roughness.is_uniform(),
            Self::ThinDielectric { .. } => true,
            Self::CoatedDiffuse {
                reflectance,
                roughness,
                ..
            } => reflectance.is_uniform() && roughness.is_uniform(),
            Self::Mix { .. } => false,
        }
    }

    /// Scattering depends on the direction of the tangent.
    pub fn is_anisotropic(&self) -> bool {
        match self {
            Self::Conductor { roughness, .. }
            | Self::Dielectric { roughness, .. }
            | Self::CoatedDiffuse { roughness, .. } => roughness.u != roughness.v,
            _ => false,
        }
    }
}

/// `f` holds for an index at some whole nanometre; an index of 0 stands for 1.
fn somewhere(eta: &Curve, f: impl Fn(Real) -> bool) -> bool {
    let at = |l: u32| match eta.at(l as Real) {
        e if e > 0.0 && e.is_finite() => f(e),
        _ => f(1.0),
    };
    match eta {
        Curve::Constant(_) => at(360),
        _ => (360..=830).any(at),
    }
}
