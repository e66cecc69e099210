//! Start-up bias: the mean of many short runs, each from one weighted seed, is the integral, however short they are
//! (Veach 11.3.1). With the weights taken out it is not.

use super::scenes::{Cell, FAMILIES, GLASS, Room, Seeds, image_cell, with_room};
use super::stats::{Compared, ENOUGH, Moments, Verdict};
use crate::chain::{Chain, Direct, MltOptions, Setting, Shares};
use crate::path::{Heuristic, Sampler, Tally};
use crate::real::Convert;
use crate::sampling::Rng;
use crate::scene::spectrum::Lanes;
use std::collections::BTreeMap;

type Sums = BTreeMap<(usize, u32), Moments>;

/// Samples of the reference and runs.
const RUNS: u64 = 150_000;
const STEPS: u32 = 8;

/// Adds one sample's parts, summed by cell first.
fn add(sums: &mut Sums, parts: &mut Vec<((usize, u32), f64)>) {
    parts.sort_by_key(|p| p.0);
    for group in parts.chunk_by(|a, b| a.0 == b.0) {
        let v = group.iter().map(|p| p.1).sum();
        sums.entry(group[0].0).or_default().add(v);
    }
    parts.clear();
}

fn parts(cell: Cell, weight: f64, into: &mut Vec<((usize, u32), f64)>) {
    into.extend(cell.0.into_iter().enumerate().map(|key| (key, weight)));
}

/// ∫τ over each cell, by bidirectional sampling.
fn reference(world: &Room) -> Sums {
    let mut sampler = Sampler::<4>::new(world.max_edges);
    let (mut sums, mut tally, mut now) = (Sums::new(), Tally::default(), Vec::new());
    let mut rng = Rng::new(0x5e, 94, 0, 0);
    for i in 0..2 * RUNS {
        rng.set_step(i);
        let lanes = Lanes::new(rng.next_f32());
        let raster = world.lens.sample_raster(rng.next_vec2());
        sampler.sample(world, &lanes, raster, &mut rng, &mut tally);
        sampler.join(world, Heuristic::Balance, false, &mut tally, |j, _| {
            parts(Cell::of(world, j.path), j.weight, &mut now)
        });
        add(&mut sums, &mut now);
    }
    sums
}

/// Means over short runs by cell of the states visited; and by image cell of what was splatted.
fn runs(world: &Room, weighted: bool) -> Sums {
    let options = MltOptions {
        direct: Direct::InChain,
        shares: Shares([0.35, 0.15, 0.15, 0.15, 0.1, 0.1]),
        ..MltOptions::default()
    };
    let set = Setting::new(world, &options);
    let mut seeds = Seeds::<4>::new(world, false);
    let mut rng = Rng::new(0x5e, 95, 0, 0);
    // The same total over all runs, so that only the weights' spread is taken out.
    let mut flat = 0.0;
    if !weighted {
        let mut lit = 0u32;
        for i in 0..RUNS {
            rng.set_step(i);
            let w = seeds.draw(world, &mut rng);
            flat += w;
            lit += (w > 0.0) as u32;
        }
        flat /= lit as f64;
    }
    let (mut sums, mut now) = (Sums::new(), Vec::new());
    let mut chain = Chain::<4>::new(world.max_edges, Rng::new(0x5e, 96, 0, 0));
    for i in 0..RUNS {
        rng.set_step(i);
        let mut weight = seeds.draw(world, &mut rng);
        if weight == 0.0 {
            continue;
        }
        if !weighted {
            weight = flat;
        }
        let (path, pool) = seeds.sampler.joined();
        chain.start(path, pool);
        let unit = weight / STEPS as f64;
        let mut splats = [0.0f64; 4];
        let mut splat = |s: crate::chain::Splat| {
            splats[image_cell(world, s.raster.real()) as usize] += s.weight as f64;
        };
        for _ in 0..STEPS {
            chain.step(&set, &mut splat);
            let cell = Cell::of(world, &chain.x);
            parts(cell, unit, &mut now);
        }
        chain.flush(&mut splat);
        // The image from the expected values in place of the states.
        now.retain(|p| p.0.0 != 2);
        now.extend((0..4).map(|c| ((2, c as u32), splats[c] * unit)));
        add(&mut sums, &mut now);
    }
    assert_eq!(chain.stats.tally.impossible(), 0);
    sums
}

fn compare(reference: &Sums, runs: &Sums) -> Verdict {
    let (n, m) = (2.0 * RUNS as f64, RUNS as f64);
    let all = reference
        .iter()
        .filter_map(|(key, r)| {
            let s = runs.get(key)?;
            (r.effective() >= ENOUGH && s.effective() >= ENOUGH).then(|| Compared {
                what: format!("{} {:b}", FAMILIES[key.0], key.1),
                difference: s.mean(m) - r.mean(n),
                error: (s.variance(m) + r.variance(n)).sqrt(),
                scale: r.mean(n),
            })
        })
        .collect();
    Verdict::new(all)
}

#[test]
fn short_runs_from_weighted_seeds_have_no_start_up_bias() {
    with_room(GLASS, 0.0, 6, |world| {
        let reference = reference(world);
        let v = compare(&reference, &runs(world, true));
        println!("{}", v.report());
        assert!(v.passes(), "{}", v.report());
        for family in ["length", "image", "wavelength"] {
            println!("{family}: detects {}", v.detects(family));
            assert!(v.detects(family) < 0.1);
        }
        let v = compare(&reference, &runs(world, false));
        println!("without weights: {}", v.report());
        assert!(!v.passes(), "unweighted: {}", v.report());
    });
}
