//! The Markov step: choose a strategy, propose, accept or reject.

use super::choice::{Choices, Suited};
use super::{ChainStats, Direct, MltOptions, Sink, TestImage};
use crate::accel::Accel;
use crate::mutation::{Context, Strategy, Workspace};
use crate::path::{Ends, Path, Pool, Site, World};
use crate::real::Vec2;
use crate::sampling::{Entries, Rng};

/// A chain with its current path.
pub struct Chain<const N: usize> {
    /// The current path.
    pub x: Path<N>,
    pub(super) ws: Workspace<N>,
    rng: Rng,
    pub(super) entries: Option<Entries>,
    pub(super) step: u64,
    /// Expected-value weight of x not yet splatted, times I0.
    pub(super) pending: f64,
    pub(super) stay: u64,
    /// The strategies that suit x; `None` when that is yet to be found out.
    pub(super) suited: Option<Suited>,
    /// Counters.
    pub stats: ChainStats,
    /// Generation, group, and number in the group, to tell where a fault was met.
    pub id: [u32; 3],
    /// Rejections in a row of each strategy's proposals.
    pub(super) runs: [u64; Strategy::ALL.len()],
    /// Impossible values met before this step.
    faults: u64,
}

/// What a step decided.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    /// The strategy that was chosen; none suits the current path x otherwise.
    pub strategy: Option<Strategy>,
    /// T(y→x)·τ(y) / (T(x→y)·τ(x)) without the choice of the strategy; `None` if no path y was made.
    pub ratio: Option<f64>,
    /// Sum of the shares of the strategies that suit x.
    pub there: f64,
    /// 1 over that of y; 0 if the strategy does not suit y.
    pub back: f64,
    /// I0 at x.
    pub stay: f64,
    /// I0 at y.
    pub go: f64,
    /// Probability of the move.
    pub a: f64,
    /// The chain moves.
    pub accepted: bool,
    at_y: Suited,
}

/// What a chain looks at while it steps.
pub struct Setting<'a, A: Accel> {
    /// The scene.
    pub world: &'a World<'a, A>,
    /// The run's settings.
    pub options: &'a MltOptions,
    /// I0 by which the target is divided; 1 everywhere without it.
    pub test_image: Option<&'a TestImage>,
    choices: Choices,
}

impl<'a, A: Accel> Setting<'a, A> {
    /// Without a test image.
    pub fn new(world: &'a World<'a, A>, options: &'a MltOptions) -> Self {
        Self {
            world,
            options,
            test_image: None,
            choices: Choices::new(&options.shares),
        }
    }

    /// With this test image, if there is one.
    pub fn with_test_image(mut self, i0: Option<&'a TestImage>) -> Self {
        self.test_image = i0;
        self
    }

    /// I0 at a raster point.
    #[inline]
    pub fn i0(&self, raster: Vec2) -> f64 {
        self.test_image.map_or(1.0, |i| i.at(raster))
    }
}

impl<const N: usize> Chain<N> {
    /// An idle chain with room for the world's longest paths. `rng` is the chain's own stream.
    pub fn new(max_edges: usize, rng: Rng) -> Self {
        let ws: Workspace<N> = Workspace::new(max_edges);
        let x = ws.y.clone_capacity(max_edges);
        Self {
            x,
            ws,
            rng,
            entries: None,
            step: 0,
            pending: 0.0,
            stay: 0,
            suited: None,
            stats: ChainStats::default(),
            id: [0; 3],
            runs: [0; Strategy::ALL.len()],
            faults: 0,
        }
    }

    /// From now on lens sub-paths start at these entries, which the chain shares with its group.
    pub fn stratify(&mut self, entries: Entries) {
        self.entries = Some(entries);
    }

    /// Starts at a copy of a path.
    pub fn start(&mut self, path: &Path<N>, pool: &Pool<N>) {
        self.ws.pool.reset();
        self.x.clear();
        self.x.copy_from(path);
        for link in &mut self.x.links {
            link.slot = self.ws.pool.put(*pool.get(link.slot));
        }
        self.pending = 0.0;
        self.stay = 0;
        self.suited = None;
    }

    /// Vertices of the current path.
    pub fn pool(&self) -> &Pool<N> {
        &self.ws.pool
    }

    /// One step. `sink` receives what the step gives the image.
    #[inline]
    pub fn step<A: Accel>(&mut self, set: &Setting<A>, sink: &mut impl Sink<N>) {
        let turn = self.turn(set);
        self.settle(set, &turn, sink);
    }

