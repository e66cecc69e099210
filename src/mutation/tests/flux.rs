//! One-step flux: from weighted seeds, as much flows from any cell of path space to any other as comes back. That is
//! detailed balance with everything in it: densities, acceptance, the choice among strategies, seeding. And its
//! counterpart: each density falsified by 5 % on half of its domain is found out.

use super::scenes::{BOX, Cell, FAMILIES, GLASS, GLOSSY, Room, Seeds, with_room};
use super::stats::{Compared, ENOUGH, Moments, Verdict};
use crate::chain::{Chain, Direct, MltOptions, Setting, Shares};
use crate::mutation::falsify::{Density, FALSE};
use crate::sampling::Rng;
use std::collections::BTreeMap;

/// Steps from each seed, each from the seed itself.
const STEPS: usize = 24;

/// Net flux between all pairs of cells with enough traffic, by families.
fn flux<const N: usize>(world: &Room, shares: [f64; 3], direct: Direct, samples: u64) -> Verdict {
    let options = MltOptions {
        shares: Shares(shares),
        direct,
        ..MltOptions::default()
    };
    let set = Setting {
        world,
        options: &options,
    };
    let mut seeds = Seeds::<N>::new(world, direct == Direct::Separate);
    let mut rng = Rng::new(0xf1, 90, 0, 0);
    let pilot = 2000;
    let mean = (0..pilot)
        .map(|i| {
            rng.set_step(i);
            seeds.draw(world, &mut rng)
        })
        .sum::<f64>()
        / pilot as f64;
    let mut rng = Rng::new(0xf1, 91, 0, 0);
    let mut chain = Chain::<N>::new(world.max_edges, Rng::new(0xf1, 92, 0, 0));
    let mut pairs: BTreeMap<(usize, u32, u32), Moments> = BTreeMap::new();
    let mut local: Vec<((usize, u32, u32), f64, f64)> = Vec::new();
    for i in 0..samples {
        rng.set_step(i);
        let mut weight = seeds.draw(world, &mut rng);
        // Roulette over the weights: steps go where they count.
        if weight < mean {
            if rng.next_f64() * mean >= weight {
                continue;
            }
            weight = mean;
        }
        let (path, pool) = seeds.sampler.joined();
        let from = Cell::of(world, path);
        chain.start(path, pool);
        local.clear();
        for _ in 0..STEPS {
            let before = accepted(&chain);
            chain.step(&set, &mut |_| {});
            if accepted(&chain) == before {
                continue;
            }
            let to = Cell::of(world, &chain.x);
            for (family, (a, b)) in from.0.into_iter().zip(to.0).enumerate() {
                if a == b {
                    continue;
                }
                let key = (family, a.min(b), a.max(b));
                let signed = if a < b { 1.0 } else { -1.0 };
                match local.iter_mut().find(|l| l.0 == key) {
                    Some(l) => {
                        l.1 += signed;
                        l.2 += 1.0;
                    }
                    None => local.push((key, signed, 1.0)),
                }
            }
            chain.start(path, pool);
        }
        let unit = weight / STEPS as f64;
        for &(key, net, size) in &local {
            pairs
                .entry(key)
                .or_default()
                .add_sized(net * unit, size * unit);
        }
    }
    assert_eq!(chain.stats.tally.impossible(), 0);
    assert_eq!(seeds.tally.impossible(), 0);
    let n = samples as f64;
    let all = pairs
        .into_iter()
        .filter(|(_, m)| m.effective() >= ENOUGH)
        .map(|((family, a, b), m)| Compared {
            what: format!("{} {a:b} ↔ {b:b}", FAMILIES[family]),
            difference: m.mean(n),
            error: m.variance(n).sqrt(),
            // Each way carries half of the traffic.
            scale: 0.5 * m.size(n),
        })
        .collect();
    Verdict::new(all)
}

fn accepted<const N: usize>(chain: &Chain<N>) -> u64 {
    chain.stats.strategies.iter().map(|s| s.accepted).sum()
}

/// Shares under which all strategies, and the choice among them, take part.
const MIXED: [f64; 3] = [0.4, 0.35, 0.25];

/// Samples of the honest tests and of those that must fail.
const SAMPLES: u64 = 500_000;

/// The flux is balanced, and an imbalance of `least` would have been seen in the length and in the image.
fn balanced<const N: usize>(inside: &str, aperture: f32, direct: Direct, least: f64) {
    let v = with_room(inside, aperture, 6, |w| {
        flux::<N>(w, MIXED, direct, SAMPLES)
    });
    println!("{}", v.report());
    assert!(v.passes(), "{}", v.report());
    for family in ["length", "image", "wavelength"] {
        let d = v.detects(family);
        println!("{family}: detects {d}");
        assert!(d < least, "{family}: {d}");
    }
}

#[test]
fn flux_is_balanced_in_a_diffuse_box() {
    balanced::<4>(BOX, 0.0, Direct::InChain, 0.1);
}

#[test]
fn flux_is_balanced_among_specular_paths() {
    balanced::<4>(GLASS, 0.0, Direct::InChain, 0.1);
}

#[test]
fn flux_is_balanced_among_specular_paths_of_one_wavelength() {
    balanced::<1>(GLASS, 0.0, Direct::Separate, 0.12);
}

#[test]
fn flux_is_balanced_among_glossy_vertices_under_a_thin_lens() {
    balanced::<4>(GLOSSY, 0.03, Direct::Separate, 0.1);
}

/// The flux with one density false.
fn falsified(density: Density, shares: [f64; 3], samples: u64) -> Verdict {
    FALSE.set(Some(density));
    let v = with_room(BOX, 0.0, 6, |w| {
        flux::<4>(w, shares, Direct::InChain, samples)
    });
    FALSE.set(None);
    println!("{density:?}: {}", v.report());
    v
}

#[test]
fn a_false_density_of_the_bidirectional_mutation_is_found() {
    for d in [Density::Deletion, Density::Insertion, Density::Strategies] {
        assert!(!falsified(d, [1.0, 0.0, 0.0], 500_000).passes(), "{d:?}");
    }
}

#[test]
fn a_false_density_of_the_lens_perturbation_is_found() {
    assert!(!falsified(Density::Lens, [0.0, 1.0, 0.0], 500_000).passes());
}

#[test]
fn a_false_density_of_the_wavelength_mutation_is_found() {
    assert!(!falsified(Density::Wavelength, [0.0, 0.0, 1.0], 500_000).passes());
}
