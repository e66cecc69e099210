//! Spectra: lanes of wavelengths, curves over wavelength, RGB upsampling, the CIE observer.

mod curve;
mod lanes;
mod named;
mod rgb;

pub use curve::Curve;
pub use lanes::{Lanes, Spectrum};
pub use named::{blackbody, d65, from_samples, luminance, named};
pub use rgb::{Rgb2Spec, Sigmoid};

/// First wavelength of the simulation, nm.
pub const LAMBDA_MIN: f32 = 360.0;
/// Last wavelength of the simulation, nm.
pub const LAMBDA_MAX: f32 = 830.0;
