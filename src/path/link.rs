//! What a vertex contributes in its place on a path: f_s, both directional densities, and the edge to the next vertex.

use super::{Kind, Vertex};
use crate::scatter::{Mode, Transport};
use crate::scene::spectrum::Spectrum;
use glam::Vec3;

/// The factors of f and of the densities that belong to vertex i of a path, and the edge i → i+1.
#[derive(Clone, Copy, Debug)]
pub struct Link<const N: usize> {
    /// f_s(x_{i−1} → x_i → x_{i+1}) with the shading-normal correction |w_l·n_s|/|w_l·n_g| (Veach 5.3), so that G may
    /// use geometric cosines; a delta's coefficient over |w_l·n_g|; L_e at x0, W_e at xk.
    pub fs: Spectrum<N>,
    /// Unit direction of the edge i → i+1.
    pub dir: Vec3,
    /// 1 / squared length of that edge; 1 if it goes to infinity.
    pub inv_d2: f64,
    /// Geometry term of that edge.
    pub g: f64,
    /// Area density of x_i when generated from the light side.
    pub pl: f64,
    /// Area density of x_i when generated from the eye side.
    pub pe: f64,
    /// Probability that the mode is chosen when coming from the eye side (1 unless specular).
    pub prob_e: f32,
    /// Probability that the mode is chosen when coming from the light side (1 unless specular).
    pub prob_l: f32,
    /// Scattering mode at x_i.
    pub mode: Mode,
}

impl<const N: usize> Default for Link<N> {
    fn default() -> Self {
        Self {
            fs: Spectrum::ZERO,
            dir: Vec3::ZERO,
            inv_d2: 1.0,
            g: 0.0,
            pl: 0.0,
            pe: 0.0,
            prob_e: 1.0,
            prob_l: 1.0,
            mode: Mode::NonSpecular,
        }
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
    pub prob_l: f32,
    /// Mode probability from the eye side.
    pub prob_e: f32,
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
    if x.kind != Kind::Surface {
        return ScatterTerms::NONE;
    }
    let (l, e) = (x.frame.to_local(w_l), x.frame.to_local(w_e));
    let (gl, ge) = (x.ng.dot(w_l), x.ng.dot(w_e));
    if gl * l.z <= 0.0 || ge * e.z <= 0.0 {
        return ScatterTerms::NONE;
    }
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
