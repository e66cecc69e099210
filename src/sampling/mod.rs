//! Random streams, warps from the unit square, and distributions over tables with densities that are exact.

pub mod discrete;
pub mod grid;
pub mod octahedral;
pub mod rng;
pub mod warp;

pub use discrete::Discrete;
pub use grid::Grid2d;
pub use rng::Rng;
