//! Bidirectional path tracing: all strategies (s,t), light tracing included, joined by MIS (Veach chapter 10).

use super::camera_pass::CameraPass;
use super::target::Looks;
use super::{Budget, Clock, FIRST_LOOK, Progress, Rendered, Stop};
use crate::accel::Accel;
use crate::chain::stage;
use crate::film::{Bins, Crop, Film, Filter, PixelErrors, Reserve};
use crate::film::{SpectralFilm, SquareBuffer, WideBuffer, WideSpectralBuffer};
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
type Buffers = (WideBuffer, SquareBuffer, Option<WideSpectralBuffer>);

/// As [`bdpt`], with spectral bins.
pub fn bdpt_bins<const N: usize, A: Accel>(
    world: &World<A>,
    what: Bdpt,
    bins: Option<Bins>,
    stop: impl Into<Stop>,
    seed: u64,
    progress: &dyn Progress,
    tally: &mut Tally,
) -> Rendered {
    let mut pass = CameraPass::new(world, bins, stage::CAMERA, seed);
    let crop = Crop::from(world.scene.camera.crop);
    let filter = Filter::new(&world.scene.settings.filter);
    let idle = Reserve::new();
    let stop = stop.into();
    let clock = Clock::new(stop.budget, |n| n.ceil().max(1.0) as u64);
    let mut looks = Looks::new(stop.target_error, FIRST_LOOK);
    let mut film = Film::new(crop);
    let mut spectra = bins.map(|b| SpectralFilm::new(crop, b));
    let mut squares = SquareBuffer::new(crop, filter.clone());
    let inv_area = 1.0 / world.lens.raster_area;
    let total = Mutex::new(Tally::default());
    let mut target_met = false;
    while !target_met {
        let done = pass.samples as u64;
        let more = looks.until_next(done, clock.next(done, 16));
        if more == 0 {
            break;
        }
        let until = pass.samples + more as f64;
        pass.run::<N, (Sampler<N>, Tally, Buffers)>(
            until,
            || {
                let buffer = idle.take(|| {
                    let spectral = bins.map(|b| WideSpectralBuffer::new(crop, b, filter.clone()));
                    (
                        WideBuffer::new(crop, filter.clone()),
                        SquareBuffer::new(crop, filter.clone()),
                        spectral,
                    )
                });
                (Sampler::new(world.max_edges), Tally::default(), buffer)
            },
            |(sampler, tally, (buffer, squares, spectral)), s, rng, sum| {
                sampler.sample(world, &s.lanes, s.raster, rng, tally);
                sampler.join(
                    world,
                    what.heuristic,
                    what.indirect_only,
                    tally,
                    |j, tally| {
                        let xyz = j.path.color().map(|c| c as f64 * j.weight);
                        if j.t <= 1 {
                            match buffer.splat(j.path.raster, xyz) {
                                Ok(()) => squares.splat(j.path.raster, xyz[1]),
                                Err(f) => tally.fault(f.into()),
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
                squares.close();
            },
            |(_, t, buffer)| {
                idle.put(buffer);
                *total.lock().expect("no thread panicked") += t;
            },
        );
        let done = pass.samples as u64;
        target_met = looks.met(done, || {
            gather(&idle, &mut film, &mut squares, &mut spectra);
            let (image, errors) = joined(&pass, &film, &squares);
            errors.summary(&image)
        });
        progress.update(clock.fraction(done).max(looks.fraction(done)));
    }
    *tally += *total.lock().expect("no thread panicked");
    gather(&idle, &mut film, &mut squares, &mut spectra);
    let (image, errors) = joined(&pass, &film, &squares);
    let mut spectrum = pass.spectrum();
    if let (Some(sums), Some(film)) = (&mut spectrum, spectra) {
        let scale = light_samples(&pass).recip();
        for (a, b) in sums.iter_mut().zip(film.to_values(scale)) {
            *a += b as f64;
        }
    }
    Rendered {
        image,
        spectrum,
        samples: pass.samples as u64,
        errors,
        target_met,
    }
}

/// Light sub-paths: every camera sample also traced one towards the whole image.
fn light_samples(pass: &CameraPass) -> f64 {
    (pass.samples as u64).max(1) as f64 * pass.sums.len() as f64
}

/// Adds all threads' splats to the sums.
fn gather(
    idle: &Reserve<Buffers>,
    film: &mut Film,
    squares: &mut SquareBuffer,
    spectra: &mut Option<SpectralFilm>,
) {
    for (mut colors, square, spectral) in idle.drain() {
        film.absorb_wide(&mut colors);
        squares.merge(&square);
        if let (Some(f), Some(mut b)) = (spectra.as_mut(), spectral) {
            f.absorb_wide(&mut b);
        }
    }
}

/// Camera samples and splats as one image. What a sample gives its own pixel from both sides is taken for independent:
/// of all the samples that may splat there it is one.
fn joined(pass: &CameraPass, film: &Film, squares: &SquareBuffer) -> (Vec<[f64; 3]>, PixelErrors) {
    let samples = light_samples(pass);
    let light = film.to_xyz(samples.recip());
    let mut errors = PixelErrors {
        variance: pass.variance(),
        freedom: (pass.samples as u64).saturating_sub(1).max(1),
    };
    errors.add(&squares.variance(samples, light.iter().map(|p| p[1])));
    let mut image = pass.image();
    for (p, s) in image.iter_mut().zip(light) {
        for c in 0..3 {
            p[c] += s[c];
        }
    }
    (image, errors)
}

/// A joined path's spectrum, by lane: the wavelength, and radiance times the nanometres it stands for.
fn per_nm<const N: usize>(j: &Joined<N>) -> impl Iterator<Item = (f32, f64)> + Clone {
    let (lanes, k) = (j.path.lanes, j.weight / j.path.shape_tau);
    let values = j.path.shape * lanes.nm();
    let lane = move |i: usize| (lanes.lambda[i], values[i] as f64 * k);
    (0..N).map(lane)
}
