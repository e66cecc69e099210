//! The integrators, each thin: it says which rooms it walks through.

mod bdpt;
mod camera_error;
mod camera_pass;
mod camera_sums;
mod dither;
mod first_hit;
mod gaze;
mod keeper;
mod light_sums;
mod mlt;
mod pixel_sums;
mod probe;
mod probe_tiles;
mod progress;
mod pt;
mod radiance;
mod sample;
mod state;
mod target;
mod test_image;

pub use bdpt::{Bdpt, bdpt, bdpt_bins, bdpt_kept};
pub use camera_pass::{CameraPass, Gathered};
pub use camera_sums::CameraSums;
pub use first_hit::{FirstHit, first_hit};
pub use keeper::{Keeper, Nobody, Outcome, Standing};
pub use light_sums::LightSums;
pub use mlt::{MltResult, mlt, mlt_kept};
pub use probe::Probe;
pub use progress::{Budget, Clock, Progress, Quiet};
pub use pt::{pt, pt_bins, pt_kept};
pub use radiance::{Paths, radiance};
pub use sample::Sampling;
pub use state::State;
pub use target::Stop;
pub use test_image::test_image;

use light_sums::sampled;

use crate::film::PixelErrors;

/// What a sampling integrator gave.
pub struct Rendered {
    /// XYZ of each pixel of the crop.
    pub image: Vec<[f64; 3]>,
    /// Radiance per nm, `[pixel · bins + bin]`, if bins were asked for.
    pub spectrum: Option<Vec<f64>>,
    /// Samples a pixel.
    pub samples: u64,
    /// Error of each pixel.
    pub errors: PixelErrors,
    /// The target error was met at a look.
    pub target_met: bool,
}

/// Samples a pixel at which pt and bdpt first look at their error: with fewer its own estimate is worth little.
pub const FIRST_LOOK: u64 = 16;
