//! The loop that path tracing and bidirectional path tracing share: a sample a pixel after the other, looks at the error
//! and a keeper's questions between them.

use super::state::{Kind, save_sampled};
use super::target::Looks;
use super::{CameraPass, Clock, FIRST_LOOK, Keeper, LightSums, Outcome, Progress, Rendered};
use super::{Standing, Stop, sampled};
use crate::accel::Accel;
use crate::chain::stage;
use crate::film::{Bins, Crop, Malformed, Writer};
use crate::path::{Tally, World};
use std::io;

/// What is sampled.
pub struct Sampling<'a, A: Accel> {
    /// The scene.
    pub world: &'a World<'a, A>,
    /// Spectral bins to fill.
    pub bins: Option<Bins>,
    /// When to stop.
    pub stop: Stop,
    /// Seed of the random streams.
    pub seed: u64,
}

impl<A: Accel> Clone for Sampling<'_, A> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<A: Accel> Copy for Sampling<'_, A> {}

/// A run between two samples.
struct Stands<'a> {
    pass: &'a CameraPass,
    light: Option<&'a mut LightSums>,
    gather: &'a dyn Fn(&mut LightSums),
    tally: &'a Tally,
    seconds: f64,
    target_met: bool,
}

impl Standing for Stands<'_> {
    fn save(&mut self, w: &mut Writer) -> io::Result<()> {
        self.light.as_deref_mut().into_iter().for_each(self.gather);
        let head = (self.tally, self.seconds);
        save_sampled(w, head, &self.pass.sums, self.light.as_deref())
    }

    fn outcome(&mut self) -> Outcome {
        self.light.as_deref_mut().into_iter().for_each(self.gather);
        let light = self.light.as_deref();
        Outcome::Sampled(sampled(&self.pass.sums, light, self.target_met))
    }
}

/// Takes samples of a pass until there are so many a pixel.
pub(super) type Add<'a> = &'a dyn Fn(&mut CameraPass, f64, &mut Tally);
/// Adds what all threads have splatted since it was last called.
pub(super) type Gather<'a> = &'a dyn Fn(&mut LightSums);

/// Samples until it is time to stop; with `gather` if some of the samples' light goes to other pixels.
pub(super) fn sample<A: Accel>(
    what: Sampling<A>,
    add: Add,
    gather: Option<Gather>,
    progress: &dyn Progress,
    tally: &mut Tally,
    keeper: &mut dyn Keeper,
) -> Result<Rendered, Malformed> {
    let Sampling {
        world,
        bins,
        stop,
        seed,
    } = what;
    let shards = keeper.shards();
    let mut pass = CameraPass::new(world, bins, stage::CAMERA, seed).with_shards(shards);
    let mut light = gather.map(|_| LightSums::new(Crop::from(world.scene.camera.crop), bins));
    let gather = gather.unwrap_or(&|_| ());
    let mut clock =
        Clock::new(stop.budget, |n| n.ceil().max(1.0) as u64).with_patience(keeper.patience());
    let mut looks = Looks::new(stop.target_error, FIRST_LOOK);
    let mut spent = Tally::default();
    if let Some(state) = keeper.begin() {
        let (camera, splats) = match state.sums {
            Kind::Sampled(camera, splats) if splats.is_some() == light.is_some() => {
                (camera, splats)
            }
            _ => return Err(Malformed::new("is of another integrator")),
        };
        pass.resume(camera)?;
        light = splats;
        spent = state.tally;
        clock = clock.after(pass.sums.samples as u64, state.seconds);
        looks = looks.after(pass.sums.samples as u64);
    }
    let image = |pass: &CameraPass, light: &mut Option<LightSums>, met| {
        light.iter_mut().for_each(gather);
        sampled(&pass.sums, light.as_ref(), met)
    };
    let mut done = pass.sums.samples as u64;
    clock.check(done)?;
    let mut target_met = false;
    loop {
        target_met |= looks.met(done, || {
            let r = image(&pass, &mut light, false);
            r.errors.summary(&r.image)
        });
        let more = looks.until_next(done, clock.next(done, 16));
        let finished = target_met || more == 0;
        let mut stands = Stands {
            pass: &pass,
            light: light.as_mut(),
            gather,
            tally: &spent,
            seconds: clock.spent(),
            target_met,
        };
        if !keeper.between(&mut stands, finished) || finished {
            break;
        }
        add(&mut pass, (done + more) as f64, &mut spent);
        done += more;
        progress.update(clock.fraction(done).max(looks.fraction(done)));
    }
    *tally += spent;
    Ok(image(&pass, &mut light, target_met))
}
