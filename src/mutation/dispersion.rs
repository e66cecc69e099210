//! Following a path again at other wavelengths, where dispersive deltas bend it elsewhere.
//!
//! Kept are the ends of the path, and the directions in which the retraced part leaves its non-specular vertices. The
//! specular chains in it are followed with their modes, and its last vertex is joined to what is kept. In these
//! coordinates (directions and kept positions) the change is the identity, so that only what f/T has of the retraced
//! part differs between x and y, as for a caustic or multi-chain perturbation that turns nothing.

use super::{Context, Workspace, caustic, multi_chain};
use crate::accel::Accel;
use crate::path::{Emitters, Ends, Kind, Path, Pool, Start, deflect};
use crate::scatter::{Mode, Transport};
use crate::scene::spectrum::Lanes;

/// Which part of a path has to be retraced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// None: no delta on the path disperses.
    Still,
    /// Everything after `from` up to `to`, which is joined to the vertex after it.
    FromLight { from: usize, to: usize },
    /// From the lens back to `to`, which is joined to the vertex before it or is the emitter.
    FromEye { to: usize },
    /// Dispersive deltas on both sides of every connection that could be made.
    Closed,
}

impl Form {
    /// From the light if that is possible: caustics move with their wavelength, and the lens sees them anyway.
    pub(super) fn of<const N: usize>(x: &Path<N>, pool: &Pool<N>) -> Self {
        let k = x.k();
        let scatters = |i: usize| i == 0 || i == k || x.links[i].mode == Mode::NonSpecular;
        let disperses =
            |i: &usize| !scatters(*i) && pool.get(x.links[*i].slot).bsdf.is_dispersive();
        let (Some(first), Some(last)) = ((1..k).find(disperses), (1..k).rev().find(disperses))
        else {
            return Self::Still;
        };
        if let Some(to) = (last + 1..k).find(|&i| scatters(i) && scatters(i + 1)) {
            let from = (0..first).rev().find(|&i| scatters(i)).unwrap_or(0);
            return Self::FromLight { from, to };
        }
        let hit = || Emitters::can_be_hit(pool.get(x.links[0].slot));
        let ends = |i: usize| if i == 0 { hit() } else { scatters(i - 1) };
        match (0..first).rev().find(|&i| scatters(i) && ends(i)) {
            Some(to) => Self::FromEye { to },
            None => Self::Closed,
        }
    }

    /// Vertices whose positions stay: how many at the light, how many at the eye.
    #[cfg(test)]
    pub(super) fn kept(self, vertices: usize) -> (usize, usize) {
        match self {
            Self::Still | Self::Closed => (vertices, 0),
            Self::FromLight { from, to } => (from + 1, vertices - 1 - to),
            Self::FromEye { to } => (to, 1),
        }
    }

    /// τ of all spectra times what else of f/T belongs to the retraced part.
    pub(super) fn changed<const N: usize>(self, p: &Path<N>) -> f64 {
        match self {
            Self::Still | Self::Closed => p.shape_tau,
            Self::FromLight { from, to } => caustic::changed(p, from, to),
            Self::FromEye { to } => multi_chain::changed(p, to),
        }
    }
}

/// Makes y of x at other wavelengths; `None` if it cannot be made so, or has another form and so no way back.
pub(super) fn retrace<const N: usize, A: Accel>(
    form: Form,
    lanes: Lanes<N>,
    x: &Path<N>,
    ws: &mut Workspace<N>,
    ctx: &mut Context<A>,
) -> Option<()> {
    let k = x.k();
    ws.palette.tune(&lanes);
    ws.ends = Ends { light: 0, eye: 0 };
    let joined = match form {
        Form::FromLight { from, to } => {
            keep(x, &lanes, 0..=from, Transport::FromLight, ws, ctx);
            from_light(x, from, to, ws, ctx)?;
            keep(x, &lanes, to + 1..=k, Transport::FromLight, ws, ctx);
            Some(to)
        }
        Form::FromEye { to } => {
            keep(x, &lanes, std::iter::once(k), Transport::FromEye, ws, ctx);
            from_eye(x, to, ws, ctx)?;
            keep(x, &lanes, (0..to).rev(), Transport::FromEye, ws, ctx);
            to.checked_sub(1)
        }
        Form::Still | Form::Closed => return None,
    };
    ws.splice(x);
    ws.y.lanes = lanes;
    ws.y.relink(ctx.world, &ws.pool, 0, k);
    if Form::of(&ws.y, &ws.pool) != form || !ctx.carries(&mut ws.y, &ws.pool) {
        return None;
    }
    joined
        .is_none_or(|i| ws.y.edge_visible(ctx.world, &ws.pool, i, ctx.tally))
        .then_some(())
}

/// Vertices of x at the new wavelengths.
fn keep<const N: usize, A: Accel>(
    x: &Path<N>,
    lanes: &Lanes<N>,
    which: impl Iterator<Item = usize>,
    from: Transport,
    ws: &mut Workspace<N>,
    ctx: &Context<A>,
) {
    let world = ctx.world;
    for i in which {
        let l = &x.links[i];
        let v = ws.pool.get(l.slot);
        let v = v.at_wavelengths(&world.emitters, world.scene, lanes);
        ws.put(from, v, l.mode);
    }
}

/// Finds the vertices from + 1 … to, the last kept vertex's copy being there.
fn from_light<const N: usize, A: Accel>(
    x: &Path<N>,
    from: usize,
    to: usize,
    ws: &mut Workspace<N>,
    ctx: &mut Context<A>,
) -> Option<()> {
    let world = ctx.world;
    let start = ws.pool.get(ws.from_light[from].0);
    let (mut o, mut w) = if start.kind == Kind::Infinite {
        let through = ws.pool.get(x.links[1].slot).p;
        (Start::at(world.emitters.entry(start.p, through)), -start.p)
    } else {
        let w = x.links[from].dir;
        (world.leave_on_line(start, w), w)
    };
    for i in from + 1..=to {
        let mode = x.links[i].mode;
        let slot = ws.trace(world, Transport::FromLight, (o, w), mode, ctx.tally)?;
        let next = ws.pool.get(slot);
        let scatters = mode == Mode::NonSpecular;
        if next.kind != Kind::Surface || scatters && !next.bsdf.has_non_specular() {
            return None;
        }
        w = if scatters {
            x.links[i].dir
        } else {
            deflect(next, -w, mode, Transport::FromLight)?
        };
        o = world.leave_on_line(next, w);
    }
    Some(())
}

/// Finds the vertices k − 1 … to, the lens being there.
fn from_eye<const N: usize, A: Accel>(
    x: &Path<N>,
    to: usize,
    ws: &mut Workspace<N>,
    ctx: &mut Context<A>,
) -> Option<()> {
    let world = ctx.world;
    let k = x.k();
    let mut cur = ws.from_eye[0].0;
    let mut w = -x.links[k - 1].dir;
    for i in (to..k).rev() {
        let v = ws.pool.get(cur);
        let (ray, mode) = ((world.leave_on_line(v, w), w), x.links[i].mode);
        cur = ws.trace(world, Transport::FromEye, ray, mode, ctx.tally)?;
        let next = ws.pool.get(cur);
        let scatters = mode == Mode::NonSpecular;
        if i > 0 && (next.kind != Kind::Surface || scatters && !next.bsdf.has_non_specular()) {
            return None;
        }
        if i > to {
            w = if scatters {
                -x.links[i - 1].dir
            } else {
                deflect(next, -w, mode, Transport::FromEye)?
            };
        }
    }
    Some(())
}