    /// The first half of a step: a proposal, which then stands in [`Self::proposal`], and the decision on it.
    #[inline(always)]
    pub fn turn<A: Accel>(&mut self, set: &Setting<A>) -> Turn {
        self.rng.set_step(self.step);
        self.step += 1;
        let (x, pool) = (&self.x, &self.ws.pool);
        let at_x = *self.suited.get_or_insert_with(|| Suited::to(set, x, pool));
        let choice = set.choices.among(at_x);
        // Splats are f/τ, and the chain visits a path in proportion to τ/I0.
        let stay = set.i0(self.x.raster);
        let mut turn = Turn {
            strategy: None,
            ratio: None,
            there: choice.total,
            back: 0.0,
            stay,
            go: stay,
            a: 0.0,
            accepted: false,
            at_y: at_x,
        };
        if at_x.is_empty() {
            return turn;
        }
        let chosen = choice.pick(self.rng.next_f64());
        let strategy = Strategy::ALL[chosen];
        turn.strategy = Some(strategy);
        self.stats.strategies[chosen].proposed += 1;
        self.ws.begin(&self.x);
        let mut ctx = Context {
            world: set.world,
            rng: &mut self.rng,
            entries: self.entries.as_mut(),
            tally: &mut self.stats.tally,
            indirect_only: set.options.direct == Direct::Separate,
            weigh_deletions: set.options.weigh_deletions,
        };
        turn.ratio = strategy.propose(&mut self.x, &mut self.ws, &mut ctx);
        if let Some(ratio) = turn.ratio {
            self.stats.strategies[chosen].constructed += 1;
            turn.at_y = Suited::to(set, &self.ws.y, &self.ws.pool);
            // No way back where the strategy does not suit y.
            turn.back = turn.at_y.has(chosen) * set.choices.among(turn.at_y).inverse;
            turn.go = set.i0(self.ws.y.raster);
            let ratio = ratio * turn.there * turn.back * (stay / turn.go);
            if self.stats.tally.check(ratio) {
                turn.a = ratio.min(1.0);
            }
            turn.accepted = self.rng.next_f64() < turn.a;
        }
        turn
    }

    /// The second half of a step: what it gives the image, and the move.
    #[inline(always)]
    pub fn settle<A: Accel>(&mut self, set: &Setting<A>, turn: &Turn, sink: &mut impl Sink<N>) {
        let Turn {
            a,
            accepted,
            stay,
            go,
            ..
        } = *turn;
        if let Some(strategy) = turn.strategy {
            let chosen = strategy as usize;
            if turn.ratio.is_some() {
                if set.options.expected_values {
                    self.pending += (1.0 - a) * stay;
                    if accepted {
                        self.flush(sink);
                        self.pending = a * go;
                    } else if a > 0.0 {
                        sink.splat(&self.ws.y, a * go);
                    }
                } else {
                    if accepted {
                        self.flush(sink);
                    }
                    self.pending += if accepted { go } else { stay };
                }
            } else {
                self.pending += stay;
            }
            if accepted {
                self.stats.strategies[chosen].accepted += 1;
                self.ws.accept(&mut self.x);
                self.suited = Some(turn.at_y);
                self.runs[chosen] = 0;
            } else {
                self.ws.reject();
                self.runs[chosen] += 1;
                let longest = &mut self.stats.strategies[chosen].longest_run;
                *longest = (*longest).max(self.runs[chosen]);
            }
        } else {
            self.pending += stay;
        }
        if accepted {
            self.stay = 0;
        } else {
            self.stay += 1;
            self.stats.longest_stay = self.stats.longest_stay.max(self.stay);
        }
        if self.stats.tally.impossible() != self.faults {
            self.note(set.world, self.step - 1, 1);
        }
    }

    /// Remembers that an impossible value was met in `steps` steps from `step` on.
    #[cold]
    #[inline(never)]
    pub(super) fn note<A: Accel>(&mut self, world: &World<A>, step: u64, steps: u64) {
        self.faults = self.stats.tally.impossible();
        let [generation, group, chain] = self.id;
        world.sites.note(Site::Step {
            generation,
            group,
            chain,
            step,
            steps,
        });
    }

    /// The last proposal, while it is not settled.
    pub fn proposal(&self) -> &Path<N> {
        &self.ws.y
    }

    /// Which ends of the current path the last proposal keeps, while it is not settled.
    pub fn kept(&self) -> Ends {
        self.ws.ends
    }

    /// Steps made.
    pub fn steps(&self) -> u64 {
        self.step
    }

    /// Splats the current path's pending weight; at the end of a round.
    #[inline]
    pub fn flush(&mut self, sink: &mut impl Sink<N>) {
        if self.pending > 0.0 {
            sink.splat(&self.x, self.pending);
            self.pending = 0.0;
        }
    }
}
