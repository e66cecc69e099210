//! Generations and rounds: which chains run when, and the sums they fill.
//!
//! The unit of work is (generation, group, chain, round); sums are exact, so the order of the work and the number of
//! threads leave no trace in the image.

use super::markov::{Chain, Setting};
use super::sink::{Buffers, FilmSink, Films};
use super::{Batch, ChainStats, MltOptions, TestImage, replay, seed_group, stage};
use crate::accel::Accel;
use crate::film::{Crop, Filter, GroupFilm, Reserve};
use crate::path::{Sampler, Tally, World};
use crate::sampling::Rng;
use crate::scene::spectrum::Target;
use rayon::prelude::*;
use std::sync::Mutex;

/// The chains of one generation.
pub struct Generation<const N: usize> {
    /// Number of the generation.
    pub index: u32,
    /// Seeding of each group.
    pub batches: Vec<Batch>,
    /// Chains, group by group; groups without light have none.
    chains: Vec<Member<N>>,
    /// Rounds made.
    pub rounds: u64,
}

/// A chain of a group.
struct Member<const N: usize> {
    chain: Chain<N>,
    group: u32,
    /// Integral of the group's target in this generation.
    b: f64,
}

/// A group's seeding: its batch, its chains, rays and faults.
type Seeded<const N: usize> = (Batch, Vec<Member<N>>, Tally);

/// A run of Metropolis light transport that can go on for any number of rounds.
pub struct Mlt<'a, A: Accel, const N: usize> {
    world: &'a World<'a, A>,
    options: MltOptions,
    test_image: Option<TestImage>,
    seed: u64,
    crop: Crop,
    filter: Filter,
    film: Mutex<Films>,
    groups: GroupFilm,
    idle: Reserve<Buffers>,
    generation: Option<Generation<N>>,
    /// b_g of every group and generation so far.
    pub b: Vec<Vec<f64>>,
    /// Splats are divided by this power of two, near b of the first generation.
    unit: f64,
    /// Rounds made in all generations.
    pub rounds: u64,
    /// Counters of finished generations and of seeding.
    stats: ChainStats,
    /// Rays and faults of seeding.
    pub seeding: Tally,
}

