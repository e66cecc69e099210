//! What `replay` and `verify` share: the world of a render, for any number of lanes, on a backend behind a pointer.

use super::CliError;
use super::decide::Decisions;
use super::engine::{Prepared, mlt_options, threads};
use super::render_args::{AccelArg, PrecisionArg, RenderArgs};
use crate::accel::{Accel, Asked, Embree, EmbreeOptions, Obvhs};
use crate::chain::Setting;
use crate::integrator::test_image;
use crate::path::{Tally, World};
use crate::scene::{IntegratorKind, Scene};

/// Work on the chains of a render.
pub trait Work {
    /// What it gives.
    type Out;
    /// Does it with `N` lanes.
    fn run<const N: usize>(self, set: &Setting<Asked>, seed: u64) -> Self::Out;
}

/// The backend that the arguments name.
pub fn backend<'a>(args: &RenderArgs, scene: &'a Scene) -> Result<Box<dyn Accel + 'a>, CliError> {
    Ok(match args.accel {
        AccelArg::Obvhs => Box::new(Obvhs::new(&scene.geometry)),
        AccelArg::Embree | AccelArg::Checked => {
            Box::new(Embree::new(&scene.geometry, embree_options(args))?)
        }
    })
}

/// How the arguments want Embree.
pub fn embree_options(args: &RenderArgs) -> EmbreeOptions {
    EmbreeOptions {
        robust: args.accel_precision == PrecisionArg::Robust,
        ..EmbreeOptions::default()
    }
}

/// Does the work on the chains that `metrolux render` with these arguments runs, on as many threads.
///
/// # Errors
/// An integrator without chains, threads that cannot be started.
pub fn work_on<W: Work<Out: Send> + Send>(
    args: &RenderArgs,
    prepared: &Prepared,
    accel: &dyn Accel,
    work: W,
) -> Result<W::Out, CliError> {
    let job = &prepared.job;
    if job.integrator != IntegratorKind::Mlt {
        return Err(CliError::Usage(format!(
            "only mlt has chains: found --integrator {}, expected mlt",
            format!("{:?}", job.integrator).to_lowercase()
        )));
    }
    Ok(threads(job.threads)?.install(|| match job.plan.lanes {
        1 => lanes::<1, W>(args, prepared, Asked(accel), work),
        4 => lanes::<4, W>(args, prepared, Asked(accel), work),
        8 => lanes::<8, W>(args, prepared, Asked(accel), work),
        _ => lanes::<16, W>(args, prepared, Asked(accel), work),
    }))
}

fn lanes<const N: usize, W: Work>(
    args: &RenderArgs,
    prepared: &Prepared,
    accel: Asked,
    work: W,
) -> W::Out {
    let (scene, job) = (&prepared.scene, &prepared.job);
    let world = World::new(scene, &accel, scene.settings.max_depth)
        .with_target(job.target)
        .with_plan(&job.plan);
    let decisions = Decisions::new::<N, Asked>(args, job, &world, &mut Tally::default());
    let options = mlt_options(args, job, &decisions);
    let i0 = test_image::<N, Asked>(&world, &options, args.seed, &mut Tally::default());
    let set = Setting::new(&world, &options).with_test_image(i0.as_ref());
    work.run::<N>(&set, args.seed)
}
