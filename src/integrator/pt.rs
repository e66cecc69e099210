//! Path tracing.

use super::camera_pass::CameraPass;
use super::gaze::{Gazes, gaze};
use super::keeper::unkept;
use super::sample::{Sampling, sample};
use super::{Budget, Keeper, Nobody, Paths, Progress, Rendered, Stop, radiance};
use crate::accel::Accel;
use crate::film::{Bins, Crop, Malformed};
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
    let what = Sampling {
        world,
        bins,
        stop: stop.into(),
        seed,
    };
    unkept(pt_kept::<N, A>(what, progress, tally, &mut Nobody))
}

/// As [`pt_bins`], with somebody who may stop it and go on with it.
///
/// # Errors
/// A state to go on from that is of another run.
pub fn pt_kept<const N: usize, A: Accel>(
    what: Sampling<A>,
    progress: &dyn Progress,
    tally: &mut Tally,
    keeper: &mut dyn Keeper,
) -> Result<Rendered, Malformed> {
    let add = |pass: &mut CameraPass, until: f64, tally: &mut Tally| {
        let crop = Crop::from(what.world.scene.camera.crop);
        let gazes = Gazes::none(crop);
        add_samples::<N, A>(what.world, pass, until, (Paths::All, &gazes), tally);
    };
    sample(what, &add, None, progress, tally, keeper)
}

/// Adds path-traced samples to a pass until there are `until` a pixel, in the mean. Divided pixels see lamps by gazes.
pub(super) fn add_samples<const N: usize, A: Accel>(
    world: &World<A>,
    pass: &mut CameraPass,
    until: f64,
    (paths, gazes): (Paths, &Gazes),
    tally: &mut Tally,
) {
    let total = Mutex::new(Tally::default());
    pass.run::<N, (Tally, Palette<N>)>(
        until,
        || (Tally::default(), Palette::new(Lanes::new(0.0))),
        |(tally, palette), s, rng, sum| {
            palette.tune(&s.lanes);
            let lens = world.lens.sample_vertex(s.lens());
            let light = Some(s.light());
            let w = world.lens.direction(lens.p, s.raster);
            let mut faults = Tally::default();
            let gazes = gazes.divided(s.pixel);
            radiance(
                world,
                palette,
                &lens,
                w,
                paths,
                light,
                rng,
                tally,
                |edges, c| {
                    if edges > 1 || !gazes {
                        sum.add(c, &s.lanes, &mut faults);
                    }
                },
            );
            if gazes {
                gaze(world, palette, (s, sum), rng, tally, &mut faults);
            }
            if faults.impossible() > 0 {
                world.sites.note(s.site(paths == Paths::Direct));
            }
            *tally += faults;
        },
        |(t, _)| *total.lock().expect("no thread panicked") += t,
    );
    *tally += *total.lock().expect("no thread panicked");
}
