//! Lens sub-path mutation: replaces the lens sub-path by one from anywhere in the image, stratified (Veach 11.4.4).
//!
//! Suited to (L|D)DS*E; with m the vertex before its D, x_{m+1} … x_k are replaced. The new ones start at the raster point,
//! the aperture point and the choices of modes of an entry (see [`Entries`](crate::sampling::Entries)): S* is followed to
//! the first vertex at which a non-specular mode is chosen, and that is joined to x_m. The entry's density is uniform over
//! raster domain and aperture, so in the area measure, with P the probability of the non-specular mode at y_{m+1},
//!
//! T(x→y) = p^E(y_k) · … · p^E(y_{m+1}) · P(y_{m+1}),
//!
//! and the same for x's own lens sub-path on the way back, so that the ratio is
//!
//! τ(y)·G(y_m, y_{m+1})·Π G/p^E / P(y_{m+1}) over the same of x.

use super::falsify::{Density, factor, odd_row};
use super::{Context, Workspace};
use crate::accel::Accel;
use crate::path::{Ends, Kind, Path, Pool, Vertex, deflect, exp2i, scatter};
use crate::real::{Real, Vec3};
use crate::scatter::{Mode, Transport};

/// See the module.
pub struct LensSubpath;

impl LensSubpath {
    /// Index m+1 of the first vertex that is replaced, if x has the form this strategy suits.
    #[inline]
    pub fn suits<const N: usize>(x: &Path<N>) -> Option<usize> {
        let mut j = x.k() - 1;
        while j > 0 && x.links[j].mode != Mode::NonSpecular {
            j -= 1;
        }
        (j == 1 || (j > 1 && x.links[j - 1].mode == Mode::NonSpecular)).then_some(j)
    }

    /// Proposes y in `ws.y`; see [`super`].
    pub fn propose<const N: usize, A: Accel>(
        x: &mut Path<N>,
        ws: &mut Workspace<N>,
        ctx: &mut Context<A>,
    ) -> Option<f64> {
        let world = ctx.world;
        let first = Self::suits(x)?;
        ws.ends = Ends {
            light: first,
            eye: 0,
        };
        let mut entry = ctx.entries.as_mut().map(|e| e.deal());
        let (raster, rng) = match &mut entry {
            Some(e) => (e.raster, &mut e.rng),
            None => (world.lens.sample_raster(ctx.rng.next_vec2()), &mut *ctx.rng),
        };
        let lens = world.lens.sample_vertex(rng.next_vec2());
        let mut w = world.lens.direction(lens.p, raster);
        let mut cur = ws.put(Transport::FromEye, lens, Mode::NonSpecular);
        loop {
            // Kept vertices, those found and one more make k + 1.
            if first + ws.from_eye.len() > world.max_edges {
                return None;
            }
            let v = ws.pool.get(cur);
            let ray = (world.leave(v, v.p, w), w);
            cur = ws.trace(world, Transport::FromEye, ray, Mode::NonSpecular, ctx.tally)?;
            let next = ws.pool.get(cur);
            if next.kind != Kind::Surface {
                return None;
            }
            let end = non_specular(next, -w);
            if end > 0.0 && rng.next_f32() < end {
                break;
            }
            let (to, mode) = if next.bsdf.has_non_specular() {
                // The one delta lobe beside others is the mirror of a coat.
                let to = deflect(next, -w, Mode::Reflect, Transport::FromEye)?;
                (to, Mode::Reflect)
            } else {
                scatter(next, -w, Transport::FromEye, rng)?
            };
            ws.from_eye.last_mut().expect("just found").1 = mode;
            w = to;
        }
        ws.splice(x);
        let y = &mut ws.y;
        y.relink(world, &ws.pool, first - 1, y.k());
        if !ctx.carries(y, &ws.pool) || !y.edge_visible(world, &ws.pool, first - 1, ctx.tally) {
            return None;
        }
        Some(Self::ratio(x, y, &ws.pool, first))
    }

    /// T(y→x)·τ(y) / (T(x→y)·τ(x)) of paths that differ from vertex `first` on.
    #[inline]
    pub(crate) fn ratio<const N: usize>(
        x: &Path<N>,
        y: &Path<N>,
        pool: &Pool<N>,
        first: usize,
    ) -> f64 {
        let density = |p: &Path<N>| factor(Density::LensSubpath, odd_row(p));
        let scale = exp2i(y.shape_exp - x.shape_exp);
        changed(y, pool, first) / changed(x, pool, first) * scale * (density(x) / density(y))
    }
}

/// Probability of the non-specular mode at `v` for what comes from direction `from`.
#[inline]
fn non_specular<const N: usize>(v: &Vertex<N>, from: Vec3) -> Real {
    if !v.bsdf.has_specular() {
        return v.bsdf.has_non_specular() as u8 as Real;
    }
    v.bsdf
        .non_specular_probability(v.frame().to_local(from), Transport::FromEye)
}

/// τ of all spectra times what else of f/T belongs to the replaced part.
fn changed<const N: usize>(p: &Path<N>, pool: &Pool<N>, first: usize) -> f64 {
    let l = &p.links;
    let mut c = p.shape_tau * l[first - 1].g;
    for e in &l[first..p.k()] {
        c *= e.g / e.pe;
    }
    c / non_specular(pool.get(l[first].slot), l[first].dir) as f64
}
