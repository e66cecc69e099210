//! The new vertices of a bidirectional mutation, from both sides.
//!
//! What is kept may end on a delta lobe. If the new sub-path leaves it by the lobe of x, it goes where x went, so the vertex
//! of x is taken again and no ray is asked. A ray would find it but for roundings: then mutations that change nothing move
//! vertices, always the same way, and over millions of steps the image with them. Other rays from kept vertices begin on
//! their own line for that reason (see [`World::leave_on_line`]).

use super::{Context, Workspace};
use crate::accel::Accel;
#[cfg(doc)]
use crate::path::World;
use crate::path::{Kind, LightPoint, Path, scatter};
use crate::real::Vec3;
use crate::scatter::{Mode, Transport};

/// Adds `count` vertices after the `kept` vertices of the light end; returns the mode at the last kept one. With
/// `reaches_lens` the last one found is to be xk.
#[inline]
pub(super) fn grow_light<const N: usize, A: Accel>(
    x: &Path<N>,
    ws: &mut Workspace<N>,
    ctx: &mut Context<A>,
    kept: usize,
    count: usize,
    reaches_lens: bool,
) -> Option<Mode> {
    let mut end_mode = Mode::NonSpecular;
    if count == 0 {
        return Some(end_mode);
    }
    let world = ctx.world;
    let k = x.k();
    let mut left = count;
    let mut cur = if kept == 0 {
        let x0 = world
            .emitters
            .sample_point(world.scene, &ws.palette, LightPoint::new(ctx.rng))?;
        left -= 1;
        ws.put(Transport::FromLight, x0, Mode::NonSpecular)
    } else {
        x.links[kept - 1].slot
    };
    let mut index = kept.max(1) - 1;
    // All vertices so far are at those of x.
    let mut along = kept > 1;
    let mut from = if along {
        -x.links[index - 1].dir
    } else {
        Vec3::ZERO
    };
    while left > 0 {
        let v = ws.pool.get(cur);
        let reached = left == 1 && reaches_lens;
        let (start, w) = if index == 0 {
            let (o, w) = world.emitters.sample_direction(world.scene, v, ctx.rng);
            (world.leave(v, o, w), w)
        } else {
            let (w, mode) = scatter(v, from, Transport::FromLight, ctx.rng)?;
            match ws.from_light.last_mut() {
                Some(v) => v.1 = mode,
                None => end_mode = mode,
            }
            along = along
                && mode != Mode::NonSpecular
                && mode == x.links[index].mode
                && reached == (index + 1 == k);
            (world.leave_on_line(v, w), w)
        };
        if along {
            cur = ws.again(Transport::FromLight, x.links[index + 1].slot);
            from = -x.links[index].dir;
        } else if reached {
            let lens = world.reach_lens(v, start.o, w, ctx.tally)?;
            ws.put(Transport::FromLight, lens, Mode::NonSpecular);
        } else {
            cur = ws.trace(
                world,
                Transport::FromLight,
                (start, w),
                Mode::NonSpecular,
                ctx.tally,
            )?;
            if ws.pool.get(cur).kind != Kind::Surface {
                return None;
            }
            from = -w;
        }
        index += 1;
        left -= 1;
    }
    Some(end_mode)
}

/// Adds `count` vertices before the `kept` vertices of the eye end; returns the mode at the first kept one. With
/// `reaches_light` the last one found is to be x0.
#[inline]
pub(super) fn grow_eye<const N: usize, A: Accel>(
    x: &Path<N>,
    ws: &mut Workspace<N>,
    ctx: &mut Context<A>,
    kept: usize,
    count: usize,
    reaches_light: bool,
) -> Option<Mode> {
    let mut end_mode = Mode::NonSpecular;
    if count == 0 {
        return Some(end_mode);
    }
    let world = ctx.world;
    let mut left = count;
    let n = x.links.len();
    let mut cur = if kept == 0 {
        let lens = world.lens.sample_vertex(ctx.rng.next_vec2());
        left -= 1;
        ws.put(Transport::FromEye, lens, Mode::NonSpecular)
    } else {
        x.links[n - kept].slot
    };
    // All vertices so far are at those of x, and this is the last one's index.
    let mut along = kept > 1;
    let mut index = n - kept;
    let mut from = if along {
        x.links[index].dir
    } else {
        Vec3::ZERO
    };
    while left > 0 {
        let v = ws.pool.get(cur);
        left -= 1;
        let reached = left == 0 && reaches_light;
        let (start, w) = if v.kind == Kind::Lens {
            let w = world
                .lens
                .direction(v.p, world.lens.sample_raster(ctx.rng.next_vec2()));
            (world.leave(v, v.p, w), w)
        } else {
            let (w, mode) = scatter(v, from, Transport::FromEye, ctx.rng)?;
            match ws.from_eye.last_mut() {
                Some(v) => v.1 = mode,
                None => end_mode = mode,
            }
            along = along
                && mode != Mode::NonSpecular
                && mode == x.links[index].mode
                && reached == (index == 1);
            (world.leave_on_line(v, w), w)
        };
        if along {
            index -= 1;
            cur = ws.again(Transport::FromEye, x.links[index].slot);
            from = x.links[index].dir;
            continue;
        }
        cur = ws.trace(
            world,
            Transport::FromEye,
            (start, w),
            Mode::NonSpecular,
            ctx.tally,
        )?;
        if ws.pool.get(cur).kind != Kind::Surface && !reached {
            return None;
        }
        from = -w;
    }
    Some(end_mode)
}
