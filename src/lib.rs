//! metrolux: Metropolis light transport in path space, with spectra, on Embree.
//!
//! Data flows one way through the rooms:
//! scene → plan → accel → scatter → path → mutation → chain → film → output.
//! `cli` and `study` stand beside the line and may look at all of it.
#![warn(missing_docs)]
#![deny(unsafe_code)]
// Casts that are needed in f32.
#![cfg_attr(
    feature = "double",
    allow(clippy::unnecessary_cast, clippy::useless_conversion)
)]

pub mod accel;
pub mod chain;
pub mod cli;
pub mod film;
pub mod integrator;
pub mod mutation;
pub mod output;
pub mod path;
pub mod plan;
pub mod real;
pub mod sampling;
pub mod scatter;
pub mod scene;
pub mod study;
