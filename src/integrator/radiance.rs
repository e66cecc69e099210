//! Path tracing of one camera ray: next-event estimation and BSDF sampling joined by MIS.
//!
//! Written without the path room's links and densities, so that it checks them.

use crate::accel::Accel;
use crate::path::{
    Emitters, Kind, LightPoint, Palette, Tally, Vertex, World, scatter, scatter_terms, trace,
};
use crate::real::{Real, Vec3};
use crate::sampling::Rng;
use crate::scatter::{Mode, Transport};
use crate::scene::spectrum::Spectrum;

/// Which paths are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paths {
    /// All.
    All,
    /// LS*E and LDS*E by modes: what a chain with separate direct light leaves out.
    Direct,
}

/// Scattering events after which Russian roulette begins.
const ROULETTE_AFTER: usize = 4;

/// One estimate of the radiance that arrives at lens vertex `lens` from direction `w`, by number of edges if asked:
/// `by_length(k, value)` is called for each contribution of a path of k edges. `light` is the point on a light that the first
/// vertex which asks for one gets; others, and that one without it, draw theirs from `rng`.
#[allow(clippy::too_many_arguments)]
pub fn radiance<const N: usize, A: Accel>(
    world: &World<A>,
    palette: &Palette<N>,
    lens: &Vertex<N>,
    mut w: Vec3,
    paths: Paths,
    mut light: Option<LightPoint>,
    rng: &mut Rng,
    tally: &mut Tally,
    mut by_length: impl FnMut(usize, Spectrum<N>),
) {
    let mut beta = Spectrum::<N>::ONE;
    let mut x = *lens;
    // Solid-angle density of the last non-specular choice; None after the lens or a delta.
    let mut last_pdf: Option<f64> = None;
    let mut mono = false;
    for edges in 1..=world.max_edges {
        let Some(v) = trace(world, &x, w, palette, tally) else {
            return;
        };
        if Emitters::can_be_hit(&v) {
            let le = world.emitters.radiance(world.scene, &v, -w);
            if !le.is_black() {
                let weight = match last_pdf {
                    None => 1.0,
                    Some(p) => {
                        let inv_d2 = x.towards(&v).1;
                        let by_light = world.emitters.pdf_point(world.scene, &v)
                            / (inv_d2 * v.cos(w)).max(1e-300);
                        p / (p + by_light)
                    }
                };
                by_length(edges, hero(beta * le, mono) * weight as Real);
            }
        }
        if v.kind != Kind::Surface || edges == world.max_edges {
            return;
        }
        if paths == Paths::Direct && last_pdf.is_some() {
            return;
        }
        mono |= N > 1 && v.bsdf.is_dispersive();
        if v.bsdf.has_non_specular() {
            let light = light.take().unwrap_or_else(|| LightPoint::new(rng));
            let c = direct(world, palette, &v, -w, light, tally);
            if !c.is_black() {
                by_length(edges + 1, hero(beta * c, mono));
            }
        }
        let Some((next, mode)) = scatter(&v, -w, Transport::FromEye, rng) else {
            return;
        };
        let t = scatter_terms(&v, mode, next, -w);
        if t.fs.is_black() || t.pdf_e <= 0.0 {
            return;
        }
        beta *= t.fs * (v.cos(next) / t.pdf_e) as Real;
        last_pdf = if mode == Mode::NonSpecular {
            Some(t.pdf_e)
        } else {
            None
        };
        if edges > ROULETTE_AFTER && paths == Paths::All {
            let keep = beta.max().min(1.0);
            if rng.next_f32() >= keep {
                return;
            }
            beta = beta * (1.0 / keep);
        }
        x = v;
        w = next;
    }
}

/// Light that reaches `x` directly and is scattered towards `w_e`, MIS-weighted against BSDF sampling.
fn direct<const N: usize, A: Accel>(
    world: &World<A>,
    palette: &Palette<N>,
    x: &Vertex<N>,
    w_e: Vec3,
    light: LightPoint,
    tally: &mut Tally,
) -> Spectrum<N> {
    let Some(x0) = world.emitters.sample_point(world.scene, palette, light) else {
        return Spectrum::ZERO;
    };
    let (w_l, inv_d2) = x.towards(&x0);
    let le = world.emitters.radiance(world.scene, &x0, -w_l);
    if le.is_black() {
        return le;
    }
    let t = scatter_terms(x, Mode::NonSpecular, w_l, w_e);
    if t.fs.is_black() || !world.visible(x, &x0, tally) {
        return Spectrum::ZERO;
    }
    let pdf = world.emitters.pdf_point(world.scene, &x0);
    let g = x.cos(w_l) * x0.cos(w_l) * inv_d2;
    let weight = if Emitters::can_be_hit(&x0) {
        let other = t.pdf_e * x0.cos(w_l) * inv_d2;
        pdf / (pdf + other)
    } else {
        1.0
    };
    t.fs * le * (g * weight / pdf) as Real
}

/// Only the hero wavelength counts once the geometry depends on it; it then stands for all lanes.
#[inline]
fn hero<const N: usize>(s: Spectrum<N>, mono: bool) -> Spectrum<N> {
    if !mono {
        return s;
    }
    let mut h = Spectrum::ZERO;
    h.0[0] = s[0] * N as Real;
    h
}
