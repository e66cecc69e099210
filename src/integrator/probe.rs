//! A look at a scene before Metropolis light transport: how hard its direct light is, and how unevenly its light lies on
//! the image. A fixed number of samples from streams of their own, so that every shard finds the same.
//!
//! Who should compute direct light, and how many samples should it get? With m mutations a pixel, of which κ are worth one
//! independent one, a chain puts light of mean D + I (direct and indirect, so that b = D + I) into a tile with light
//! D_t + I_t with a variance of κ·(D + I)·(D_t + I_t)/m. A separate pass leaves the chain κ·I·I_t/m and adds what
//! [`DirectRate`] says. All of it counts relative to (D_t + I_t)², in the mean over the tiles.

use super::probe_tiles::Tiles;
use super::{Paths, radiance};
use crate::accel::Accel;
use crate::chain::{DirectRate, stage};
use crate::path::{
    Heuristic, Kind, LightPoint, Palette, Sampler, Tally, Vertex, World, scatter, scatter_terms,
    trace,
};
use crate::real::{Convert, Vec2};
use crate::sampling::{EDGE, Rng};
use crate::scatter::{Mode, Transport};
use crate::scene::spectrum::{Lanes, Spectrum};
use rayon::prelude::*;
use serde::Serialize;

/// Samples of each kind. At this number b has an error of a few per cent in all but the hardest scenes.
const SAMPLES: u32 = 4096;

/// Triples of samples of direct light for each of them: edges and bright points are rare.
const TRIPLES: u32 = 4;

/// Samples drawn by one task.
const BLOCK: u32 = 256;

/// κ: mutations that are worth an independent one. 0.7 (cornell) to 32 (staircase2) were measured, see docs/plan.md.
const KAPPA: f64 = 3.0;

/// c: time of a sample of direct light over that of a mutation, as measured in cornell.
const COST: f64 = 1.3;

/// Mutations a pixel for which it is decided who computes direct light.
const MUTATIONS: f64 = 100.0;

/// What a probe saw. Light is τ for a pixel, in the mean over the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Probe {
    /// Samples of each kind.
    pub samples: u32,
    /// Direct connections that were tried, and the part of them that was not blocked and carried light.
    pub tried: u64,
    /// See `tried`.
    pub success: f64,
    /// D: direct light, LS*E and LDS*E.
    pub direct: f64,
    /// I: all other light.
    pub indirect: f64,
    /// V: variance of one sample of direct light at a raster point, relative to the square of the light around it.
    pub noise: f64,
    /// E: what edges and shades within a pixel add to that.
    pub edges: f64,
    /// I·I_t of the tiles, relative in the same way: κ times this is the chain's variance at one mutation a pixel.
    pub beside: f64,
    /// (D + I)·(D_t + I_t), likewise.
    pub whole: f64,
    /// Part of the indirect light in paths with a delta.
    pub specular: f64,
    /// mean(L) · mean(1/L) over the light L of 8 × 8 tiles, each taken for at least a tenth of the mean. A chain visits a
    /// pixel in proportion to L, so that its relative variance is as 1/L; with samples spread evenly it is the same in
    /// every pixel, and the mean relative variance that much less.
    pub range: f64,
    /// mean(L²) / mean(L)²: by so much samples spread evenly have the greater mean variance.
    pub loss: f64,
}

impl Probe {
    /// Looks at a scene; rays and faults go into `tally`.
    pub fn new<const N: usize, A: Accel>(world: &World<A>, seed: u64, tally: &mut Tally) -> Self {
        let blocks: Vec<Sums> = (0..SAMPLES / BLOCK)
            .into_par_iter()
            .map(|block| look::<N, A>(world, seed, block))
            .collect();
        // In the order of the blocks, so that the sums have the same bits for any number of threads.
        let mut all = Sums::default();
        for mut b in blocks {
            all.append(&mut b);
            *tally += b.tally;
        }
        let tiles = &all.tiles;
        let [direct, indirect] = tiles.means();
        let [noise, edges] = tiles.variances();
        let light = (direct + indirect).max(f64::MIN_POSITIVE);
        Self {
            samples: SAMPLES,
            tried: all.tried,
            success: all.reached as f64 / all.tried.max(1) as f64,
            direct,
            indirect,
            noise,
            edges,
            beside: tiles.mean(|(_, i, l)| indirect * i / l.powi(2)),
            whole: tiles.mean(|(d, i, l)| light * (d + i) / l.powi(2)),
            specular: all.specular / (indirect * SAMPLES as f64).max(f64::MIN_POSITIVE),
            range: tiles.mean(|(_, _, l)| light / l),
            loss: tiles.mean(|(d, i, _)| ((d + i) / light).powi(2)),
        }
    }

