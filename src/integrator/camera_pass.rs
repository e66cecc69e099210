//! Samples that belong to a pixel: each pixel has its own random streams and sums, so threads never share one.

use crate::accel::Accel;
use crate::film::Filter;
use crate::path::{Tally, Vertex, World};
use crate::sampling::Rng;
use crate::scene::spectrum::{Lanes, Spectrum};
use glam::Vec2;
use rayon::prelude::*;

/// One camera sample's random start.
pub struct CameraSample<const N: usize> {
    /// Raster point.
    pub raster: Vec2,
    /// Filter weight (negative in a negative lobe).
    pub weight: f32,
    /// Wavelengths.
    pub lanes: Lanes<N>,
}

/// Sums of camera samples over the crop.
pub struct CameraPass {
    crop: [u32; 4],
    filter: Filter,
    stage: u32,
    seed: u64,
    sums: Vec<[f64; 3]>,
    /// Samples of each pixel so far.
    pub samples: u64,
}

/// Irrational steps of the Kronecker sequences that stratify a pixel's samples (R2 and the golden ratio).
const R2: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl CameraPass {
    /// No samples yet.
    pub fn new<A: Accel>(world: &World<A>, stage: u32, seed: u64) -> Self {
        let crop = world.scene.camera.crop;
        let n = (crop[2] - crop[0]) as usize * (crop[3] - crop[1]) as usize;
        Self {
            crop,
            filter: Filter::new(&world.scene.settings.filter),
            stage,
            seed,
            sums: vec![[0.0; 3]; n],
            samples: 0,
        }
    }

    /// Adds samples until each pixel has `until`. `f` gets a thread's state, the sample and its stream, and returns XYZ.
    pub fn run<const N: usize, S: Send>(
        &mut self,
        until: u64,
        state: impl Fn() -> S + Sync,
        f: impl Fn(&mut S, &CameraSample<N>, &mut Rng) -> [f64; 3] + Sync,
        done: impl Fn(S) + Sync,
    ) {
        let (from, [x0, y0, x1, _]) = (self.samples, self.crop);
        let width = (x1 - x0) as usize;
        let (filter, stage, seed) = (&self.filter, self.stage, self.seed);
        self.sums
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(row, sums)| {
                let mut s = state();
                let y = y0 + row as u32;
                for (col, sum) in sums.iter_mut().enumerate() {
                    let x = x0 + col as u32;
                    let mut rng = Rng::new(seed, stage, y, x);
                    // Step 0 holds the pixel's shifts of the sequences.
                    rng.set_step(0);
                    let shift = [rng.next_f64(), rng.next_f64(), rng.next_f64()];
                    for i in from..until {
                        rng.set_step(i + 1);
                        let at =
                            |k: usize, step: f64| ((shift[k] + i as f64 * step).fract()) as f32;
                        let u = Vec2::new(at(0, R2[0]), at(1, R2[1]))
                            .min(Vec2::splat(1.0 - f32::EPSILON / 2.0));
                        let (offset, weight) = filter.sample(u);
                        let lanes = Lanes::new(at(2, GOLDEN).min(1.0 - f32::EPSILON / 2.0));
                        let raster = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) + offset;
                        let xyz = f(
                            &mut s,
                            &CameraSample {
                                raster,
                                weight,
                                lanes,
                            },
                            &mut rng,
                        );
                        for c in 0..3 {
                            sum[c] += xyz[c] * weight as f64;
                        }
                    }
                }
                done(s);
            });
        self.samples = until.max(self.samples);
    }

    /// Mean XYZ of each pixel, row-major over the crop.
    pub fn image(&self) -> Vec<[f64; 3]> {
        let k = if self.samples == 0 {
            0.0
        } else {
            1.0 / self.samples as f64
        };
        self.sums.iter().map(|s| s.map(|v| v * k)).collect()
    }
}

/// XYZ of a spectrum at the wavelengths of `lanes`; non-finite values are counted and dropped.
pub fn to_xyz<const N: usize>(s: Spectrum<N>, lanes: &Lanes<N>, tally: &mut Tally) -> [f64; 3] {
    let xyz = lanes.xyz.map(|w| s.dot(w) as f64);
    if tally.check(xyz[0] + xyz[1] + xyz[2]) {
        xyz
    } else {
        [0.0; 3]
    }
}

/// The lens vertex of a camera sample.
pub fn lens_vertex<const N: usize, A: Accel>(world: &World<A>, rng: &mut Rng) -> Vertex<N> {
    world.lens.sample_vertex(rng.next_vec2())
}
