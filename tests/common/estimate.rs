//! Luminance by path length and tile, by each integrator's own sampling, with independent repeats for its error.
//!
//! The sums stand beside the film on purpose: they keep what an image mixes. The mean of an MLT image is b whatever the
//! chain does, its share of each path length is not.

use super::stats::Estimate;
use glam::Vec2;
use metrolux::accel::Accel;
use metrolux::chain::{Chain, Direct, MltOptions, Setting, Splat, replay, seed_group};
use metrolux::integrator::{Paths, radiance, test_image};
use metrolux::path::{Heuristic, Palette, Sampler, Tally, World};
use metrolux::sampling::Rng;
use metrolux::scene::FilterKind;
use metrolux::scene::spectrum::Lanes;
use rayon::prelude::*;

/// Streams of these estimators: none that the renderer itself uses.
const STAGE_PT: u32 = 1001;
const STAGE_BDPT: u32 = 1002;
const STAGE_CHAIN: u32 = 1003;
const STAGE_DIRECT: u32 = 1004;

/// Tiles of an image and the path lengths in it.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    crop: [u32; 4],
    tile: u32,
    cols: usize,
    rows: usize,
    edges: usize,
}

impl Grid {
    /// Tiles of `tile`² pixels; what is left over at the right and lower border joins the last tile.
    pub fn new<A: Accel>(world: &World<A>, tile: u32) -> Self {
        let filter = world.scene.settings.filter;
        assert!(filter.kind == FilterKind::Box && filter.radius == [0.5, 0.5]);
        let crop = world.scene.camera.crop;
        let count = |n: u32| (n / tile).max(1) as usize;
        Self {
            crop,
            tile,
            cols: count(crop[2] - crop[0]),
            rows: count(crop[3] - crop[1]),
            edges: world.max_edges,
        }
    }

    fn tiles(&self) -> usize {
        self.cols * self.rows
    }

    fn pixels(&self) -> usize {
        (self.crop[2] - self.crop[0]) as usize * (self.crop[3] - self.crop[1]) as usize
    }

    fn zero(&self) -> Vec<f64> {
        vec![0.0; (self.edges + 1) * self.tiles()]
    }

    fn index(&self, edges: usize, raster: Vec2) -> usize {
        let at =
            |v: f32, from: u32, n: usize| (((v as u32 - from) / self.tile) as usize).min(n - 1);
        let (col, row) = (
            at(raster.x, self.crop[0], self.cols),
            at(raster.y, self.crop[1], self.rows),
        );
        edges * self.tiles() + row * self.cols + col
    }

    /// Pixels of a tile.
    fn tile_pixels(&self, tile: usize) -> usize {
        let side = |i: usize, n: usize, all: u32| {
            let from = i as u32 * self.tile;
            if i + 1 == n { all - from } else { self.tile }
        };
        let (w, h) = (self.crop[2] - self.crop[0], self.crop[3] - self.crop[1]);
        (side(tile % self.cols, self.cols, w) * side(tile / self.cols, self.rows, h)) as usize
    }

    /// Calls `f` for `per_pixel` camera samples in each pixel: raster point, wavelengths, the sample's stream. Points
    /// and wavelengths run through a Kronecker sequence with a random shift, as the renderer's own do.
    fn camera<const N: usize>(
        &self,
        key: (u64, u32, u32),
        per_pixel: u32,
        mut f: impl FnMut(Vec2, Lanes<N>, &mut Rng),
    ) {
        let [x0, y0, x1, y1] = self.crop;
        for y in y0..y1 {
            for x in x0..x1 {
                let mut rng = Rng::new(key.0, key.1, key.2, (y << 16) + x);
                let shift = [rng.next_f64(), rng.next_f64(), rng.next_f64()];
                for i in 0..per_pixel {
                    rng.set_step(i as u64 + 1);
                    // 0.9999: what a sum with the pixel's index must not round up to the next pixel.
                    let at = |k: usize| (shift[k] + i as f64 * STEPS[k]).fract().min(0.9999) as f32;
                    let raster = Vec2::new(x as f32 + at(0), y as f32 + at(1));
                    f(raster, Lanes::new(at(2)), &mut rng);
                }
            }
        }
    }
}

