//! Random walks: the sub-paths of bidirectional sampling.

use super::trace::trace_into;
use super::{Kind, Palette, Pool, Tally, World, scatter, scatter_terms};
use crate::accel::{Accel, offset_origin};
use crate::sampling::Rng;
use crate::scatter::{Mode, Transport};
use glam::Vec3;

/// Vertices after which Russian roulette begins.
const ROULETTE_AFTER: usize = 5;

/// The vertices of a sub-path in the order they were found.
#[derive(Default)]
pub struct Walk {
    /// Pool slot and scattering mode of each vertex.
    pub vertices: Vec<(u16, Mode)>,
    /// Probability that roulette let the walk come as far as this vertex. Not part of the densities p_{s,t}.
    pub survival: Vec<f64>,
}

impl Walk {
    /// Room for `n` vertices.
    pub fn new(n: usize) -> Self {
        Self {
            vertices: Vec::with_capacity(n),
            survival: Vec::with_capacity(n),
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
    }

    /// Follows the ray from the last vertex and scatters on, up to `max` vertices in all.
    #[allow(clippy::too_many_arguments)]
    pub fn follow<const N: usize, A: Accel>(
        &mut self,
        world: &World<A>,
        pool: &mut Pool<N>,
        palette: &Palette<N>,
        transport: Transport,
        (mut o, mut dir): (Vec3, Vec3),
        max: usize,
        rng: &mut Rng,
        tally: &mut Tally,
    ) {
        let (mut survival, mut beta) = (1.0f64, 1.0f64);
        while self.len() < max {
            let slot = pool.take();
            let found = trace_into(world, (o, dir), palette, tally, pool.get_mut(slot));
            let v = pool.get(slot);
            if !found || (v.kind != Kind::Surface && transport == Transport::FromLight) {
                pool.release(slot);
                return;
            }
            self.vertices.push((slot, Mode::NonSpecular));
            self.survival.push(survival);
            if v.kind != Kind::Surface || self.len() >= max {
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
            let step = match transport {
                Transport::FromEye => {
                    let t = scatter_terms(v, mode, w, from);
                    t.fs.max() as f64 * v.cos(w) / t.pdf_e
                }
                Transport::FromLight => {
                    let t = scatter_terms(v, mode, from, w);
                    t.fs.max() as f64 * v.cos(w) / t.pdf_l
                }
            };
            // Also ends the walk where nothing scatters and the density is zero with it (0/0).
            if step.is_nan() || step <= 0.0 {
                return;
            }
            beta *= step;
            self.vertices.last_mut().expect("just pushed").1 = mode;
            o = offset_origin(v.p, v.error, v.ng, w);
            dir = w;
        }
    }
}