impl<'a, A: Accel, const N: usize> Mlt<'a, A, N> {
    /// A run that has done nothing yet.
    pub fn new(world: &'a World<'a, A>, options: MltOptions, seed: u64) -> Self {
        // Without the floor a bin that the eye does not see would get splats of any size.
        assert!(
            options.bins.is_none() || world.target == Target::Bins,
            "spectral bins need their target"
        );
        let crop = Crop::from(world.scene.camera.crop);
        Self {
            world,
            options,
            test_image: None,
            seed,
            crop,
            filter: Filter::new(&world.scene.settings.filter),
            film: Mutex::new(Films::new(crop, &options)),
            groups: GroupFilm::new(crop, options.groups as usize),
            idle: Reserve::new(),
            generation: None,
            b: Vec::new(),
            unit: 1.0,
            rounds: 0,
            stats: ChainStats::default(),
            seeding: Tally::default(),
        }
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
            let set = Setting {
                world: self.world,
                options: &self.options,
                test_image: self.test_image.as_ref(),
            };
            let (film, groups, idle, unit) = (&self.film, &self.groups, &self.idle, self.unit);
            let (crop, filter) = (self.crop, &self.filter);
            g.chains
                .par_iter_mut()
                .for_each(|Member { chain, group, b }| {
                    let mut buffers = idle.take_fitting(
                        |idle| idle.serve(*group),
                        || Buffers::new(crop, filter, set.options.bins),
                    );
                    buffers.turn_to(*group, groups);
                    let mut sink = FilmSink::new(buffers, (*b / unit) as f32);
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
                    idle.put(buffers);
                });
            g.rounds += now;
            self.rounds += now;
            rounds -= now;
        }
    }

    fn begin_generation(&mut self) {
        let index = self.b.len() as u32;
        if let Some(g) = self.generation.take() {
            g.chains.iter().for_each(|m| self.stats += m.chain.stats);
        }
        let (world, options, seed) = (self.world, &self.options, self.seed);
        let set = Setting {
            world,
            options,
            test_image: self.test_image.as_ref(),
        };
        let seeded: Vec<Seeded<N>> = (0..options.groups)
            .into_par_iter()
            .map(|group| {
                let mut tally = Tally::default();
                let batch = seed_group::<N, A>(&set, seed, index, group, &mut tally);
                let mut sampler = Sampler::new(world.max_edges);
                let chains = batch
                    .seeds
                    .iter()
                    .enumerate()
                    .filter_map(|(c, s)| {
                        if !replay(
                            world,
                            options,
                            seed,
                            index,
                            group,
                            *s,
                            &mut sampler,
                            &mut tally,
                        ) {
                            tally.fault(crate::path::Fault::ZeroDensity);
                            return None;
                        }
                        let id = index * options.chains + c as u32;
                        let mut chain =
                            Chain::new(world.max_edges, Rng::new(seed, stage::CHAIN, group, id));
                        let entries = options.entries(&world.lens, seed, index, group, c as u32);
                        if let Some(e) = entries {
                            chain.stratify(e);
                        }
                        let (path, pool) = sampler.joined();
                        chain.start(path, pool);
                        let b = batch.target;
                        Some(Member { chain, group, b })
                    })
                    .collect();
                (batch, chains, tally)
            })
            .collect();
        let mut generation = Generation {
            index,
            batches: Vec::new(),
            chains: Vec::new(),
            rounds: 0,
        };
        for (batch, chains, tally) in seeded {
            self.seeding += tally;
            generation.batches.push(batch);
            generation.chains.extend(chains);
        }
        self.b
            .push(generation.batches.iter().map(|b| b.b).collect());
        if index == 0 {
            let b = self.brightness().0;
            self.unit = if b > 0.0 {
                2f64.powi(b.log2().round() as i32)
            } else {
                1.0
            };
        }
        self.generation = Some(generation);
    }

    /// b, the integral of τ over the chain's paths and the raster domain (px²), and its standard error over the groups.
    pub fn brightness(&self) -> (f64, f64) {
        let g = self.options.groups as usize;
        let each: Vec<f64> = (0..g)
            .map(|i| self.b.iter().map(|b| b[i]).sum::<f64>() / self.b.len().max(1) as f64)
            .collect();
        let mean = each.iter().sum::<f64>() / g as f64;
        let var = each.iter().map(|b| (b - mean).powi(2)).sum::<f64>() / (g.max(2) - 1) as f64;
        (mean, (var / g as f64).sqrt())
    }

    /// Mutations made, failed ones counted.
    pub fn mutations(&self) -> u64 {
        self.rounds * self.options.mutations_per_round()
    }

    /// XYZ of each pixel of the crop.
    pub fn image(&mut self) -> Vec<[f64; 3]> {
        let scale = self.scale();
        self.gathered().colors.to_xyz(scale)
    }

    /// Radiance per nm, `[pixel · bins + bin]`, if the run fills bins.
    pub fn spectrum(&mut self) -> Option<Vec<f32>> {
        let scale = self.scale();
        let film = &self.gathered().spectra;
        film.as_ref().map(|f| f.to_values(scale))
    }

    /// Variance of each pixel's luminance, from the spread of the groups; the error of b is in it.
    pub fn variance(&mut self) -> Vec<f64> {
        self.gathered();
        let scale = self.scale() * self.options.groups as f64;
        self.groups.variance(scale)
    }

    /// Degrees of freedom of [`Self::variance`].
    pub fn freedom(&self) -> u64 {
        self.options.groups.saturating_sub(1) as u64
    }

    /// What a unit of the film is worth.
    fn scale(&self) -> f64 {
        if self.rounds == 0 {
            0.0
        } else {
            self.unit / self.mutations() as f64
        }
    }

    /// The film with all threads' sums in it.
    fn gathered(&mut self) -> &Films {
        let film = self.film.get_mut().expect("no thread panicked");
        for mut buffers in self.idle.drain() {
            buffers.settle(&self.groups);
            film.absorb(&mut buffers);
            self.idle.put(buffers);
        }
        film
    }

    /// Counters of all chains.
    pub fn stats(&self) -> ChainStats {
        let mut s = self.stats;
        if let Some(g) = &self.generation {
            g.chains.iter().for_each(|m| s += m.chain.stats);
        }
        s
    }
}
