//! One more vertex: choose a direction, follow it.

use super::{Fault, Kind, Palette, Tally, Vertex, World};
use crate::accel::{Accel, Hit, OwnRay, closest, closest_but, surface};
use crate::real::{Real, Vec3};
use crate::sampling::Rng;
use crate::scatter::{Bsdf, Mode, Transport};
use crate::scene::{NONE, PrimId};

/// Samples a direction and a mode at `x`; `from` points to the vertex the sub-path came from.
#[inline]
pub fn scatter<const N: usize>(
    x: &Vertex<N>,
    from: Vec3,
    dir: Transport,
    rng: &mut Rng,
) -> Option<(Vec3, Mode)> {
    let uc = rng.next_f32();
    let u = rng.next_vec2();
    let frame = x.frame();
    // A diffuse lobe asks only which side light comes from.
    let local = match &x.bsdf {
        Bsdf::Diffuse(_) => Vec3::new(0.0, 0.0, x.ns.dot(from)),
        _ => frame.to_local(from),
    };
    let s = x.bsdf.sample(local, dir, uc, u)?;
    Some((frame.to_world(s.to).normalize(), s.mode))
}

/// The direction into which the delta lobe `mode` at `x` sends what comes from direction `from`.
#[inline]
pub fn deflect<const N: usize>(
    x: &Vertex<N>,
    from: Vec3,
    mode: Mode,
    dir: Transport,
) -> Option<Vec3> {
    let frame = x.frame();
    let to = x.bsdf.deflect(frame.to_local(from), mode, dir)?;
    Some(frame.to_world(to).normalize())
}

/// The vertex that a ray from `x` in unit direction `w` finds: a surface, the sky, or nothing.
#[inline]
pub fn trace<const N: usize, A: Accel>(
    world: &World<A>,
    x: &Vertex<N>,
    w: Vec3,
    palette: &Palette<N>,
    tally: &mut Tally,
) -> Option<Vertex<N>> {
    trace_ray(world, world.leave(x, x.p, w), w, palette, tally)
}

/// Where a ray begins.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Its origin, off its surface.
    pub o: Vec3,
    /// The sliver it leaves, where rays leave those out ([`Geometry::leave_out`](crate::scene::Geometry::leave_out)).
    pub off: PrimId,
}

impl Start {
    /// On no surface.
    pub fn at(o: Vec3) -> Self {
        Self {
            o,
            off: PrimId::NONE,
        }
    }
}

/// As [`trace`], from any origin.
#[inline]
pub fn trace_ray<const N: usize, A: Accel>(
    world: &World<A>,
    start: Start,
    w: Vec3,
    palette: &Palette<N>,
    tally: &mut Tally,
) -> Option<Vertex<N>> {
    let mut v = Vertex::bare(Kind::Infinite, w, Vec3::ZERO, NONE);
    trace_into(world, (start, w), palette, tally, &mut v).then_some(v)
}

/// The ray, and what it meets.
#[inline(always)]
pub fn follow<A: Accel>(world: &World<A>, start: Start, w: Vec3) -> (OwnRay, Option<Hit>) {
    let ray = OwnRay {
        o: start.o,
        d: w,
        t_max: Real::INFINITY,
    };
    let hit = if start.off == PrimId::NONE {
        closest(world.accel, &ray)
    } else {
        closest_but(world.accel, &ray, [start.off, PrimId::NONE])
    };
    (ray, hit)
}

/// As [`trace_ray`], writing the vertex where it is to stay; false, and nothing written, if there is none.
#[inline(never)]
pub fn trace_into<const N: usize, A: Accel>(
    world: &World<A>,
    (start, w): (Start, Vec3),
    palette: &Palette<N>,
    tally: &mut Tally,
    v: &mut Vertex<N>,
) -> bool {
    tally.rays_closest += 1;
    let (ray, hit) = follow(world, start, w);
    if let Some(hit) = hit {
        tally.hits_clamped += hit.clamped as u64;
        let s = surface(&world.scene.geometry, &hit, &ray);
        v.become_surface(world.scene, hit.prim, &s, palette);
        true
    } else if w.is_nan() {
        tally.fault(Fault::Nan);
        false
    } else if world.emitters.has_sky() {
        *v = world.emitters.sky_vertex(world.scene, palette.lanes(), w);
        true
    } else {
        false
    }
}
