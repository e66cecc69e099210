//! The test image of two-stage Metropolis: a little bidirectional path tracing of the paths that the chains own.

use super::{Bdpt, Budget, Quiet, bdpt};
use crate::accel::Accel;
use crate::chain::{Direct, MltOptions, TestImage};
use crate::film::Crop;
use crate::path::{Heuristic, Tally, World};
use crate::sampling::rng::mix;

/// Apart from the seeds of images: the test image has streams of its own.
const OWN: u64 = 0x7e57_1337_0b1a_5ed1;

/// I0 if the options ask for it and the image is not black. It depends on scene, options and seed alone, so that shards
/// can make it again.
pub fn test_image<const N: usize, A: Accel>(
    world: &World<A>,
    options: &MltOptions,
    seed: u64,
    tally: &mut Tally,
) -> Option<TestImage> {
    let samples = options.test_samples.filter(|n| *n > 0)?;
    let what = Bdpt {
        heuristic: Heuristic::Power,
        indirect_only: options.direct == Direct::Separate,
    };
    let budget = Budget::Rounds(samples as u64);
    let (image, _) = bdpt::<N, A>(world, what, budget, mix(seed ^ OWN), &Quiet, tally);
    let luminance: Vec<f64> = image.iter().map(|p| p[1]).collect();
    TestImage::new(Crop::from(world.scene.camera.crop), &luminance)
}
