//! The Markov step: choose a strategy, propose, accept or reject.

use super::{ChainStats, Direct, MltOptions, Sink};
use crate::accel::Accel;
use crate::mutation::{Context, Strategy, Workspace};
use crate::path::{Path, Pool, World};
use crate::sampling::{Entries, Rng};

/// A chain with its current path.
pub struct Chain<const N: usize> {
    /// The current path.
    pub x: Path<N>,
    ws: Workspace<N>,
    rng: Rng,
    entries: Option<Entries>,
    step: u64,
    /// Expected-value weight of x not yet splatted.
    pending: f64,
    stay: u64,
    /// How strategies are chosen at x; `None` when that is yet to be found out.
    choice: Option<Choice>,
    /// Counters.
    pub stats: ChainStats,
}

/// What a chain looks at while it steps.
pub struct Setting<'a, A: Accel> {
    /// The scene.
    pub world: &'a World<'a, A>,
    /// The run's settings.
    pub options: &'a MltOptions,
}

/// The weights with which the strategies are chosen at a path, and their sum: zero where one does not suit.
#[derive(Clone, Copy, Debug)]
struct Choice {
    weights: [f64; Strategy::ALL.len()],
    total: f64,
}

impl Choice {
    /// Which strategy, for a uniform `u` in [0, 1).
    #[inline]
    fn pick(&self, u: f64) -> usize {
        let mut r = u * self.total;
        let mut chosen = 0;
        for (i, w) in self.weights.iter().enumerate() {
            if *w > 0.0 {
                chosen = i;
                if r < *w {
                    break;
                }
                r -= w;
            }
        }
        chosen
    }

    /// Probability of a strategy.
    #[inline]
    fn probability(&self, strategy: usize) -> f64 {
        self.weights[strategy] / self.total
    }
}

#[inline]
fn choice<const N: usize, A: Accel>(set: &Setting<A>, x: &Path<N>, pool: &Pool<N>) -> Choice {
    let mut w = set.options.shares.0;
    for (w, s) in w.iter_mut().zip(Strategy::ALL) {
        if *w > 0.0 && !s.suits(set.world.dispersive, x, pool) {
            *w = 0.0;
        }
    }
    Choice {
        weights: w,
        total: w.iter().sum(),
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
            choice: None,
            stats: ChainStats::default(),
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
        self.choice = None;
    }

    /// Vertices of the current path.
    pub fn pool(&self) -> &Pool<N> {
        &self.ws.pool
    }

    /// One step. `sink` receives what the step gives the image.
    #[inline]
    pub fn step<A: Accel>(&mut self, set: &Setting<A>, sink: &mut impl Sink<N>) {
        self.rng.set_step(self.step);
        self.step += 1;
        let (x, pool) = (&self.x, &self.ws.pool);
        let at_x = *self.choice.get_or_insert_with(|| choice(set, x, pool));
        let mut accepted = false;
        let mut a = 0.0;
        if at_x.total > 0.0 {
            let chosen = at_x.pick(self.rng.next_f64());
            let strategy = Strategy::ALL[chosen];
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
            let ratio = strategy.propose(&mut self.x, &mut self.ws, &mut ctx);
            if let Some(ratio) = ratio {
                self.stats.strategies[chosen].constructed += 1;
                let at_y = choice(set, &self.ws.y, &self.ws.pool);
                let ratio = ratio * at_y.probability(chosen) / at_x.probability(chosen);
                if self.stats.tally.check(ratio) {
                    a = ratio.min(1.0);
                }
                accepted = self.rng.next_f64() < a;
                if set.options.expected_values {
                    self.pending += 1.0 - a;
                    if accepted {
                        self.flush(sink);
                        self.pending = a;
                    } else if a > 0.0 {
                        sink.splat(&self.ws.y, a);
                    }
                } else {
                    if accepted {
                        self.flush(sink);
                    }
                    self.pending += 1.0;
                }
                if accepted {
                    self.stats.strategies[chosen].accepted += 1;
                    self.ws.accept(&mut self.x);
                    self.choice = Some(at_y);
                }
            } else {
                self.pending += 1.0;
            }
            if !accepted {
                self.ws.reject();
            }
        } else {
            self.pending += 1.0;
        }
        if accepted {
            self.stay = 0;
        } else {
            self.stay += 1;
            self.stats.longest_stay = self.stats.longest_stay.max(self.stay);
        }
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
