//! Markov chains: seeding, the step, blocks and their schedule.

mod again;
mod choice;
mod direct_rate;
mod markov;
mod options;
mod pilot;
mod quantities;
mod schedule;
mod seeding;
mod sink;
mod specimen;
mod state;
mod state_path;
mod stats;
mod sums;
mod test_image;
#[cfg(test)]
mod tests;
mod verify;

pub use again::{Given, Seen, Which, Witness, chain_again, step_seen};
pub use direct_rate::DirectRate;
pub use markov::{Chain, Setting, Turn};
pub use options::{Direct, MltOptions, Shares};
pub use pilot::Pilot;
pub use quantities::{KINDS, Kind};
pub use schedule::{Mlt, start_chain};
pub use seeding::{Batch, Seed, replay, seed_group};
pub use sink::{Sink, Splat};
pub use specimen::{Found, Specimens, WIDTH, keep};
pub use state::Saved;
pub use stats::{ChainStats, StrategyStats, read_tally, save_tally};
pub use sums::{Shape, Sums};
pub use test_image::TestImage;
pub use verify::{Deviations, verify};

/// Names of the random streams: one for each use, so that none ever overlap.
pub mod stage {
    /// Seeding samples.
    pub const SEEDING: u32 = 1;
    /// Offsets of the systematic resampling.
    pub const RESAMPLING: u32 = 2;
    /// Steps of the chains.
    pub const CHAIN: u32 = 3;
    /// Camera samples: path tracing, bidirectional path tracing.
    pub const CAMERA: u32 = 4;
    /// The direct-lighting pass.
    pub const DIRECT: u32 = 5;
    /// Entries of lens sub-paths.
    pub const ENTRIES: u32 = 6;
    /// The look at a scene before it is rendered.
    pub const PROBE: u32 = 7;
    /// What camera rays hit first.
    pub const LAYERS: u32 = 8;
}
