//! Seeding: bidirectional samples with weights, systematic resampling, replay (Veach 11.3.1).

use super::{Direct, MltOptions, Setting, stage};
use crate::accel::Accel;
use crate::path::{Heuristic, Sampler, Site, Tally, World};
use crate::sampling::Rng;

/// A chosen start path: which sample, which strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Seed {
    /// Index of the sample in the group's batch.
    pub sample: u32,
    /// Light vertices.
    pub s: u16,
    /// Eye vertices.
    pub t: u16,
}

/// The result of a group's seeding in one generation.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    /// Mean weight b_g: the integral of τ over the group's paths.
    pub b: f64,
    /// Mean weight over I0: the integral of the chains' target τ/I0. It scales the film.
    pub target: f64,
    /// One for each chain; empty if b is 0.
    pub seeds: Vec<Seed>,
}

/// The stream of one seeding sample.
fn stream(seed: u64, generation: u32, group: u32, sample: u32) -> Rng {
    let mut rng = Rng::new(seed, stage::SEEDING, group, generation);
    rng.set_step(sample as u64);
    rng
}

/// Draws the sub-paths of one sample.
fn draw<const N: usize, A: Accel>(
    world: &World<A>,
    sampler: &mut Sampler<N>,
    rng: &mut Rng,
    tally: &mut Tally,
) {
    let lanes = world.lanes(rng.next_f32());
    let raster = world.lens.sample_raster(rng.next_vec2());
    sampler.sample(world, &lanes, raster, rng, tally);
}

/// Seeds one group: n samples, each keeping one of its paths in proportion to its weight, then n' of them at equal
/// intervals of the cumulative weight, shuffled. With `relative` the first n' samples that carry light are all there is
/// (the source text's way where a factor does not matter); the chains then start anywhere, and forget it with time alone.
pub fn seed_group<const N: usize, A: Accel>(
    set: &Setting<A>,
    seed: u64,
    generation: u32,
    group: u32,
    tally: &mut Tally,
) -> Batch {
    let (world, options) = (set.world, set.options);
    let mut sampler = Sampler::<N>::new(world.max_edges);
    let indirect = options.direct == Direct::Separate;
    let mut bright = 0.0f64;
    let mut chosen = Vec::with_capacity(options.seeds as usize);
    let mut total = 0.0f64;
    for sample in 0..options.seeds {
        let faults = tally.impossible();
        let mut rng = stream(seed, generation, group, sample);
        draw(world, &mut sampler, &mut rng, tally);
        let (mut weight, mut pick) = (0.0f64, Seed { sample, s: 0, t: 0 });
        sampler.join(world, Heuristic::Balance, indirect, tally, |j, _| {
            let part = j.weight / set.i0(j.path.raster);
            bright += j.weight;
            weight += part;
            // Reservoir of one: each path with probability proportional to its weight.
            if rng.next_f64() * weight < part {
                pick = Seed {
                    sample,
                    s: j.s as u16,
                    t: j.t as u16,
                };
            }
        });
        if tally.impossible() != faults {
            world.sites.note(Site::Seed {
                generation,
                group,
                sample,
            });
        }
        if weight > 0.0 {
            total += weight;
            chosen.push((total, pick));
            if options.relative && chosen.len() == options.chains as usize {
                break;
            }
        }
    }
    let n = options.seeds as f64;
    let mut seeds = Vec::new();
    if options.relative {
        // As if the mean over the raster were known to be 1.
        let one = world.lens.raster_area * !chosen.is_empty() as u32 as f64;
        seeds.extend(chosen.iter().map(|c| c.1));
        return Batch {
            b: one,
            target: one,
            seeds,
        };
    }
    if total > 0.0 {
        let mut rng = Rng::new(seed, stage::RESAMPLING, group, generation);
        let offset = rng.next_f64();
        let mut i = 0;
        for c in 0..options.chains {
            let at = (c as f64 + offset) / options.chains as f64 * total;
            while i + 1 < chosen.len() && chosen[i].0 <= at {
                i += 1;
            }
            seeds.push(chosen[i].1);
        }
        // A chain's number says nothing of its seed: an image of some of a group's chains stays unbiased.
        for c in (1..seeds.len()).rev() {
            seeds.swap(c, rng.next_below(c as u64 + 1) as usize);
        }
    }
    Batch {
        b: bright / n,
        target: total / n,
        seeds,
    }
}

/// Makes a seed's path again; it stands in the sampler.
#[allow(clippy::too_many_arguments)]
pub fn replay<const N: usize, A: Accel>(
    world: &World<A>,
    options: &MltOptions,
    seed: u64,
    generation: u32,
    group: u32,
    chosen: Seed,
    sampler: &mut Sampler<N>,
    tally: &mut Tally,
) -> bool {
    let mut rng = stream(seed, generation, group, chosen.sample);
    draw(world, sampler, &mut rng, tally);
    let indirect = options.direct == Direct::Separate;
    sampler
        .join_one(
            world,
            chosen.s as usize,
            chosen.t as usize,
            Heuristic::Balance,
            indirect,
            tally,
        )
        .is_some()
}
