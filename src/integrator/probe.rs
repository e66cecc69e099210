//! A look at a scene before Metropolis light transport: how hard its direct light is, and how unevenly its light lies on
//! the image. A fixed number of samples from streams of their own, so that every shard finds the same.
//!
//! Who should compute direct light? With m mutations a pixel, N pixels and κ the steps between two mutations that are
//! worth as much as independent ones, a chain puts light of mean D and I (direct and indirect, so that b = D + I) into the
//! image with a variance of κ·b·(pixel's light)/m, in the mean over the pixels κ·b²/m. A separate pass of r·m samples a
//! pixel, each of variance V, leaves the chain κ·I²/m and adds V/(r·m). It is the better choice where
//!
//! V/r < κ·((D + I)² − I²).

use super::{Paths, radiance};
use crate::accel::Accel;
use crate::chain::{MltOptions, stage};
use crate::path::{
    Heuristic, Kind, Palette, Sampler, Tally, Vertex, World, scatter, scatter_terms, trace,
};
use crate::sampling::Rng;
use crate::scatter::{Mode, Transport};
use crate::scene::spectrum::Lanes;
use rayon::prelude::*;
use serde::Serialize;

/// Samples of each kind. At this number b has an error of a few per cent in all but the hardest scenes.
const SAMPLES: u32 = 4096;

/// Samples drawn by one task.
const BLOCK: u32 = 256;

/// κ of the derivation: a small one, so that the separate pass has to be clearly better.
const KAPPA: f64 = 2.0;

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
    /// V: variance of one sample of direct light at a raster point.
    pub noise: f64,
    /// Part of the indirect light in paths with a delta.
    pub specular: f64,
    /// mean(L) · mean(1/L) over the light L of 8 × 8 tiles, each taken for at least a tenth of the mean. A chain visits a
    /// pixel in proportion to L, so that its relative variance is as 1/L; with samples spread evenly it is the same in
    /// every pixel, and the mean relative variance that much less.
    pub range: f64,
    /// mean(L²) / mean(L)²: by so much samples spread evenly have the greater mean variance.
    pub loss: f64,
}

/// Tiles each way of the image whose range is told.
const TILES: usize = 8;

impl Probe {
    /// Looks at a scene; rays and faults go into `tally`.
    pub fn new<const N: usize, A: Accel>(world: &World<A>, seed: u64, tally: &mut Tally) -> Self {
        let blocks: Vec<Sums> = (0..SAMPLES / BLOCK)
            .into_par_iter()
            .map(|block| look::<N, A>(world, seed, block))
            .collect();
        // In the order of the blocks, so that the sums have the same bits for any number of threads.
        let mut all = Sums::default();
        for b in &blocks {
            all.add(b);
            *tally += b.tally;
        }
        let n = SAMPLES as f64;
        let tiles: Vec<f64> = all.tiles.iter().map(|t| t.0 / t.1.max(1.0)).collect();
        let mean = tiles.iter().sum::<f64>() / tiles.len() as f64;
        let floored = tiles.iter().map(|t| 1.0 / (t / mean).max(0.1));
        let square = tiles.iter().map(|t| t * t).sum::<f64>() / tiles.len() as f64;
        Self {
            samples: SAMPLES,
            tried: all.tried,
            success: all.reached as f64 / all.tried.max(1) as f64,
            direct: all.direct / n,
            indirect: all.indirect / n,
            noise: all.noise / n,
            specular: all.specular / all.indirect.max(f64::MIN_POSITIVE),
            range: if mean > 0.0 {
                floored.sum::<f64>() / tiles.len() as f64
            } else {
                0.0
            },
            loss: if mean > 0.0 {
                square / mean.powi(2)
            } else {
                0.0
            },
        }
    }

    /// Variance that a separate pass adds over what the chain would add for the same light: below 1 it is worth while.
    pub fn separate_over_chain(&self) -> f64 {
        let rate = MltOptions::default().direct_per_mutation;
        let all = self.direct + self.indirect;
        let chain = KAPPA * (all * all - self.indirect * self.indirect);
        if chain > 0.0 {
            self.noise / rate / chain
        } else {
            // No direct light was found: a pass for it costs samples that find nothing, and the chain finds it as well.
            f64::INFINITY
        }
    }
}

#[derive(Default)]
struct Sums {
    tried: u64,
    reached: u64,
    direct: f64,
    indirect: f64,
    specular: f64,
    noise: f64,
    tiles: Tiles,
    tally: Tally,
}

/// Sum and number of the samples of each tile.
struct Tiles([(f64, f64); TILES * TILES]);

impl Default for Tiles {
    fn default() -> Self {
        Self([(0.0, 0.0); TILES * TILES])
    }
}

impl Tiles {
    fn iter(&self) -> impl Iterator<Item = &(f64, f64)> {
        self.0.iter()
    }
}

impl Sums {
    fn add(&mut self, o: &Self) {
        self.tried += o.tried;
        self.reached += o.reached;
        self.direct += o.direct;
        self.indirect += o.indirect;
        self.specular += o.specular;
        self.noise += o.noise;
        for (a, b) in self.tiles.0.iter_mut().zip(&o.tiles.0) {
            *a = (a.0 + b.0, a.1 + b.1);
        }
    }
}

fn look<const N: usize, A: Accel>(world: &World<A>, seed: u64, block: u32) -> Sums {
    let mut sums = Sums::default();
    let mut tally = Tally::default();
    let mut sampler = Sampler::<N>::new(world.max_edges);
    let mut palette = Palette::new(Lanes::new(0.0));
    let lens = &world.lens;
    for i in 0..BLOCK {
        let mut rng = Rng::new(seed, stage::PROBE, block, i);
        let lanes: Lanes<N> = world.lanes(rng.next_f32());
        palette.tune(&lanes);
        let raster = lens.sample_raster(rng.next_vec2());
        let mut twice = [0.0f64; 2];
        for v in &mut twice {
            let x = lens.sample_vertex(rng.next_vec2());
            let w = lens.direction(x.p, raster);
            radiance(
                world,
                &palette,
                &x,
                w,
                Paths::Direct,
                &mut rng,
                &mut tally,
                |_, c| {
                    *v += c.dot(lanes.target) as f64;
                },
            );
        }
        sums.direct += 0.5 * (twice[0] + twice[1]);
        sums.noise += 0.5 * (twice[0] - twice[1]).powi(2);
        connect(world, &palette, raster, &mut rng, &mut sums, &mut tally);
        let mut found = 0.5 * (twice[0] + twice[1]);
        sampler.sample(world, &lanes, raster, &mut rng, &mut tally);
        sampler.join(world, Heuristic::Balance, true, &mut tally, |j, _| {
            let light = j.weight / lens.raster_area;
            sums.indirect += light;
            found += light;
            let inner = &j.path.links[1..j.path.k()];
            if inner.iter().any(|l| l.mode != Mode::NonSpecular) {
                sums.specular += light;
            }
        });
        let at = ((raster - lens.lo) / (lens.hi - lens.lo) * TILES as f32).floor();
        let most = TILES - 1;
        let tile = (at.y as usize).min(most) * TILES + (at.x as usize).min(most);
        sums.tiles.0[tile].0 += found;
        sums.tiles.0[tile].1 += 1.0;
    }
    sums.tally = tally;
    sums
}

/// Follows a camera ray through deltas to the first surface that can be connected, and tries to connect it to a light.
fn connect<const N: usize, A: Accel>(
    world: &World<A>,
    palette: &Palette<N>,
    raster: glam::Vec2,
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
            let x0 = world.emitters.sample_point(world.scene, palette, rng)?;
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
