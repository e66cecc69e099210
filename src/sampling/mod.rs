//! Random streams, warps from the unit square, and distributions over tables with densities that are exact.

pub mod discrete;
pub mod entries;
pub mod grid;
pub mod net;
pub mod octahedral;
pub mod permutation;
pub mod poisson;
pub mod rng;
pub mod warp;

pub use discrete::Discrete;
pub use entries::{Cells, Entries, ROUND, Table};
pub use grid::Grid2d;
pub use net::{EDGE, Net, Pair, Points, Single};
pub use permutation::Permutation;
pub use rng::Rng;