/// Irrational steps that fill the pixel (the R2 sequence) and the wavelengths (the golden ratio) evenly.
const STEPS: [f64; 3] = [
    0.754_877_666_246_692_8,
    0.569_840_290_998_053_3,
    0.618_033_988_749_894_9,
];

/// Independent repeats of an estimate of all lengths and tiles: sums of luminance over pixels.
#[derive(Clone)]
pub struct Run {
    grid: Grid,
    repeats: Vec<Vec<f64>>,
}

impl Run {
    fn new(grid: Grid, repeats: u32, f: impl Fn(u32, &mut Vec<f64>, &mut Tally) + Sync) -> Self {
        let repeats = (0..repeats)
            .into_par_iter()
            .map(|r| {
                let mut sums = grid.zero();
                let mut tally = Tally::default();
                f(r, &mut sums, &mut tally);
                assert_eq!(tally.impossible(), 0, "{tally:?}");
                sums
            })
            .collect();
        Self { grid, repeats }
    }

    /// Mean luminance of the image in paths of `lengths` edges.
    pub fn length(&self, lengths: std::ops::RangeInclusive<usize>) -> Estimate {
        let (t, n) = (self.grid.tiles(), self.grid.pixels() as f64);
        let part = *lengths.start() * t..(*lengths.end() + 1) * t;
        Estimate::of(
            self.repeats
                .iter()
                .map(|s| s[part.clone()].iter().sum::<f64>() / n),
        )
    }

    /// Mean luminance of a tile in paths of all lengths.
    pub fn tile(&self, tile: usize) -> Estimate {
        let n = self.grid.tile_pixels(tile) as f64;
        Estimate::of(
            self.repeats
                .iter()
                .map(|s| s.iter().skip(tile).step_by(self.grid.tiles()).sum::<f64>() / n),
        )
    }

    /// Number of tiles.
    pub fn tiles(&self) -> usize {
        self.grid.tiles()
    }

    /// Longest path.
    pub fn edges(&self) -> usize {
        self.grid.edges
    }
}

/// Path tracing.
pub fn pt<const N: usize, A: Accel>(
    world: &World<A>,
    grid: Grid,
    seed: u64,
    repeats: u32,
    per_pixel: u32,
) -> Run {
    Run::new(grid, repeats, |r, sums, tally| {
        let key = (seed, STAGE_PT, r);
        camera_paths::<N, A>(world, grid, key, per_pixel, Paths::All, sums, tally);
    })
}

fn camera_paths<const N: usize, A: Accel>(
    world: &World<A>,
    grid: Grid,
    key: (u64, u32, u32),
    per_pixel: u32,
    paths: Paths,
    sums: &mut [f64],
    tally: &mut Tally,
) {
    let scale = 1.0 / per_pixel as f64;
    grid.camera::<N>(key, per_pixel, |raster, lanes, rng| {
        let lens = world.lens.sample_vertex(rng.next_vec2());
        let w = world.lens.direction(lens.p, raster);
        let palette = Palette::new(lanes);
        radiance(
            world,
            &palette,
            &lens,
            w,
            paths,
            None,
            rng,
            tally,
            |k, c| {
                sums[grid.index(k, raster)] += c.dot(lanes.xyz[1]) as f64 * scale;
            },
        );
    });
}

