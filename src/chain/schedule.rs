//! Generations and rounds: which chains run when, and the sums they fill.
//!
//! The unit of work is (generation, group, chain, round); sums are exact, so the order of the work and the number of
//! threads leave no trace in the image.

use super::markov::{Chain, Setting};
use super::sink::{Buffers, FilmSink};
use super::{
    Batch, ChainStats, MltOptions, Seed, Shape, Sums, TestImage, Which, replay, seed_group, stage,
};
use crate::accel::Accel;
use crate::film::{Crop, Filter, Reserve, Shards};
use crate::path::{Sampler, Tally, World};
use crate::sampling::Rng;
use crate::scene::spectrum::Target;
use rayon::prelude::*;

/// The chains of one generation.
pub(super) struct Generation<const N: usize> {
    /// Number of the generation.
    pub(super) index: u32,
    /// Integral of each group's target in this generation; NaN where no chain of the group runs here.
    pub(super) targets: Vec<f64>,
    /// Chains, group by group; groups without light have none.
    pub(super) chains: Vec<Member<N>>,
    /// Rounds made.
    pub(super) rounds: u64,
}

/// A chain of a group.
pub(super) struct Member<const N: usize> {
    pub(super) chain: Chain<N>,
    pub(super) group: u32,
    /// Its number in the group.
    pub(super) number: u32,
    /// Integral of the group's target in this generation.
    pub(super) b: f64,
}

/// A group's seeding: its batch, its chains, rays and faults.
type Seeded<const N: usize> = (Option<Batch>, Vec<Member<N>>, Tally);

/// A run of Metropolis light transport that can go on for any number of rounds.
pub struct Mlt<'a, A: Accel, const N: usize> {
    pub(super) world: &'a World<'a, A>,
    pub(super) options: MltOptions,
    pub(super) test_image: Option<TestImage>,
    pub(super) seed: u64,
    filter: Filter,
    pub(super) sums: Sums,
    idle: Reserve<Buffers>,
    pub(super) generation: Option<Generation<N>>,
}

impl<'a, A: Accel, const N: usize> Mlt<'a, A, N> {
    /// A run that has done nothing yet.
    pub fn new(world: &'a World<'a, A>, options: MltOptions, seed: u64) -> Self {
        // Without the floor a bin that the eye does not see would get splats of any size.
        assert!(
            options.bins.is_none() || world.target == Target::Bins,
            "spectral bins need their target"
        );
        let shape = Shape::new(Crop::from(world.scene.camera.crop), &options);
        Self {
            world,
            options,
            test_image: None,
            seed,
            filter: Filter::new(&world.scene.settings.filter),
            sums: Sums::new(shape, Shards::default()),
            idle: Reserve::new(),
            generation: None,
        }
    }

    /// Only the chains of some parts of the work; before the first round.
    pub fn with_shards(mut self, shards: Shards) -> Self {
        assert!(self.generation.is_none(), "chains have begun");
        self.sums.shards = shards;
        self
    }

    /// The same with a target divided by I0; before the first round.
    pub fn with_test_image(mut self, test_image: Option<TestImage>) -> Self {
        assert!(self.generation.is_none(), "I0 is fixed before seeding");
        self.test_image = test_image;
        self
    }

    /// Makes `rounds` more rounds, starting generations as they fall due.
    pub fn run(&mut self, mut rounds: u64) {
        while rounds > 0 {
            if self
                .generation
                .as_ref()
                .is_none_or(|g| g.rounds >= self.options.rounds_per_generation as u64)
            {
                self.begin_generation();
            }
            let g = self.generation.as_mut().expect("just begun");
            let now = rounds.min(self.options.rounds_per_generation as u64 - g.rounds);
            let set =
                Setting::new(self.world, &self.options).with_test_image(self.test_image.as_ref());
            let (idle, filter) = (&self.idle, &self.filter);
            let Sums {
                shape,
                film,
                groups,
                unit,
                ..
            } = &self.sums;
            let crop = shape.crop;
            g.chains.par_iter_mut().for_each(
                |Member {
                     chain, group, b, ..
                 }| {
                    let mut buffers = idle.take_fitting(
                        |idle| idle.serve(*group),
                        || Buffers::new(crop, filter, set.options.bins),
                    );
                    buffers.turn_to(*group, groups);
                    let mut sink = FilmSink::new(buffers, (*b / unit) as f32);
                    let first = chain.steps();
                    for _ in 0..now {
                        for _ in 0..set.options.round {
                            chain.step(&set, &mut sink);
                        }
                        chain.flush(&mut sink);
                        if sink.buffers().is_full() {
                            sink.buffers().settle(groups);
                            film.lock()
                                .expect("no thread panicked")
                                .absorb(sink.buffers());
                        }
                    }
                    let (buffers, faults) = sink.finish();
                    chain.stats.tally += faults;
                    if faults.impossible() > 0 {
                        chain.note(set.world, first, chain.steps() - first);
                    }
                    idle.put(buffers);
                },
            );
            g.rounds += now;
            self.sums.rounds += now;
            rounds -= now;
        }
    }

