//! The proof of the mutations (DESIGN §5): one suite for all strategies, on small rooms.
//!
//! A new strategy is one line in [`super::ratio`], and one false density in `falsify.rs` with its line in `flux.rs`.

mod aperture;
mod flux;
mod integral;
mod integral_caustic;
mod integral_chains;
mod integral_dispersion;
mod integral_lens;
mod integral_subpath;
mod scenes;
mod start_up;
mod stats;
mod steps;

use super::ratio;
