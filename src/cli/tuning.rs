//! Switches of Metropolis light transport that nobody needs for a picture: `study` turns them to show what they bring, and
//! `render` takes them, so that each of its points can be made again.

use super::parse::positive;
use crate::chain::{DirectRate, MltOptions};
use crate::study::sums::Sums;
use clap::Args;

/// Hidden options of `render` (mlt).
#[derive(Args, Clone, Debug, Default, PartialEq)]
pub struct Tuning {
    /// Choose what the bidirectional mutation deletes by length alone, without p_d2 (Veach 11.5.4)
    #[arg(long, hide = true)]
    pub plain_deletions: bool,
    /// Splat only the state a chain is in (without Veach 11.5.2)
    #[arg(long, hide = true)]
    pub no_expected_values: bool,
    /// Draw lens sub-paths anywhere on the image plane (without Veach 11.4.4's quota)
    #[arg(long, hide = true)]
    pub no_stratification: bool,
    /// Chains of each of the 16 groups
    #[arg(long, hide = true, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=65536))]
    pub chains: Option<u32>,
    /// Seeding samples of each of the 16 groups
    #[arg(long, hide = true, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    pub seeds: Option<u32>,
    /// Samples a pixel of the direct pass for each mutation a pixel
    #[arg(long, hide = true, value_name = "R", value_parser = positive)]
    pub direct_rate: Option<f64>,
    /// Add up the image in single precision (with --direct chain and --rounds)
    #[arg(long, hide = true, value_enum, requires = "rounds", conflicts_with_all = ["two_stage", "spectral", "target_error"])]
    pub sums: Option<Sums>,
}

impl Tuning {
    /// The options with these switches turned.
    pub fn apply(&self, o: MltOptions) -> MltOptions {
        MltOptions {
            weigh_deletions: o.weigh_deletions && !self.plain_deletions,
            expected_values: o.expected_values && !self.no_expected_values,
            stratify: o.stratify && !self.no_stratification,
            chains: self.chains.unwrap_or(o.chains),
            seeds: self.seeds.unwrap_or(o.seeds),
            direct_rate: self.direct_rate.map_or(o.direct_rate, DirectRate::constant),
            ..o
        }
    }
}
