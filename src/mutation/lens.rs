//! Lens perturbation: moves the raster point a little and follows the specular chain again (Veach 11.4.3.1).
//!
//! Suited to (L|D)DS*E, and to LS*E where the chain owns it. The distance moved is R = r2·exp(−ln(r2/r1)·U) at a uniform
//! angle: symmetric in the raster measure. With y_{m+1} … y_{k−1} the new vertices, the density of T in the area measure
//! is that of the raster point times Π p^E/P(mode), so the ratio is
//!
//! τ(y)·Π G/(p^E/P) over the same of x.

use super::falsify::{Density, factor, odd_row};
use super::{Context, Workspace};
use crate::accel::Accel;
use crate::path::{Emitters, Ends, Kind, Path, Pool, deflect, exp2i};
use crate::real::{Vec2, Vec3};
use crate::sampling::{Rng, warp};
use crate::scatter::{Mode, Transport};

/// See the module.
pub struct LensPerturbation;

impl LensPerturbation {
    /// Index of the first vertex that is replaced, if x has the form this strategy suits.
    #[inline]
    pub fn suits<const N: usize>(x: &Path<N>, pool: &Pool<N>) -> Option<usize> {
        let mut j = x.k() - 1;
        while j > 0 && x.links[j].mode != Mode::NonSpecular {
            j -= 1;
        }
        if j == 0 {
            // LS*E: the retraced chain must end on the emitter.
            return Emitters::can_be_hit(pool.get(x.links[0].slot)).then_some(0);
        }
        (j == 1 || x.links[j - 1].mode == Mode::NonSpecular).then_some(j)
    }

    /// Proposes y in `ws.y`; see [`super`].
    pub fn propose<const N: usize, A: Accel>(
        x: &mut Path<N>,
        ws: &mut Workspace<N>,
        ctx: &mut Context<A>,
    ) -> Option<f64> {
        let first = Self::suits(x, &ws.pool)?;
        // Between the ends of its one chain there is nothing to turn.
        retrace(x, ws, ctx, first, |_, w| w)?;
        Some(Self::ratio(x, &ws.y, first))
    }

    /// The raster point a little moved; `None` if it leaves the raster domain.
    #[inline]
    fn moved<A: Accel>(raster: Vec2, ctx: &mut Context<A>) -> Option<Vec2> {
        let lens = &ctx.world.lens;
        let r = lens.perturbation * warp::exp(-lens.perturbation_range * ctx.rng.next_f32());
        let raster = raster + warp::circle(ctx.rng.next_f32()) * r;
        lens.contains(raster).then_some(raster)
    }

    /// T(y→x)·τ(y) / (T(x→y)·τ(x)) of paths that differ from vertex `first` on.
    #[inline]
    pub(crate) fn ratio<const N: usize>(x: &Path<N>, y: &Path<N>, first: usize) -> f64 {
        let scale = exp2i(y.shape_exp - x.shape_exp);
        let density = |p: &Path<N>| factor(Density::Lens, odd_row(p));
        changed(y, first) / changed(x, first) * scale * density(x) / density(y)
    }
}

/// Moves the raster point and replaces x_first … x_{k−1} by what is found from there: through specular vertices with
/// their modes kept, and on from others in x's direction as `turn` changes it. `None` if y cannot be made so.
#[inline]
pub(super) fn retrace<const N: usize, A: Accel>(
    x: &Path<N>,
    ws: &mut Workspace<N>,
    ctx: &mut Context<A>,
    first: usize,
    turn: impl Fn(&mut Rng, Vec3) -> Vec3,
) -> Option<()> {
    let world = ctx.world;
    let k = x.k();
    let raster = LensPerturbation::moved(x.raster, ctx)?;
    ws.ends = Ends {
        light: first,
        eye: 1,
    };
    let mut cur = x.links[k].slot;
    let mut w = world.lens.direction(ws.pool.get(cur).p, raster);
    for i in (first..k).rev() {
        let (v, mode) = (ws.pool.get(cur), x.links[i].mode);
        let ray = (world.leave_on_line(v, w), w);
        cur = ws.trace(world, Transport::FromEye, ray, mode, ctx.tally)?;
        let next = ws.pool.get(cur);
        let scatters = mode == Mode::NonSpecular;
        if i > 0 && (next.kind != Kind::Surface || scatters && !next.bsdf.has_non_specular()) {
            return None;
        }
        if i > first {
            w = if scatters {
                turn(ctx.rng, -x.links[i - 1].dir)
            } else {
                deflect(next, -w, mode, Transport::FromEye)?
            };
        }
    }
    finish(x, ws, ctx, first)
}

/// Makes y of x's vertices before `first`, the new ones found from the eye, and x's lens. `None` if it carries nothing to
/// the raster or its connection is blocked.
#[inline]
pub(super) fn finish<const N: usize, A: Accel>(
    x: &Path<N>,
    ws: &mut Workspace<N>,
    ctx: &mut Context<A>,
    first: usize,
) -> Option<()> {
    ws.splice(x);
    if first == 0 && !Emitters::can_be_hit(ws.pool.get(ws.y.links[0].slot)) {
        return None;
    }
    let y = &mut ws.y;
    y.relink(ctx.world, &ws.pool, first.saturating_sub(1), x.k());
    if !ctx.carries(y, &ws.pool) {
        return None;
    }
    (first == 0 || y.edge_visible(ctx.world, &ws.pool, first - 1, ctx.tally)).then_some(())
}

/// τ of all spectra times what else of f/T belongs to the replaced part.
fn changed<const N: usize>(p: &Path<N>, first: usize) -> f64 {
    let k = p.k();
    let l = &p.links;
    let mut c = p.shape_tau;
    if first > 0 {
        c *= l[first - 1].g;
    }
    for j in first..k {
        let chosen = if j + 1 < k {
            l[j + 1].prob_e as f64
        } else {
            1.0
        };
        c *= l[j].g * chosen / l[j].pe;
    }
    c
}
