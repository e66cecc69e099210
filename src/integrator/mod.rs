//! The integrators, each thin: it says which rooms it walks through.

mod bdpt;
mod camera_error;
mod camera_pass;
mod dither;
mod mlt;
mod progress;
mod pt;
mod radiance;
mod target;
mod test_image;

pub use bdpt::{Bdpt, bdpt, bdpt_bins};
pub use camera_pass::{CameraPass, Gathered};
pub use mlt::{MltResult, mlt};
pub use progress::{Budget, Clock, Progress, Quiet};
pub use pt::{pt, pt_bins};
pub use radiance::{Paths, radiance};
pub use target::Stop;
pub use test_image::test_image;

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
const FIRST_LOOK: u64 = 16;
