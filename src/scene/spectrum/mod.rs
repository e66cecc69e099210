//! Spectra: lanes of wavelengths, curves over wavelength, RGB upsampling, the CIE observer.

mod curve;
mod grey;
mod lanes;
mod named;
mod observer;
mod rgb;
mod rgb_table;
mod sources;
mod wavelengths;

pub use curve::Curve;
pub use grey::Grey;
pub use lanes::Spectrum;
pub use named::{d65, named, names};
pub use observer::{
    SRGB, SrgbMatrices, TABLE_LEN, cmf, luminance, photometric, rgb_to_xyz, xyz_of, xyz_of_fn,
    xyz_to_rgb, xyz_to_rgb64,
};
pub use rgb::{Rgb2Spec, Sigmoid};
pub use rgb_table::{build_table, solve_rgb};
pub use sources::{
    blackbody, from_samples, from_samples_extended, rgb_albedo, rgb_illuminant, rgb_unbounded,
};
pub use wavelengths::{BIN_FLOOR, Lanes, TARGET_MIX, Target, visible, visible_cdf};

/// First wavelength of the simulation, nm.
pub const LAMBDA_MIN: crate::real::Real = 360.0;
/// Last wavelength of the simulation, nm.
pub const LAMBDA_MAX: crate::real::Real = 830.0;
