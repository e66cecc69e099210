//! Bidirectional path tracing: all strategies (s,t), light tracing included, joined by MIS (Veach chapter 10).

use super::camera_pass::CameraPass;
use super::{Budget, Clock, Progress};
use crate::accel::Accel;
use crate::chain::stage;
use crate::film::{Crop, Film, Filter, Reserve, WideBuffer};
use crate::path::{Heuristic, Sampler, Tally, World};
use std::sync::Mutex;

/// What is rendered and how strategies are weighted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bdpt {
    /// Weights of the strategies.
    pub heuristic: Heuristic,
    /// Leave out paths of the direct-lighting pass (to compare with a chain that does).
    pub indirect_only: bool,
}

/// Renders by bidirectional path tracing. Returns XYZ of each pixel of the crop and the samples a pixel.
pub fn bdpt<const N: usize, A: Accel>(
    world: &World<A>,
    what: Bdpt,
    budget: Budget,
    seed: u64,
    progress: &dyn Progress,
    tally: &mut Tally,
) -> (Vec<[f64; 3]>, u64) {
    let mut pass = CameraPass::new(world, stage::CAMERA, seed);
    let crop = Crop::from(world.scene.camera.crop);
    let filter = Filter::new(&world.scene.settings.filter);
    let idle = Reserve::new();
    let clock = Clock::new(budget, |n| n.ceil().max(1.0) as u64);
    let inv_area = 1.0 / world.lens.raster_area;
    let total = Mutex::new(Tally::default());
    loop {
        let more = clock.next(pass.samples, 16);
        if more == 0 {
            break;
        }
        let until = pass.samples + more;
        pass.run::<N, (Sampler<N>, Tally, WideBuffer)>(
            until,
            || {
                let buffer = idle.take(|| WideBuffer::new(crop, filter.clone()));
                (Sampler::new(world.max_edges), Tally::default(), buffer)
            },
            |(sampler, tally, buffer), s, rng| {
                sampler.sample(world, &s.lanes, s.raster, rng, tally);
                let mut sum = [0.0; 3];
                sampler.join(
                    world,
                    what.heuristic,
                    what.indirect_only,
                    tally,
                    |j, tally| {
                        let xyz = j.path.color().map(|c| c as f64 * j.weight);
                        if j.t == 1 {
                            if let Err(f) = buffer.splat(j.path.raster, xyz) {
                                tally.fault(f.into());
                            }
                        } else {
                            for c in 0..3 {
                                sum[c] += xyz[c] * inv_area;
                            }
                        }
                    },
                );
                sum
            },
            |(_, t, buffer)| {
                idle.put(buffer);
                *total.lock().expect("no thread panicked") += t;
            },
        );
        progress.update(clock.fraction(pass.samples));
    }
    *tally += *total.lock().expect("no thread panicked");
    let n = pass.samples;
    let mut image = pass.image();
    // Every camera sample also traced one light sub-path towards the whole image.
    let mut film = Film::new(crop);
    idle.drain().iter_mut().for_each(|b| film.absorb_wide(b));
    let scale = 1.0 / (n.max(1) as f64 * image.len() as f64);
    for (p, s) in image.iter_mut().zip(film.to_xyz(scale)) {
        for c in 0..3 {
            p[c] += s[c];
        }
    }
    (image, n)
}
