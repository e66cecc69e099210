//! Metals: mirror or GGX reflection with the Fresnel factor of a complex index, lane by lane.

use super::ggx::Ggx;
use super::{BsdfSample, Mode, Specular, fresnel};
use crate::real::{Real, Vec2, Vec3};
use crate::scene::spectrum::Spectrum;

/// Complex refraction index in each lane. Plain arrays, so that a lobe is not padded to a vector's alignment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Index<const N: usize> {
    /// Real part.
    pub eta: [Real; N],
    /// Imaginary part.
    pub k: [Real; N],
}

impl<const N: usize> Index<N> {
    /// The index with reflectance `r` at normal incidence and real part 1, as pbrt-v4 makes it.
    #[inline]
    pub fn from_reflectance(r: Spectrum<N>) -> Self {
        Self {
            eta: [1.0; N],
            // r = 1 would need k = ∞; pbrt-v4 stops at the same value.
            k: r.0.map(|r| {
                let r = r.clamp(0.0, 0.9999);
                2.0 * (r / (1.0 - r)).sqrt()
            }),
        }
    }

    /// Fresnel reflectance at |cos θ|.
    #[inline]
    pub fn fresnel(&self, cos: Real) -> Spectrum<N> {
        Spectrum::from_fn(|i| fresnel::conductor(cos, self.eta[i], self.k[i]))
    }
}

/// A mirror of metal, from both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor<const N: usize> {
    /// Complex index.
    pub index: Index<N>,
}

impl<const N: usize> Conductor<N> {
    /// R of the mirrored pair; the lobe is always the one chosen.
    #[inline]
    pub fn specular(&self, w_l: Vec3, w_e: Vec3) -> Option<Specular<N>> {
        (w_l.z * w_e.z > 0.0).then(|| Specular {
            value: self.index.fresnel(w_e.z.abs()),
            prob_e: 1.0,
            prob_l: 1.0,
            jacobian: 1.0,
        })
    }
}

/// A rough metal: f_s = D·F·G/(4·cos·cos) (Walter et al. 2007, eq. 20).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughConductor<const N: usize> {
    /// Complex index.
    pub index: Index<N>,
    /// Facets.
    pub ggx: Ggx,
}

impl<const N: usize> RoughConductor<N> {
    /// f_s; the same when the directions change places.
    #[inline]
    pub fn eval(&self, w_l: Vec3, w_e: Vec3) -> Spectrum<N> {
        match half(w_l, w_e) {
            Some((m, cos)) => self.index.fresnel(cos) * reflection(&self.ggx, w_l, w_e, m),
            None => Spectrum::ZERO,
        }
    }

    /// Density of the visible normal, turned into that of the reflected direction.
    #[inline]
    pub fn pdf(&self, from: Vec3, to: Vec3) -> Real {
        half(from, to).map_or(0.0, |(m, _)| reflection_pdf(&self.ggx, from, m))
    }

    /// Reflects `from` off a visible normal; `None` when that leads under the surface.
    #[inline]
    pub fn sample(&self, from: Vec3, u: Vec2) -> Option<BsdfSample> {
        let m = self.ggx.sample_visible(from, u);
        let to = mirror(from, m);
        let pdf = self.pdf(from, to);
        (pdf > 0.0).then_some(BsdfSample {
            to,
            mode: Mode::NonSpecular,
            pdf,
        })
    }
}

/// The facet normal m (z ≥ 0) that mirrors `a` into `b`, and |a·m| = |b·m|; `None` unless both lie strictly on one
/// side. The cosine is half the length of a + b, so it has the same bits when the directions change places. A product of
/// cosines that f32 holds no digits of counts as the horizon.
#[inline]
pub(super) fn half(a: Vec3, b: Vec3) -> Option<(Vec3, Real)> {
    if a.z * b.z < Real::MIN_POSITIVE {
        return None;
    }
    let h = a + b;
    let length = h.length();
    let m = h / length.copysign(h.z);
    Some((m, (0.5 * length).min(1.0)))
}

/// `w` mirrored in the facet normal `m`.
#[inline]
pub(super) fn mirror(w: Vec3, m: Vec3) -> Vec3 {
    2.0 * w.dot(m) * m - w
}

/// D·G/(4·|cos·cos|): a facet reflection without its Fresnel factor.
#[inline]
pub(super) fn reflection(ggx: &Ggx, a: Vec3, b: Vec3, m: Vec3) -> Real {
    ggx.d(m) * ggx.g2(a, b) / (4.0 * (a.z * b.z).abs())
}

/// Density of the mirrored direction: the visible normal's over 4·|from·m|, which cancels.
#[inline]
pub(super) fn reflection_pdf(ggx: &Ggx, from: Vec3, m: Vec3) -> Real {
    ggx.g1(from) * ggx.d(m) / (4.0 * from.z.abs())
}
