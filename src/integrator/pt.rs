//! Path tracing.

use super::camera_pass::{CameraPass, lens_vertex, to_xyz};
use super::{Budget, Clock, Paths, Progress, radiance};
use crate::accel::Accel;
use crate::chain::stage;
use crate::path::{Tally, World};
use std::sync::Mutex;

/// Renders by path tracing. Returns XYZ of each pixel of the crop and the samples a pixel.
pub fn pt<const N: usize, A: Accel>(
    world: &World<A>,
    budget: Budget,
    seed: u64,
    progress: &dyn Progress,
    tally: &mut Tally,
) -> (Vec<[f64; 3]>, u64) {
    let mut pass = CameraPass::new(world, stage::CAMERA, seed);
    let clock = Clock::new(budget, |n| n.ceil().max(1.0) as u64);
    loop {
        let more = clock.next(pass.samples, 16);
        if more == 0 {
            break;
        }
        let until = pass.samples + more;
        add_samples::<N, A>(world, &mut pass, until, Paths::All, tally);
        progress.update(clock.fraction(pass.samples));
    }
    let n = pass.samples;
    (pass.image(), n)
}

/// Adds path-traced samples to a pass until each pixel has `until`.
pub fn add_samples<const N: usize, A: Accel>(
    world: &World<A>,
    pass: &mut CameraPass,
    until: u64,
    paths: Paths,
    tally: &mut Tally,
) {
    let total = Mutex::new(Tally::default());
    pass.run::<N, Tally>(
        until,
        Tally::default,
        |tally, s, rng| {
            let lens = lens_vertex(world, rng);
            let w = world.lens.direction(lens.p, s.raster);
            let mut sum = [0.0; 3];
            let mut faults = Tally::default();
            radiance(world, &s.lanes, &lens, w, paths, rng, tally, |_, c| {
                let xyz = to_xyz(c, &s.lanes, &mut faults);
                for i in 0..3 {
                    sum[i] += xyz[i];
                }
            });
            *tally += faults;
            sum
        },
        |t| *total.lock().expect("no thread panicked") += t,
    );
    *tally += *total.lock().expect("no thread panicked");
}
