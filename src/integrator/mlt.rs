//! Metropolis light transport: chains for what is hard, a stratified pass for direct light.

use super::pt::add_samples;
use super::target::Looks;
use super::{CameraPass, Clock, Paths, Progress, Stop, test_image};
use crate::accel::Accel;
use crate::chain::{ChainStats, Direct, Mlt, MltOptions, stage};
use crate::film::PixelErrors;
use crate::path::{Tally, World};

/// What a run gave.
pub struct MltResult {
    /// XYZ of each pixel of the crop.
    pub image: Vec<[f64; 3]>,
    /// Radiance per nm, `[pixel · bins + bin]`, if the options ask for bins.
    pub spectrum: Option<Vec<f64>>,
    /// Rounds made.
    pub rounds: u64,
    /// Mutations made.
    pub mutations: u64,
    /// Samples a pixel of the direct pass, in the mean.
    pub direct_samples: f64,
    /// b (mean over the raster domain, per px²) and its standard error.
    pub b: (f64, f64),
    /// Counters of the chains.
    pub stats: ChainStats,
    /// Error of each pixel, from the groups and the samples of the direct pass.
    pub errors: PixelErrors,
    /// The target error was met at a look.
    pub target_met: bool,
}

/// Mutations a pixel made at once, if there is time: at the end of a stretch every group's pixels are looked through,
/// which then costs some 2 % of a mutation for each mutation.
const STRETCH: f64 = 8.0;

/// Renders by Metropolis light transport.
pub fn mlt<const N: usize, A: Accel>(
    world: &World<A>,
    options: &MltOptions,
    stop: impl Into<Stop>,
    seed: u64,
    progress: &dyn Progress,
    tally: &mut Tally,
) -> MltResult {
    let crop = world.scene.camera.crop;
    let pixels = (crop[2] - crop[0]) as u64 * (crop[3] - crop[1]) as u64;
    let stop = stop.into();
    let mut looks = Looks::new(stop.target_error, 1);
    let rounds_for = |n| options.rounds_for(n, pixels);
    let clock = Clock::new(stop.budget, rounds_for).in_stretches(rounds_for(STRETCH));
    let i0 = test_image::<N, A>(world, options, seed, tally);
    let mut run = Mlt::<A, N>::new(world, *options, seed).with_test_image(i0);
    let mut direct = CameraPass::new(world, options.bins, stage::DIRECT, seed);
    // A function of the rounds alone, so that a longer run repeats a shorter one.
    let direct_for = |rounds: u64| {
        let per_pixel = (rounds * options.mutations_per_round()) as f64 / pixels as f64;
        per_pixel * options.direct_per_mutation
    };
    let mut target_met = false;
    while !target_met {
        let most = clock.next(run.rounds, options.rounds_per_generation as u64);
        let more = looks.until_next(run.rounds, most);
        if more == 0 {
            break;
        }
        run.run(more);
        if options.direct == Direct::Separate {
            add_samples::<N, A>(
                world,
                &mut direct,
                direct_for(run.rounds),
                Paths::Direct,
                tally,
            );
        }
        target_met = looks.met(run.rounds, || {
            let (image, errors) = joined(&mut run, &direct);
            errors.summary(&image)
        });
        let rounds = run.rounds;
        progress.update(clock.fraction(rounds).max(looks.fraction(rounds)));
    }
    let (image, errors) = joined(&mut run, &direct);
    let spectrum = run.spectrum().zip(direct.spectrum()).map(|(s, d)| {
        let both = s.iter().zip(d);
        both.map(|(s, d)| *s as f64 + d).collect()
    });
    let stats = run.stats();
    *tally += stats.tally;
    *tally += run.seeding;
    let (b, se) = run.brightness();
    let a = world.lens.raster_area;
    MltResult {
        image,
        spectrum,
        rounds: run.rounds,
        mutations: run.mutations(),
        direct_samples: direct.samples,
        b: (b / a, se / a),
        stats,
        errors,
        target_met,
    }
}

/// The chains' light and the direct pass's as one image; they are independent, so the variances add up.
fn joined<const N: usize, A: Accel>(
    run: &mut Mlt<A, N>,
    direct: &CameraPass,
) -> (Vec<[f64; 3]>, PixelErrors) {
    let mut errors = PixelErrors {
        variance: run.variance(),
        freedom: run.freedom(),
    };
    let mut image = run.image();
    if direct.samples > 0.0 {
        errors.add(&direct.variance());
        for (p, d) in image.iter_mut().zip(direct.image()) {
            for c in 0..3 {
                p[c] += d[c];
            }
        }
    }
    (image, errors)
}