    /// How many samples a separate pass should get.
    pub fn rate(&self) -> DirectRate {
        let chain = COST * KAPPA * self.beside;
        // Without other light there is nothing that time could be better spent on: anything far above the most.
        let over = |v: f64| if v < 1e6 * chain { v / chain } else { 1e6 };
        let rate = DirectRate {
            noise: over(self.noise),
            edges: over(1.5 * EDGE * self.edges),
        };
        rate.rounded()
    }

    /// Error at equal time with a separate pass over that without: below 1 it is worth while.
    pub fn separate_over_chain(&self) -> f64 {
        if self.direct <= 0.0 {
            // A pass for it costs samples that find nothing, and the chain finds it as well.
            return f64::INFINITY;
        }
        let n = self.rate().samples(MUTATIONS);
        let pass = self.noise / n + EDGE * self.edges * n.powf(-1.5);
        let error = KAPPA * self.beside / MUTATIONS + pass;
        error * (MUTATIONS + COST * n) / (KAPPA * self.whole)
    }
}

#[derive(Default)]
struct Sums {
    tried: u64,
    reached: u64,
    specular: f64,
    tiles: Tiles,
    tally: Tally,
}

impl Sums {
    fn append(&mut self, o: &mut Self) {
        self.tried += o.tried;
        self.reached += o.reached;
        self.specular += o.specular;
        self.tiles.append(&mut o.tiles);
    }
}

fn look<const N: usize, A: Accel>(world: &World<A>, seed: u64, block: u32) -> Sums {
    let mut sums = Sums::default();
    let mut tally = Tally::default();
    let mut sampler = Sampler::<N>::new(world.max_edges);
    let mut palette = Palette::new(Lanes::new(0.0));
    let lens = &world.lens;
    let place = |raster: Vec2| ((raster - lens.lo) / (lens.hi - lens.lo)).single();
    for i in 0..BLOCK {
        let mut rng = Rng::new(seed, stage::PROBE, block, i);
        let lanes: Lanes<N> = world.lanes(rng.next_f32());
        palette.tune(&lanes);
        let raster = lens.sample_raster(rng.next_vec2());
        let mut direct = |raster, rng: &mut Rng| {
            let x = lens.sample_vertex(rng.next_vec2());
            let w = lens.direction(x.p, raster);
            let [mut light, mut lamp] = [0.0f64; 2];
            let add = |edges, c: Spectrum<N>| {
                let c = c.dot(lanes.target) as f64;
                light += c;
                if edges == 1 && !world.emitters.has_sky() {
                    lamp += c;
                }
            };
            let (paths, tally) = (Paths::Direct, &mut tally);
            radiance(world, &palette, &x, w, paths, None, rng, tally, add);
            (light, lamp)
        };
        for _ in 0..TRIPLES {
            let raster = lens.sample_raster(rng.next_vec2());
            let [(a, lamp), (b, _)] = [direct(raster, &mut rng), direct(raster, &mut rng)];
            let beside = (raster.floor() + rng.next_vec2()).clamp(lens.lo, lens.hi);
            let (beside, other) = direct(beside, &mut rng);
            let lamps = [lamp, other];
            sums.tiles.direct(place(raster), [a, b], beside, lamps);
        }
        let mut indirect = 0.0;
        sampler.sample(world, &lanes, raster, &mut rng, &mut tally);
        sampler.join(world, Heuristic::Balance, true, &mut tally, |j, _| {
            let light = j.weight / lens.raster_area;
            indirect += light;
            let inner = &j.path.links[1..j.path.k()];
            if inner.iter().any(|l| l.mode != Mode::NonSpecular) {
                sums.specular += light;
            }
        });
        sums.tiles.indirect(place(raster), indirect);
        connect(world, &palette, raster, &mut rng, &mut sums, &mut tally);
    }
    sums.tally = tally;
    sums
}

/// Follows a camera ray through deltas to the first surface that can be connected, and tries to connect it to a light.
fn connect<const N: usize, A: Accel>(
    world: &World<A>,
    palette: &Palette<N>,
    raster: Vec2,
    rng: &mut Rng,
    sums: &mut Sums,
    tally: &mut Tally,
) -> Option<()> {
    let mut x: Vertex<N> = world.lens.sample_vertex(rng.next_vec2());
    let mut w = world.lens.direction(x.p, raster);
    for _ in 1..world.max_edges {
        let v = trace(world, &x, w, palette, tally)?;
        if v.kind != Kind::Surface {
            return None;
        }
        if v.bsdf.has_non_specular() {
            sums.tried += 1;
            let x0 = world
                .emitters
                .sample_point(world.scene, palette, LightPoint::new(rng))?;
            let (l, _) = v.towards(&x0);
            let t = scatter_terms(&v, Mode::NonSpecular, l, -w);
            let sent = world.emitters.radiance(world.scene, &x0, -l);
            let carries = !t.fs.is_black() && !sent.is_black();
            if carries && world.visible(&v, &x0, tally) {
                sums.reached += 1;
            }
            return None;
        }
        let (next, _) = scatter(&v, -w, Transport::FromEye, rng)?;
        (x, w) = (v, next);
    }
    None
}
