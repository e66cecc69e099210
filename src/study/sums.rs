//! The same chains as a render's, with sums in single precision: what the film's exact sums bring, and what they cost.
//!
//! Groups run side by side, each with a film of its own whose sums do not depend on threads; the groups' films are then
//! added in the same arithmetic. Paths, acceptances and weights are those of `render` with the same seed, so two such
//! images differ by rounding alone.

use crate::accel::Accel;
use crate::chain::{ChainStats, MltOptions, Setting, Splat, Which, seed_group, start_chain};
use crate::film::{Crop, Filter, PixelErrors};
use crate::integrator::MltResult;
use crate::path::{Sampler, Tally, World};
use clap::ValueEnum;
use rayon::prelude::*;

/// How contributions are added up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Sums {
    /// Fixed point, whose sums do not depend on their order
    Exact,
    /// Single precision
    F32,
    /// Single precision with Kahan's compensation
    Compensated,
}

/// A sum of X, Y and Z, and what its additions lost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cell {
    sum: [f32; 3],
    lost: [f32; 3],
    /// In units of 2⁻³².
    exact: [i128; 3],
}

impl Cell {
    #[inline]
    fn add(&mut self, v: [f32; 3], sums: Sums) {
        match sums {
            Sums::Exact => {
                for (a, v) in self.exact.iter_mut().zip(v) {
                    *a += (f64::from(v) * UNIT).round_ties_even() as i128;
                }
            }
            Sums::F32 => {
                for (a, v) in self.sum.iter_mut().zip(v) {
                    *a += v;
                }
            }
            Sums::Compensated => {
                for ((a, lost), v) in self.sum.iter_mut().zip(&mut self.lost).zip(v) {
                    let y = v - *lost;
                    let t = *a + y;
                    *lost = (t - *a) - y;
                    *a = t;
                }
            }
        }
    }

    fn merge(&mut self, other: &Self, sums: Sums) {
        self.add(other.sum, sums);
        for (a, b) in self.exact.iter_mut().zip(other.exact) {
            *a += b;
        }
    }

    fn value(&self, sums: Sums) -> [f64; 3] {
        match sums {
            Sums::Exact => self.exact.map(|v| v as f64 / UNIT),
            _ => self.sum.map(f64::from),
        }
    }
}

/// Units of an exact sum that make 1.
const UNIT: f64 = 4_294_967_296.0;

/// One group's sums over the rounds of all generations, its b in each, and its counters.
struct Group {
    cells: Vec<Cell>,
    b: Vec<f64>,
    stats: ChainStats,
    seeding: Tally,
}

