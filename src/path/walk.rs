//! Random walks: the sub-paths of bidirectional sampling.

use super::trace::{Start, trace_into};
use super::{Kind, Palette, Pool, Tally, World, scatter, scatter_terms};
use crate::accel::Accel;
use crate::real::Vec3;
use crate::sampling::Rng;
use crate::scatter::{Mode, Transport};

/// Vertices after which Russian roulette begins.
const ROULETTE_AFTER: usize = 5;

/// A place where a light walk passed the lens.
#[derive(Clone, Copy)]
pub struct Crossing {
    /// Vertices of the walk before the lens.
    pub before: usize,
    /// Pool slot of the vertex on the lens.
    pub slot: u16,
    /// As [`Walk::survival`].
    pub survival: f64,
}

/// The vertices of a sub-path in the order they were found.
#[derive(Default)]
pub struct Walk {
    /// Pool slot and scattering mode of each vertex.
    pub vertices: Vec<(u16, Mode)>,
    /// Probability that roulette let the walk come as far as this vertex. Not part of the densities p_{s,t}.
    pub survival: Vec<f64>,
    /// Where a light walk's rays passed a lens with an area, at most once each.
    pub crossings: Vec<Crossing>,
}

impl Walk {
    /// Room for `n` vertices.
    pub fn new(n: usize) -> Self {
        Self {
            vertices: Vec::with_capacity(n),
            survival: Vec::with_capacity(n),
            crossings: Vec::with_capacity(n),
        }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// Starts anew with one vertex.
    pub fn start(&mut self, slot: u16) {
        self.clear();
        self.vertices.push((slot, Mode::NonSpecular));
        self.survival.push(1.0);
    }

    /// Forgets all vertices.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.survival.clear();
        self.crossings.clear();
    }

    /// Remembers the lens vertex that the ray from the last vertex passes, if any; the walk goes on as if it did not.
    fn cross_lens<const N: usize, A: Accel>(
        &mut self,
        world: &World<A>,
        pool: &mut Pool<N>,
        o: Vec3,
        dir: Vec3,
        survival: f64,
        tally: &mut Tally,
    ) {
        let Some(&(last, _)) = self.vertices.last() else {
            return;
        };
        if let Some(lens) = world.reach_lens(pool.get(last), o, dir, tally) {
            self.crossings.push(Crossing {
                before: self.len(),
                slot: pool.put(lens),
                survival,
            });
        }
    }

    /// Follows the ray from the last vertex and scatters on, up to `max` vertices in all and, from the light, a lens vertex
    /// beside the ray that leaves each of them.
    #[allow(clippy::too_many_arguments)]
    pub fn follow<const N: usize, A: Accel>(
        &mut self,
        world: &World<A>,
        pool: &mut Pool<N>,
        palette: &Palette<N>,
        transport: Transport,
        (mut start, mut dir): (Start, Vec3),
        max: usize,
        rng: &mut Rng,
        tally: &mut Tally,
    ) {
        let (mut survival, mut beta) = (1.0f64, 1.0f64);
        let may_end_on_lens = transport == Transport::FromLight && world.lens.has_aperture();
        loop {
            if may_end_on_lens {
                self.cross_lens(world, pool, start.o, dir, survival, tally);
            }
            if self.len() >= max {
                return;
            }
            let slot = pool.take();
            let found = trace_into(world, (start, dir), palette, tally, pool.get_mut(slot));
            let v = pool.get(slot);
            if !found || (v.kind != Kind::Surface && transport == Transport::FromLight) {
                pool.release(slot);
                return;
            }
            self.vertices.push((slot, Mode::NonSpecular));
            self.survival.push(survival);
            if v.kind != Kind::Surface || (self.len() >= max && !may_end_on_lens) {
                return;
            }
            if self.len() >= ROULETTE_AFTER {
                let keep = beta.min(1.0);
                if rng.next_f64() >= keep {
                    return;
                }
                survival *= keep;
                beta /= keep;
            }
            let from = -dir;
            let Some((w, mode)) = scatter(v, from, transport, rng) else {
                return;
            };
            let (fs, pdf) = match transport {
                Transport::FromEye => {
                    let t = scatter_terms(v, mode, w, from);
                    (t.fs, t.pdf_e)
                }
                Transport::FromLight => {
                    let t = scatter_terms(v, mode, from, w);
                    (t.fs, t.pdf_l)
                }
            };
            // Nothing scatters, be it with a density of 0 as well.
            if fs.is_black() {
                return;
            }
            let step = fs.max() as f64 * v.cos(w) / pdf;
            if step <= 0.0 || !tally.check(step) {
                return;
            }
            beta *= step;
            self.vertices.last_mut().expect("just pushed").1 = mode;
            start = world.leave(v, v.p, w);
            dir = w;
        }
    }
}
