//! The integrators, each thin: it says which rooms it walks through.

mod bdpt;
mod camera_pass;
mod mlt;
mod progress;
mod pt;
mod radiance;

pub use bdpt::{Bdpt, bdpt};
pub use camera_pass::CameraPass;
pub use mlt::{MltResult, mlt};
pub use progress::{Budget, Clock, Progress, Quiet};
pub use pt::pt;
pub use radiance::{Paths, radiance};
