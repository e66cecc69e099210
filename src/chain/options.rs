//! Settings of Metropolis light transport. None of them depends on budget, threads or clock (DESIGN §8).

use super::{DirectRate, stage};
use crate::film::Bins;
use crate::path::Lens;
pub use crate::plan::Shares;
use crate::sampling::{Cells, Entries, Table};

/// Who computes paths LS*E and LDS*E.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Direct {
    /// A separate pass of stratified MIS sampling (Veach 11.5.1).
    Separate,
    /// The chain itself.
    InChain,
}

/// Settings of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MltOptions {
    /// Independent groups G; the standard error is taken between them.
    pub groups: u32,
    /// Chains of a group.
    pub chains: u32,
    /// Seeding samples of a group in each generation.
    pub seeds: u32,
    /// The chains start at the first paths found that carry light, and the image's mean is 1: b stays unknown.
    pub relative: bool,
    /// Steps of a chain in one round.
    pub round: u32,
    /// Rounds of a generation.
    pub rounds_per_generation: u32,
    /// Shares of the strategies.
    pub shares: Shares,
    /// Who computes direct light.
    pub direct: Direct,
    /// Importance-sampled p_d2 (Veach 11.5.4).
    pub weigh_deletions: bool,
    /// Splat both states by their probability (Veach 11.5.2).
    pub expected_values: bool,
    /// Lens sub-paths are stratified over the image plane (Veach 11.4.4).
    pub stratify: bool,
    /// n_e: different chains of a group that get the same lens sub-path; far fewer than its chains.
    pub entry_uses: u32,
    /// Samples a pixel of the test image of two-stage Metropolis (Veach 11.5.3); without it there is one stage.
    pub test_samples: Option<u32>,
    /// Samples of the direct pass.
    pub direct_rate: DirectRate,
    /// Also fill these spectral bins; the world's target must be `Target::Bins`.
    pub bins: Option<Bins>,
}

impl Default for MltOptions {
    fn default() -> Self {
        Self {
            groups: 16,
            chains: 16,
            seeds: 4096,
            relative: false,
            round: 64,
            rounds_per_generation: 2048,
            shares: Shares::default(),
            direct: Direct::Separate,
            weigh_deletions: true,
            expected_values: true,
            stratify: true,
            entry_uses: 2,
            test_samples: None,
            direct_rate: DirectRate::constant(0.125),
            bins: None,
        }
    }
}

impl MltOptions {
    /// Mutations of all chains in one round.
    pub fn mutations_per_round(&self) -> u64 {
        self.groups as u64 * self.chains as u64 * self.round as u64
    }

    /// The entries of chain number `chain` of a group in a generation; none if lens sub-paths are not stratified.
    pub fn entries(
        &self,
        lens: &Lens,
        seed: u64,
        generation: u32,
        group: u32,
        chain: u32,
    ) -> Option<Entries> {
        let table = Table {
            seed,
            stage: stage::ENTRIES,
            group,
            generation,
            chains: self.chains,
            uses: self.entry_uses,
        };
        let cells = Cells::new(lens.lo, lens.hi);
        self.stratify.then(|| Entries::new(table, chain, cells))
    }

    /// Rounds that give at least `per_pixel` mutations for each of `pixels`.
    pub fn rounds_for(&self, per_pixel: f64, pixels: u64) -> u64 {
        ((per_pixel * pixels as f64) / self.mutations_per_round() as f64)
            .ceil()
            .max(1.0) as u64
    }
}