/// Bidirectional path tracing.
pub fn bdpt<const N: usize, A: Accel>(
    world: &World<A>,
    grid: Grid,
    heuristic: Heuristic,
    seed: u64,
    repeats: u32,
    per_pixel: u32,
) -> Run {
    Run::new(grid, repeats, |r, sums, tally| {
        let mut sampler = Sampler::<N>::new(world.max_edges);
        let scale = 1.0 / per_pixel as f64 / grid.pixels() as f64;
        grid.camera::<N>((seed, STAGE_BDPT, r), per_pixel, |raster, lanes, rng| {
            sampler.sample(world, &lanes, raster, rng, tally);
            sampler.join(world, heuristic, false, tally, |j, _| {
                let y = j.path.color()[1] as f64 * j.weight * scale;
                sums[grid.index(j.path.k(), j.path.raster)] += y;
            });
        });
    })
}

/// Light tracing onto the lens, t = 0, taken for the only strategy: every path at its unweighted contribution C*.
pub fn light_alone<const N: usize, A: Accel>(
    world: &World<A>,
    grid: Grid,
    seed: u64,
    repeats: u32,
    per_pixel: u32,
) -> Run {
    Run::new(grid, repeats, |r, sums, tally| {
        let mut sampler = Sampler::<N>::new(world.max_edges);
        let scale = 1.0 / per_pixel as f64 / grid.pixels() as f64;
        grid.camera::<N>((seed, STAGE_BDPT, r), per_pixel, |raster, lanes, rng| {
            sampler.sample(world, &lanes, raster, rng, tally);
            for s in 2..=world.max_edges + 1 {
                let made = sampler.join_one(world, s, 0, Heuristic::Balance, false, tally);
                if let Some(weight) = made {
                    let path = sampler.joined().0;
                    // The balance heuristic's weight is ρ_s/Σρ.
                    let unweighted = weight * path.rho_sum() / path.rho[s];
                    let y = path.color()[1] as f64 * unweighted * scale;
                    sums[grid.index(path.k(), path.raster)] += y;
                }
            }
        });
    })
}

/// Size of a Metropolis run.
#[derive(Clone, Copy, Debug)]
pub struct Chains {
    pub options: MltOptions,
    /// Steps of each chain.
    pub steps: u32,
    /// Samples a pixel of the direct pass, if it is separate.
    pub direct: u32,
}

/// Metropolis light transport: each repeat is a group with its own seeding, brightness and chains.
pub fn mlt<const N: usize, A: Accel>(
    world: &World<A>,
    grid: Grid,
    chains: Chains,
    seed: u64,
    repeats: u32,
) -> Run {
    let options = &chains.options;
    Run::new(grid, repeats, |r, sums, tally| {
        let i0 = test_image::<N, A>(world, options, seed + r as u64, tally);
        let set = Setting::new(world, options).with_test_image(i0.as_ref());
        let batch = seed_group::<N, A>(&set, seed, 0, r, tally);
        let mut sampler = Sampler::new(world.max_edges);
        let scale = batch.target / (options.chains as f64 * chains.steps as f64);
        for (c, &s) in batch.seeds.iter().enumerate() {
            assert!(replay(world, options, seed, 0, r, s, &mut sampler, tally));
            let (path, pool) = sampler.joined();
            let rng = Rng::new(seed, STAGE_CHAIN, r, c as u32);
            let mut chain = Chain::<N>::new(world.max_edges, rng);
            let entries = options.entries(&world.lens, seed, 0, r, c as u32);
            if let Some(e) = entries {
                chain.stratify(e);
            }
            chain.start(path, pool);
            let mut sink = |s: Splat| {
                let y = s.xyz[1] as f64 * s.weight as f64 * scale;
                sums[grid.index(s.edges as usize, s.raster)] += y;
            };
            for _ in 0..chains.steps {
                chain.step(&set, &mut sink);
            }
            chain.flush(&mut sink);
            *tally += chain.stats.tally;
        }
        if options.direct == Direct::Separate {
            let key = (seed, STAGE_DIRECT, r);
            camera_paths::<N, A>(world, grid, key, chains.direct, Paths::Direct, sums, tally);
        }
    })
}
