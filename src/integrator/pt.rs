//! Path tracing.

use super::camera_pass::{CameraPass, lens_vertex};
use super::target::Looks;
use super::{Budget, Clock, FIRST_LOOK, Paths, Progress, Rendered, Stop, radiance};
use crate::accel::Accel;
use crate::chain::stage;
use crate::film::{Bins, PixelErrors};
use crate::path::{Palette, Tally, World};
use crate::scene::spectrum::Lanes;
use std::sync::Mutex;

/// Renders by path tracing. Returns XYZ of each pixel of the crop and the samples a pixel.
pub fn pt<const N: usize, A: Accel>(
    world: &World<A>,
    budget: Budget,
    seed: u64,
    progress: &dyn Progress,
    tally: &mut Tally,
) -> (Vec<[f64; 3]>, u64) {
    let r = pt_bins::<N, A>(world, None, budget, seed, progress, tally);
    (r.image, r.samples)
}

/// As [`pt`], with spectral bins.
pub fn pt_bins<const N: usize, A: Accel>(
    world: &World<A>,
    bins: Option<Bins>,
    stop: impl Into<Stop>,
    seed: u64,
    progress: &dyn Progress,
    tally: &mut Tally,
) -> Rendered {
    let mut pass = CameraPass::new(world, bins, stage::CAMERA, seed);
    let stop = stop.into();
    let clock = Clock::new(stop.budget, |n| n.ceil().max(1.0) as u64);
    let mut looks = Looks::new(stop.target_error, FIRST_LOOK);
    let errors = |pass: &CameraPass| PixelErrors {
        variance: pass.variance(),
        freedom: (pass.samples as u64).saturating_sub(1).max(1),
    };
    let mut target_met = false;
    while !target_met {
        let done = pass.samples as u64;
        let more = looks.until_next(done, clock.next(done, 16));
        if more == 0 {
            break;
        }
        let until = pass.samples + more as f64;
        add_samples::<N, A>(world, &mut pass, until, Paths::All, tally);
        let done = pass.samples as u64;
        target_met = looks.met(done, || errors(&pass).summary(&pass.image()));
        progress.update(clock.fraction(done).max(looks.fraction(done)));
    }
    Rendered {
        errors: errors(&pass),
        target_met,
        image: pass.image(),
        spectrum: pass.spectrum(),
        samples: pass.samples as u64,
    }
}

/// Adds path-traced samples to a pass until there are `until` a pixel, in the mean.
pub fn add_samples<const N: usize, A: Accel>(
    world: &World<A>,
    pass: &mut CameraPass,
    until: f64,
    paths: Paths,
    tally: &mut Tally,
) {
    let total = Mutex::new(Tally::default());
    pass.run::<N, (Tally, Palette<N>)>(
        until,
        || (Tally::default(), Palette::new(Lanes::new(0.0))),
        |(tally, palette), s, rng, sum| {
            palette.tune(&s.lanes);
            let lens = lens_vertex(world, rng);
            let w = world.lens.direction(lens.p, s.raster);
            let mut faults = Tally::default();
            radiance(world, palette, &lens, w, paths, rng, tally, |_, c| {
                sum.add(c, &s.lanes, &mut faults);
            });
            *tally += faults;
        },
        |(t, _)| *total.lock().expect("no thread panicked") += t,
    );
    *tally += *total.lock().expect("no thread panicked");
}