    fn begin_generation(&mut self) {
        let index = self.sums.b.len() as u32;
        if let Some(g) = self.generation.take() {
            g.chains
                .iter()
                .for_each(|m| self.sums.stats += m.chain.stats);
        }
        let (world, options, seed, sums) = (self.world, &self.options, self.seed, &self.sums);
        let set = Setting::new(world, options).with_test_image(self.test_image.as_ref());
        let seeded: Vec<Seeded<N>> = (0..options.groups)
            .into_par_iter()
            .map(|group| {
                let mut tally = Tally::default();
                let here = |c: u32| sums.has(group, c);
                // The unit of the film comes of the first generation of all groups.
                if index > 0 && !(0..options.chains).any(here) {
                    return (None, Vec::new(), tally);
                }
                let batch = seed_group::<N, A>(&set, seed, index, group, &mut tally);
                let mut sampler = Sampler::new(world.max_edges);
                let chains = batch
                    .seeds
                    .iter()
                    .zip(0..)
                    .filter(|(_, c)| here(*c))
                    .filter_map(|(s, c)| {
                        let which = Which {
                            seed,
                            generation: index,
                            group,
                            chain: c,
                        };
                        let chain = start_chain(&set, which, *s, &mut sampler, &mut tally);
                        if chain.is_none() {
                            tally.fault(crate::path::Fault::ZeroDensity);
                        }
                        Some(Member {
                            chain: chain?,
                            group,
                            number: c,
                            b: batch.target,
                        })
                    })
                    .collect();
                (Some(batch), chains, tally)
            })
            .collect();
        let mut generation = Generation {
            index,
            targets: Vec::new(),
            chains: Vec::new(),
            rounds: 0,
        };
        let mut b = Vec::new();
        for (batch, chains, tally) in seeded {
            self.sums.seeding += tally;
            b.push(batch.as_ref().map_or(f64::NAN, |b| b.b));
            generation
                .targets
                .push(batch.map_or(f64::NAN, |b| b.target));
            generation.chains.extend(chains);
        }
        self.sums.b.push(b);
        if index == 0 {
            let b = self.sums.brightness().0;
            self.sums.unit = if b > 0.0 {
                2f64.powi(b.log2().round() as i32)
            } else {
                1.0
            };
        }
        self.generation = Some(generation);
    }

    /// The scene.
    pub fn world(&self) -> &'a World<'a, A> {
        self.world
    }

    /// Rounds made in all generations.
    pub fn rounds(&self) -> u64 {
        self.sums.rounds
    }

    /// The sums, with those of all threads in them.
    pub fn sums(&mut self) -> &mut Sums {
        let sums = &mut self.sums;
        for mut buffers in self.idle.drain() {
            buffers.settle(&sums.groups);
            sums.films().absorb(&mut buffers);
            self.idle.put(buffers);
        }
        sums
    }

    /// XYZ of each pixel of the crop.
    pub fn image(&mut self) -> Vec<[f64; 3]> {
        self.sums().image()
    }

    /// Counters of all chains.
    pub fn stats(&self) -> ChainStats {
        let mut s = self.sums.stats;
        if let Some(g) = &self.generation {
            g.chains.iter().for_each(|m| s += m.chain.stats);
        }
        s
    }
}

/// A chain at the start that its group's seeding chose for it. `None` if the path is not found again.
pub fn start_chain<const N: usize, A: Accel>(
    set: &Setting<A>,
    which: Which,
    start: Seed,
    sampler: &mut Sampler<N>,
    tally: &mut Tally,
) -> Option<Chain<N>> {
    let Which {
        seed,
        generation,
        group,
        chain: number,
    } = which;
    let (world, options) = (set.world, set.options);
    if !replay(
        world, options, seed, generation, group, start, sampler, tally,
    ) {
        return None;
    }
    let mut chain = idle_chain(world, options, seed, (generation, group, number));
    let (path, pool) = sampler.joined();
    chain.start(path, pool);
    Some(chain)
}

/// Chain number `c` of a group in a generation, before it has a path.
pub(super) fn idle_chain<const N: usize, A: Accel>(
    world: &World<A>,
    options: &MltOptions,
    seed: u64,
    (index, group, c): (u32, u32, u32),
) -> Chain<N> {
    let id = index * options.chains + c;
    let mut chain = Chain::new(world.max_edges, Rng::new(seed, stage::CHAIN, group, id));
    chain.id = [index, group, c];
    if let Some(e) = options.entries(&world.lens, seed, index, group, c) {
        chain.stratify(e);
    }
    chain
}
