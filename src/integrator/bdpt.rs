//! Bidirectional path tracing: all strategies (s,t), light tracing included, joined by MIS (Veach chapter 10).

use super::keeper::unkept;
use super::light_sums::{Buffers, LightSums};
use super::sample::{Sampling, sample};
use super::{Budget, CameraPass, Keeper, Nobody, Progress, Rendered, Stop};
use crate::accel::Accel;
use crate::film::{Bins, Crop, Filter, Malformed, Reserve};
use crate::film::{SquareBuffer, WideBuffer, WideSpectralBuffer};
use crate::path::{Heuristic, Joined, Sampler, Tally, World};
use crate::real::Convert;
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

/// As [`bdpt`], with spectral bins.
pub fn bdpt_bins<const N: usize, A: Accel>(
    world: &World<A>,
    how: Bdpt,
    bins: Option<Bins>,
    stop: impl Into<Stop>,
    seed: u64,
    progress: &dyn Progress,
    tally: &mut Tally,
) -> Rendered {
    let what = Sampling {
        world,
        bins,
        stop: stop.into(),
        seed,
    };
    unkept(bdpt_kept::<N, A>(what, how, progress, tally, &mut Nobody))
}

/// As [`bdpt_bins`], with somebody who may stop it and go on with it.
///
/// # Errors
/// A state to go on from that is of another run.
pub fn bdpt_kept<const N: usize, A: Accel>(
    what: Sampling<A>,
    how: Bdpt,
    progress: &dyn Progress,
    tally: &mut Tally,
    keeper: &mut dyn Keeper,
) -> Result<Rendered, Malformed> {
    let (world, bins) = (what.world, what.bins);
    let crop = Crop::from(world.scene.camera.crop);
    let filter = Filter::new(&world.scene.settings.filter);
    let idle: Reserve<Buffers> = Reserve::new();
    let inv_area = 1.0 / world.lens.raster_area;
    let add = |pass: &mut CameraPass, until: f64, tally: &mut Tally| {
        let total = Mutex::new(Tally::default());
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
                let faults = tally.impossible();
                sampler.sample(world, &s.lanes, s.raster, rng, tally);
                sampler.join(
                    world,
                    how.heuristic,
                    how.indirect_only,
                    tally,
                    |j, tally| {
                        let xyz = j.path.color().map(|c| c as f64 * j.weight);
                        let raster = j.path.raster.single();
                        if j.t <= 1 {
                            match buffer.splat(raster, xyz) {
                                Ok(()) => squares.splat(raster, xyz[1]),
                                Err(f) => tally.fault(f.into()),
                            }
                            if let Some(b) = spectral
                                && let Err(f) = b.splat(raster, per_nm(&j))
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
                if tally.impossible() != faults {
                    world.sites.note(s.site(false));
                }
            },
            |(_, t, buffer)| {
                idle.put(buffer);
                *total.lock().expect("no thread panicked") += t;
            },
        );
        *tally += *total.lock().expect("no thread panicked");
    };
    let gather = |light: &mut LightSums| {
        idle.drain().into_iter().for_each(|b| light.absorb(b));
    };
    sample(what, &add, Some(&gather), progress, tally, keeper)
}

/// A joined path's spectrum, by lane: the wavelength, and radiance times the nanometres it stands for.
fn per_nm<const N: usize>(j: &Joined<N>) -> impl Iterator<Item = (f32, f64)> + Clone {
    let (lanes, k) = (j.path.lanes, j.weight / j.path.shape_tau);
    let values = j.path.shape * lanes.nm();
    let lane = move |i: usize| (lanes.lambda[i].single(), values[i] as f64 * k);
    (0..N).map(lane)
}
