//! Bidirectional path tracing: all strategies (s,t), light tracing included, joined by MIS (Veach chapter 10).

use super::camera_pass::CameraPass;
use super::{Budget, Clock, Progress, Rendered};
use crate::accel::Accel;
use crate::chain::stage;
use crate::film::{Bins, Crop, Film, Filter, Reserve};
use crate::film::{SpectralFilm, WideBuffer, WideSpectralBuffer};
use crate::path::{Heuristic, Joined, Sampler, Tally, World};
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
    let r = bdpt_bins::<N, A>(world, what, None, budget, seed, progress, tally);
    (r.image, r.samples)
}

/// A thread's light-tracing splats.
type Buffers = (WideBuffer, Option<WideSpectralBuffer>);

/// As [`bdpt`], with spectral bins.
pub fn bdpt_bins<const N: usize, A: Accel>(
    world: &World<A>,
    what: Bdpt,
    bins: Option<Bins>,
    budget: Budget,
    seed: u64,
    progress: &dyn Progress,
    tally: &mut Tally,
) -> Rendered {
    let mut pass = CameraPass::new(world, bins, stage::CAMERA, seed);
    let crop = Crop::from(world.scene.camera.crop);
    let filter = Filter::new(&world.scene.settings.filter);
    let idle = Reserve::new();
    let clock = Clock::new(budget, |n| n.ceil().max(1.0) as u64);
    let inv_area = 1.0 / world.lens.raster_area;
    let total = Mutex::new(Tally::default());
    loop {
        let more = clock.next(pass.samples as u64, 16);
        if more == 0 {
            break;
        }
        let until = pass.samples + more as f64;
        pass.run::<N, (Sampler<N>, Tally, Buffers)>(
            until,
            || {
                let buffer = idle.take(|| {
                    let spectral = bins.map(|b| WideSpectralBuffer::new(crop, b, filter.clone()));
                    (WideBuffer::new(crop, filter.clone()), spectral)
                });
                (Sampler::new(world.max_edges), Tally::default(), buffer)
            },
            |(sampler, tally, (buffer, spectral)), s, rng, sum| {
                sampler.sample(world, &s.lanes, s.raster, rng, tally);
                sampler.join(
                    world,
                    what.heuristic,
                    what.indirect_only,
                    tally,
                    |j, tally| {
                        let xyz = j.path.color().map(|c| c as f64 * j.weight);
                        if j.t <= 1 {
                            if let Err(f) = buffer.splat(j.path.raster, xyz) {
                                tally.fault(f.into());
                            }
                            if let Some(b) = spectral
                                && let Err(f) = b.splat(j.path.raster, per_nm(&j))
                            {
                                tally.fault(f.into());
                            }
                        } else {
                            for (sum, v) in sum.xyz.iter_mut().zip(xyz) {
                                *sum += v * inv_area;
                            }
                            let k = j.weight * inv_area / j.path.shape_tau;
                            sum.add_to_bins(j.path.shape, &j.path.lanes, k);
                        }
                    },
                );
            },
            |(_, t, buffer)| {
                idle.put(buffer);
                *total.lock().expect("no thread panicked") += t;
            },
        );
        progress.update(clock.fraction(pass.samples as u64));
    }
    *tally += *total.lock().expect("no thread panicked");
    let n = pass.samples as u64;
    let mut image = pass.image();
    // Every camera sample also traced one light sub-path towards the whole image.
    let mut film = Film::new(crop);
    let mut spectra = bins.map(|b| SpectralFilm::new(crop, b));
    for (colors, spectral) in &mut idle.drain() {
        film.absorb_wide(colors);
        if let (Some(f), Some(b)) = (&mut spectra, spectral) {
            f.absorb_wide(b);
        }
    }
    let scale = 1.0 / (n.max(1) as f64 * image.len() as f64);
    for (p, s) in image.iter_mut().zip(film.to_xyz(scale)) {
        for c in 0..3 {
            p[c] += s[c];
        }
    }
    let mut spectrum = pass.spectrum();
    if let (Some(sums), Some(film)) = (&mut spectrum, spectra) {
        for (a, b) in sums.iter_mut().zip(film.to_values(scale)) {
            *a += b as f64;
        }
    }
    Rendered {
        image,
        spectrum,
        samples: n,
    }
}

/// A joined path's spectrum, by lane: the wavelength, and radiance times the nanometres it stands for.
fn per_nm<const N: usize>(j: &Joined<N>) -> impl Iterator<Item = (f32, f64)> + Clone {
    let (lanes, k) = (j.path.lanes, j.weight / j.path.shape_tau);
    let values = j.path.shape * lanes.nm();
    let lane = move |i: usize| (lanes.lambda[i], values[i] as f64 * k);
    (0..N).map(lane)
}
