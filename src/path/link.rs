//! What a vertex contributes in its place on a path: f_s, both directional densities, and the edge to the next vertex.

use super::{Kind, Vertex};
use crate::real::{Real, Vec3};
use crate::sampling::warp;
use crate::scatter::{Bsdf, Mode, Transport};
use crate::scene::spectrum::Spectrum;

/// The factors of f and of the densities that belong to vertex i of a path, and the edge i → i+1.
#[derive(Clone, Copy, Debug)]
pub struct Link<const N: usize> {
    /// f_s(x_{i−1} → x_i → x_{i+1}) with the shading-normal correction |w_l·n_s|/|w_l·n_g| (Veach 5.3), so that G may
    /// use geometric cosines; a delta's coefficient over |w_l·n_g|; L_e at x0, W_e at xk.
    pub fs: Spectrum<N>,
    /// Unit direction of the edge i → i+1.
    pub dir: Vec3,
    /// [`Vertex::signed_cos`] of that direction at x_i.
    pub cos_near: Real,
    /// [`Vertex::signed_cos`] of that direction at x_{i+1}.
    pub cos_far: Real,
    /// 1 / squared length of that edge; 1 if it goes to infinity.
    pub inv_d2: f64,
    /// Geometry term of that edge.
    pub g: f64,
    /// Area density of x_i when generated from the light side.
    pub pl: f64,
    /// Area density of x_i when generated from the eye side.
    pub pe: f64,
    /// Probability that the mode is chosen when coming from the eye side (1 unless specular).
    pub prob_e: Real,
    /// Probability that the mode is chosen when coming from the light side (1 unless specular).
    pub prob_l: Real,
    /// Scattering mode at x_i.
    pub mode: Mode,
    /// Pool slot of x_i.
    pub slot: u16,
}

impl<const N: usize> Default for Link<N> {
    fn default() -> Self {
        Self {
            fs: Spectrum::ZERO,
            dir: Vec3::ZERO,
            cos_near: 0.0,
            cos_far: 0.0,
            inv_d2: 1.0,
            g: 0.0,
            pl: 0.0,
            pe: 0.0,
            prob_e: 1.0,
            prob_l: 1.0,
            mode: Mode::NonSpecular,
            slot: 0,
        }
    }
}

impl<const N: usize> Link<N> {
    /// A vertex with its scattering mode; the rest is for [`Path::relink`](super::Path::relink) to find out.
    #[inline]
    pub fn at(slot: u16, mode: Mode) -> Self {
        Self {
            slot,
            mode,
            ..Self::default()
        }
    }

    /// Makes this the edge from `x` to `next`.
    #[inline]
    pub fn span(&mut self, x: &Vertex<N>, next: &Vertex<N>) {
        let (dir, inv_d2) = x.towards(next);
        self.dir = dir;
        self.cos_near = x.signed_cos(dir);
        self.cos_far = next.signed_cos(dir);
        self.inv_d2 = inv_d2;
        self.g = (self.cos_near as f64 * self.cos_far as f64).abs() * inv_d2;
    }

    /// Turns a density per solid angle at x_i into one per area at x_{i+1}.
    #[inline]
    pub fn to_far(&self) -> f64 {
        self.cos_far.abs() as f64 * self.inv_d2
    }

    /// Turns a density per solid angle at x_{i+1} into one per area at x_i.
    #[inline]
    pub fn to_near(&self) -> f64 {
        self.cos_near.abs() as f64 * self.inv_d2
    }
}

/// Scattering at an inner vertex for a given pair of directions.
#[derive(Clone, Copy, Debug)]
pub struct ScatterTerms<const N: usize> {
    /// See [`Link::fs`].
    pub fs: Spectrum<N>,
    /// Density of w_e given w_l, per solid angle.
    pub pdf_l: f64,
    /// Density of w_l given w_e, per solid angle (the measure in which a delta's coefficient stands).
    pub pdf_e: f64,
    /// Mode probability from the light side.
    pub prob_l: Real,
    /// Mode probability from the eye side.
    pub prob_e: Real,
}

impl<const N: usize> ScatterTerms<N> {
    const NONE: Self = Self {
        fs: Spectrum::ZERO,
        pdf_l: 0.0,
        pdf_e: 0.0,
        prob_l: 1.0,
        prob_e: 1.0,
    };
}

/// f_s and the densities at `x` for unit directions to the light side and to the eye side.
///
/// Where the geometric and the shading normal disagree about the side of a direction, nothing is scattered: light would
/// leak through the surface.
#[inline]
pub fn scatter_terms<const N: usize>(
    x: &Vertex<N>,
    mode: Mode,
    w_l: Vec3,
    w_e: Vec3,
) -> ScatterTerms<N> {
    scatter_terms_at(x, mode, w_l, w_e, x.ng.dot(w_l), x.ng.dot(w_e))
}

/// As [`scatter_terms`], given the cosines of both directions to the geometric normal.
#[inline]
pub(super) fn scatter_terms_at<const N: usize>(
    x: &Vertex<N>,
    mode: Mode,
    w_l: Vec3,
    w_e: Vec3,
    gl: Real,
    ge: Real,
) -> ScatterTerms<N> {
    if x.kind != Kind::Surface {
        return ScatterTerms::NONE;
    }
    let (lz, ez) = (x.ns.dot(w_l), x.ns.dot(w_e));
    if gl * lz <= 0.0 || ge * ez <= 0.0 {
        return ScatterTerms::NONE;
    }
    // Most vertices are these, and they need no frame.
    if let (Bsdf::Diffuse(b), Mode::NonSpecular) = (&x.bsdf, mode) {
        return if lz * ez > 0.0 {
            ScatterTerms {
                fs: b.value() * (lz / gl),
                pdf_l: warp::cosine_hemisphere_pdf(ez.abs()) as f64,
                pdf_e: warp::cosine_hemisphere_pdf(lz.abs()) as f64,
                prob_l: 1.0,
                prob_e: 1.0,
            }
        } else {
            ScatterTerms::NONE
        };
    }
    general_terms(x, mode, w_l, w_e, gl)
}

/// Scattering by lobes that need the whole frame; sides have been checked.
fn general_terms<const N: usize>(
    x: &Vertex<N>,
    mode: Mode,
    w_l: Vec3,
    w_e: Vec3,
    gl: Real,
) -> ScatterTerms<N> {
    let frame = x.frame();
    let (l, e) = (frame.to_local(w_l), frame.to_local(w_e));
    if mode == Mode::NonSpecular {
        ScatterTerms {
            fs: x.bsdf.eval(l, e) * (l.z / gl),
            pdf_l: x.bsdf.pdf(l, e, Transport::FromLight) as f64,
            pdf_e: x.bsdf.pdf(e, l, Transport::FromEye) as f64,
            prob_l: 1.0,
            prob_e: 1.0,
        }
    } else {
        match x.bsdf.specular(l, e, mode) {
            None => ScatterTerms::NONE,
            Some(s) => ScatterTerms {
                fs: s.value * (1.0 / gl.abs()),
                pdf_l: (s.prob_l * s.jacobian) as f64,
                pdf_e: s.prob_e as f64,
                prob_l: s.prob_l,
                prob_e: s.prob_e,
            },
        }
    }
}
