//! A pilot that fixes the shares of the strategies before step 0: short chains from streams of their own, whose image is
//! thrown away. It is a fixed number of steps, so the shares depend on scene, settings and seed alone, and every shard
//! finds the same.
//!
//! The error of an image falls by what moves in it. A strategy's worth is the probability that its proposal is accepted
//! and lies in another pixel; the time of a proposal is much the same for all of them. Shares go by worth, above floors:
//! what a strategy does for the rest of the path shows in no pixel, and a pilot misses the paths that are hardest to find.

use super::{Chain, MltOptions, Setting, Shares, Splat, Which, seed_group, start_chain};
use crate::accel::Accel;
use crate::mutation::Strategy;
use crate::path::{Sampler, Tally, World};
use rayon::prelude::*;
use serde::{Serialize, Serializer};
use std::ops::AddAssign;

/// Groups, chains of each, seeding samples of each, steps of a chain: 8192 mutations.
const GROUPS: u32 = 16;
const CHAINS: u32 = 16;
const SEEDS: u32 = 256;
const STEPS: u32 = 32;

/// Number of the pilot's generation, for its streams: one that no run comes to.
const GENERATION: u32 = 1 << 27;

/// Least share of the bidirectional mutation: it alone changes everything. See the table in docs/plan.md.
const BIDIRECTIONAL: f64 = 0.17;

/// Least share of every other strategy that the plan gives one.
const FLOOR: f64 = 0.03;

/// What a pilot saw of each strategy, in the order of [`Strategy::ALL`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pilot {
    /// Times it was chosen.
    pub proposed: [u64; Strategy::ALL.len()],
    /// Sum of the acceptance probabilities of those of its proposals that lie in another pixel.
    pub moved: [f64; Strategy::ALL.len()],
}

impl Pilot {
    /// Runs the pilot of a run with these options, with equal shares of those strategies that have one; rays and faults
    /// go into `tally`.
    pub fn new<const N: usize, A: Accel>(
        world: &World<A>,
        options: &MltOptions,
        seed: u64,
        tally: &mut Tally,
    ) -> Self {
        let options = MltOptions {
            groups: GROUPS,
            chains: CHAINS,
            seeds: SEEDS,
            shares: options.shares.leveled(),
            test_samples: None,
            bins: None,
            ..*options
        };
        let groups: Vec<_> = (0..GROUPS)
            .into_par_iter()
            .map(|group| Self::of_group::<N, A>(world, &options, seed, group))
            .collect();
        let mut all = Self::default();
        // In the order of the groups, so that the sums have the same bits for any number of threads.
        for (pilot, t) in groups {
            all += pilot;
            *tally += t;
        }
        all
    }

    fn of_group<const N: usize, A: Accel>(
        world: &World<A>,
        options: &MltOptions,
        seed: u64,
        group: u32,
    ) -> (Self, Tally) {
        let set = Setting::new(world, options);
        let mut tally = Tally::default();
        let mut pilot = Self::default();
        let batch = seed_group::<N, A>(&set, seed, GENERATION, group, &mut tally);
        let mut sampler = Sampler::new(world.max_edges);
        for (start, chain) in batch.seeds.iter().zip(0..) {
            let which = Which {
                seed,
                generation: GENERATION,
                group,
                chain,
            };
            let chain: Option<Chain<N>> =
                start_chain(&set, which, *start, &mut sampler, &mut tally);
            let Some(mut chain) = chain else {
                continue;
            };
            for _ in 0..STEPS {
                let turn = chain.turn(&set);
                if let Some(s) = turn.strategy {
                    pilot.proposed[s as usize] += 1;
                    let pixel = chain.x.raster.floor();
                    if turn.a > 0.0 && chain.proposal().raster.floor() != pixel {
                        pilot.moved[s as usize] += turn.a;
                    }
                }
                chain.settle(&set, &turn, &mut |_: Splat| {});
            }
            tally += chain.stats.tally;
        }
        (pilot, tally)
    }

    /// Probability that a proposal of a strategy is accepted and lies in another pixel.
    pub fn worth(&self, s: Strategy) -> f64 {
        self.moved[s as usize] / self.proposed[s as usize].max(1) as f64
    }

    /// The shares of a run: those strategies have one that have one in `planned`. In per cent, so that what depends on
    /// them is the same for machines whose last digits differ.
    pub fn shares(&self, planned: &Shares) -> Shares {
        let mut worth = Strategy::ALL.map(|s| self.worth(s));
        // At one place only colours change, and every path has its own.
        worth[Strategy::Wavelength as usize] = 0.0;
        let floor = Strategy::ALL.map(|s| match s {
            _ if planned.get(s) == 0.0 => 0.0,
            Strategy::Wavelength => planned.get(s),
            Strategy::Bidirectional => BIDIRECTIONAL,
            _ => FLOOR,
        });
        let total: f64 = (0..worth.len())
            .filter(|i| floor[*i] > 0.0)
            .map(|i| worth[i])
            .sum();
        if total <= 0.0 {
            return *planned;
        }
        let rest = 1.0 - floor.iter().sum::<f64>();
        Shares(std::array::from_fn(|i| match floor[i] {
            0.0 => 0.0,
            least => ((least + rest * worth[i] / total) * 100.0).round() / 100.0,
        }))
    }
}

/// The worth of each strategy, by name.
impl Serialize for Pilot {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_map(Strategy::ALL.iter().map(|s| (s.name(), self.worth(*s))))
    }
}

impl AddAssign for Pilot {
    fn add_assign(&mut self, o: Self) {
        for i in 0..Strategy::ALL.len() {
            self.proposed[i] += o.proposed[i];
            self.moved[i] += o.moved[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_go_by_worth_above_their_floors() {
        let planned = Shares([0.35, 0.35, 0.1, 0.0, 0.05, 0.05]);
        let pilot = Pilot {
            proposed: [1000, 1000, 0, 500, 1000, 1000],
            moved: [0.0, 600.0, 0.0, 500.0, 200.0, 10.0],
        };
        let shares = pilot.shares(&planned);
        // 1 − 0.17 − 3 · 0.03 − 0.05 is given out as 3 : 1; what the plan gives no share gets none.
        let expected = [0.17, 0.55, 0.03, 0.0, 0.2, 0.05];
        for (found, expected) in shares.0.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{shares:?}");
        }
        // Nothing moved: in an image of one pixel, or where the chains own no light.
        assert_eq!(Pilot::default().shares(&planned), planned);
    }
}