/// Renders `rounds` rounds, all light in the chains, with sums of this kind. Errors are not told.
///
/// # Panics
/// If the options ask for two stages, spectral bins or a separate direct pass.
pub fn mlt_with_sums<const N: usize, A: Accel>(
    world: &World<A>,
    options: &MltOptions,
    rounds: u64,
    seed: u64,
    sums: Sums,
    tally: &mut Tally,
) -> MltResult {
    assert!(options.test_samples.is_none() && options.bins.is_none());
    assert!(options.direct == crate::chain::Direct::InChain);
    let crop = Crop::from(world.scene.camera.crop);
    let groups: Vec<Group> = (0..options.groups)
        .into_par_iter()
        .map(|g| of_group::<N, A>(world, options, rounds, seed, sums, crop, g))
        .collect();
    let mut cells = vec![Cell::default(); crop.pixels()];
    let mut stats = ChainStats::default();
    for g in &groups {
        for (a, b) in cells.iter_mut().zip(&g.cells) {
            a.merge(b, sums);
        }
        stats += g.stats;
        *tally += g.seeding;
    }
    *tally += stats.tally;
    let mutations = rounds * options.mutations_per_round();
    let scale = 1.0 / mutations as f64;
    let n = groups.len() as f64;
    let each = |g: &Group| g.b.iter().sum::<f64>() / g.b.len().max(1) as f64;
    let b = groups.iter().map(each).sum::<f64>() / n;
    let spread = groups.iter().map(|g| (each(g) - b).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let area = world.lens.raster_area;
    MltResult {
        direct: None,
        image: cells
            .iter()
            .map(|c| c.value(sums).map(|v| v * scale))
            .collect(),
        spectrum: None,
        rounds,
        mutations,
        direct_samples: 0.0,
        b: (b / area, (spread / n).sqrt() / area),
        stats,
        errors: PixelErrors {
            variance: vec![f64::INFINITY; crop.pixels()],
            freedom: 1,
        },
        target_met: false,
    }
}

fn of_group<const N: usize, A: Accel>(
    world: &World<A>,
    options: &MltOptions,
    rounds: u64,
    seed: u64,
    sums: Sums,
    crop: Crop,
    group: u32,
) -> Group {
    let filter = Filter::new(&world.scene.settings.filter);
    let set = Setting::new(world, options);
    let mut found = Group {
        cells: vec![Cell::default(); crop.pixels()],
        b: Vec::new(),
        stats: ChainStats::default(),
        seeding: Tally::default(),
    };
    let mut sampler = Sampler::<N>::new(world.max_edges);
    let mut left = rounds;
    for generation in 0.. {
        if left == 0 {
            break;
        }
        let now = left.min(u64::from(options.rounds_per_generation));
        left -= now;
        let batch = seed_group::<N, A>(&set, seed, generation, group, &mut found.seeding);
        found.b.push(batch.b);
        for (c, chosen) in batch.seeds.iter().enumerate() {
            let which = Which {
                seed,
                generation,
                group,
                chain: c as u32,
            };
            let started = start_chain(&set, which, *chosen, &mut sampler, &mut found.seeding);
            let Some(mut chain) = started else {
                continue;
            };
            let cells = &mut found.cells;
            let mut sink = |s: Splat| {
                let v = s.xyz.map(|v| v * s.weight * batch.target as f32);
                filter.for_pixels(s.raster, |x, y, h| {
                    if let Some(i) = crop.index(x, y) {
                        cells[i].add(v.map(|v| v * h), sums);
                    }
                });
            };
            for _ in 0..now {
                for _ in 0..options.round {
                    chain.step(&set, &mut sink);
                }
                chain.flush(&mut sink);
            }
            found.stats += chain.stats;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{Embree, EmbreeOptions};
    use crate::chain::Direct;
    use crate::integrator::{Budget, Quiet, mlt};
    use crate::scene::load::{LoadOptions, load_scene};
    use std::path::Path;

    /// 10⁷ times 0.1: single precision stops growing well, compensation does not.
    #[test]
    fn compensation_keeps_what_single_precision_loses() {
        let of = |sums| {
            let mut c = Cell::default();
            (0..10_000_000).for_each(|_| c.add([0.1, 1.0, 0.0], sums));
            c.value(sums)
        };
        let exact = 1e7 * f64::from(0.1f32);
        let off = |s: Sums| (of(s)[0] / exact - 1.0).abs();
        assert!(off(Sums::F32) > 0.01, "{}", off(Sums::F32));
        assert!(off(Sums::Compensated) < 1e-7);
        assert!(
            off(Sums::Exact) < 1e-8,
            "0.1 is rounded to 2⁻³², a part in 4·10⁹"
        );
    }

    /// The chains are those of the render: but for the last digits, so is the image, over two generations too.
    #[test]
    fn the_image_is_that_of_the_render() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.pbrt");
        let mut scene = load_scene(&file, &LoadOptions::default()).expect("a scene");
        scene.camera.resolution = [8, 8];
        scene.camera.crop = [0, 0, 8, 8];
        let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree");
        let world = World::new(&scene, &accel, 4);
        let options = MltOptions {
            groups: 3,
            chains: 4,
            seeds: 256,
            rounds_per_generation: 4,
            direct: Direct::InChain,
            ..MltOptions::default()
        };
        let mut tally = Tally::default();
        let exact = mlt::<4, _>(&world, &options, Budget::Rounds(6), 3, &Quiet, &mut tally);
        for sums in [Sums::Exact, Sums::F32, Sums::Compensated] {
            let r = mlt_with_sums::<4, _>(&world, &options, 6, 3, sums, &mut tally);
            assert!((r.b.0 / exact.b.0 - 1.0).abs() < 1e-12);
            for (a, b) in r.image.iter().flatten().zip(exact.image.iter().flatten()) {
                // Some 2000 additions of 2⁻²⁴ each at the very worst; weights in single precision too.
                assert!((a - b).abs() <= 1.5e-4 * b.abs() + 1e-9, "{a} {b}");
            }
        }
    }
}
