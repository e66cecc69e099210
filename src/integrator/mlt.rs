//! Metropolis light transport: chains for what is hard, a stratified pass for direct light.

use super::gaze::Gazes;
use super::keeper::unkept;
use super::pt::add_samples;
use super::state::{Kind, save_chains};
use super::target::Looks;
use super::{CameraPass, CameraSums, Clock, Keeper, Nobody, Outcome, Paths, Progress};
use super::{Standing, Stop, test_image};
use crate::accel::Accel;
use crate::chain::{ChainStats, Direct, Mlt, MltOptions, Sums, stage};
use crate::film::{Crop, Malformed, PixelErrors, Writer};
use crate::path::{Tally, World};
use std::io;

/// What a run gave.
pub struct MltResult {
    /// XYZ of each pixel of the crop.
    pub image: Vec<[f64; 3]>,
    /// The part of it that the direct pass made, if there is one.
    pub direct: Option<Vec<[f64; 3]>>,
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
    let what = (stop.into(), seed);
    let run = mlt_kept::<N, A>(world, options, what, progress, tally, &mut Nobody);
    unkept(run)
}

/// As [`mlt`], given when to stop and the seed, with somebody who may stop it and go on with it.
///
/// # Errors
/// A state to go on from that is of another run.
pub fn mlt_kept<const N: usize, A: Accel>(
    world: &World<A>,
    options: &MltOptions,
    (stop, seed): (Stop, u64),
    progress: &dyn Progress,
    tally: &mut Tally,
    keeper: &mut dyn Keeper,
) -> Result<MltResult, Malformed> {
    let pixels = Crop::from(world.scene.camera.crop).pixels() as u64;
    let rounds_for = |n| options.rounds_for(n, pixels);
    let mut clock = Clock::new(stop.budget, rounds_for)
        .in_stretches(rounds_for(STRETCH))
        .with_patience(keeper.patience());
    let mut looks = Looks::new(stop.target_error, 1);
    let shards = keeper.shards();
    let mut spent = Tally::default();
    // It depends on scene, options and seed alone, and so is made again rather than kept.
    let i0 = test_image::<N, A>(world, options, seed, &mut spent);
    let gazes = match options.direct {
        Direct::Separate => Gazes::find::<N, A>(world, &mut spent),
        Direct::InChain => Gazes::none(Crop::from(world.scene.camera.crop)),
    };
    let mut direct = CameraPass::new(world, options.bins, stage::DIRECT, seed);
    let mut run = if let Some(state) = keeper.begin() {
        let Kind::Chains(chains, sums, _) = state.sums else {
            return Err(Malformed::new("is of another integrator"));
        };
        direct.resume(sums)?;
        // Counted when the test image was first made.
        spent = state.tally;
        clock = clock.after(chains.sums.rounds, state.seconds);
        looks = looks.after(chains.sums.rounds);
        Mlt::<A, N>::resume(world, *options, seed, i0, *chains)?
    } else {
        direct = direct.with_shards(shards.clone());
        let run = Mlt::<A, N>::new(world, *options, seed).with_shards(shards);
        run.with_test_image(i0)
    };
    clock.check(run.rounds())?;
    // A function of the rounds alone, so that a longer run repeats a shorter one.
    let direct_for = |rounds: u64| {
        let per_pixel = (rounds * options.mutations_per_round()) as f64 / pixels as f64;
        options.direct_rate.samples(per_pixel)
    };
    let raster_area = world.lens.raster_area;
    let error = |run: &mut Mlt<A, N>, direct: &CameraPass| {
        let (image, errors) = joined(run.sums(), &direct.sums);
        errors.summary(&image)
    };
    let mut done = run.rounds();
    let mut target_met = false;
    loop {
        target_met |= looks.met(done, || error(&mut run, &direct));
        let most = clock.next(done, options.rounds_per_generation as u64);
        let more = looks.until_next(done, most);
        let finished = target_met || more == 0;
        let mut stands = Stands {
            run: &mut run,
            direct: &direct.sums,
            tally: &spent,
            seconds: clock.spent(),
            target_met,
        };
        if !keeper.between(&mut stands, finished) || finished {
            break;
        }
        run.run(more);
        done += more;
        if options.direct == Direct::Separate {
            let until = direct_for(done);
            let what = (Paths::Direct, &gazes);
            add_samples::<N, A>(world, &mut direct, until, what, &mut spent);
        }
        progress.update(clock.fraction(done).max(looks.fraction(done)));
    }
    let stats = run.stats();
    *tally += spent;
    *tally += stats.tally;
    let sums = run.sums();
    *tally += sums.seeding;
    Ok(result(sums, stats, &direct.sums, raster_area, target_met))
}

/// A run between two rounds.
struct Stands<'r, 'w, A: Accel, const N: usize> {
    run: &'r mut Mlt<'w, A, N>,
    direct: &'r CameraSums,
    tally: &'r Tally,
    seconds: f64,
    target_met: bool,
}

impl<A: Accel, const N: usize> Standing for Stands<'_, '_, A, N> {
    fn save(&mut self, w: &mut Writer) -> io::Result<()> {
        let head = (self.tally, self.seconds);
        let area = self.run.world().lens.raster_area;
        save_chains(w, head, |w| self.run.save(w), self.direct, area)
    }

    fn outcome(&mut self) -> Outcome {
        let (stats, met) = (self.run.stats(), self.target_met);
        let area = self.run.world().lens.raster_area;
        let r = result(self.run.sums(), stats, self.direct, area, met);
        Outcome::Mlt(Box::new(r))
    }
}

/// The image that chains and direct pass have made; the raster domain has `area` px².
pub(super) fn result(
    chains: &mut Sums,
    stats: ChainStats,
    direct: &CameraSums,
    area: f64,
    target_met: bool,
) -> MltResult {
    let (image, errors) = joined(chains, direct);
    let spectrum = chains.spectrum().zip(direct.spectrum()).map(|(s, d)| {
        let both = s.iter().zip(d);
        both.map(|(s, d)| *s as f64 + d).collect()
    });
    let (b, se) = chains.brightness();
    MltResult {
        image,
        direct: (direct.samples > 0.0).then(|| direct.image()),
        spectrum,
        rounds: chains.rounds,
        mutations: chains.mutations(),
        direct_samples: direct.samples,
        b: (b / area, se / area),
        stats,
        errors,
        target_met,
    }
}

/// The chains' light and the direct pass's as one image; they are independent, so the variances add up.
fn joined(chains: &mut Sums, direct: &CameraSums) -> (Vec<[f64; 3]>, PixelErrors) {
    let mut errors = PixelErrors {
        variance: chains.variance(),
        freedom: chains.freedom(),
    };
    let mut image = chains.image();
    if direct.samples > 0.0 {
        errors.add(&direct.variance(), direct.freedom());
        for (p, d) in image.iter_mut().zip(direct.image()) {
            for c in 0..3 {
                p[c] += d[c];
            }
        }
    }
    (image, errors)
}
