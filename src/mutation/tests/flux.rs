//! One-step flux: from weighted seeds, as much flows from any cell of path space to any other as comes back. That is
//! detailed balance with everything in it: densities, acceptance, the choice among strategies, seeding. And its
//! counterpart: each density falsified by 5 % on half of its domain is found out.

use super::scenes::{
    BOX, Cell, Contents, FAMILIES, GLASS, GLOSSY, OPEN, PLATE, POOL, Room, Seeds, WEDGE, with_room,
};
use super::stats::{Compared, ENOUGH, Moments, Verdict};
use crate::chain::{Chain, Direct, MltOptions, Setting, Shares};
use crate::mutation::Strategy;
use crate::mutation::falsify::{Density, FALSE};
use crate::real::Real;
use crate::sampling::Rng;
use std::collections::BTreeMap;

/// Steps from each seed, each from the seed itself.
const STEPS: usize = 24;

/// Net flux between all pairs of cells with enough traffic, by families.
fn flux<const N: usize>(world: &Room, options: &MltOptions, samples: u64) -> Verdict {
    let set = Setting::new(world, options);
    let mut seeds = Seeds::<N>::new(world, options.direct == Direct::Separate);
    // A path that suits no strategy stays, and brings no flux.
    let draw = |seeds: &mut Seeds<N>, rng: &mut Rng| {
        let weight = seeds.draw(world, rng);
        let (path, pool) = seeds.sampler.joined();
        let mut shares = Strategy::ALL.into_iter().zip(options.shares.0);
        let moves =
            |(s, share): (Strategy, f64)| share > 0.0 && s.suits(world.dispersive, path, pool);
        if weight > 0.0 && shares.any(moves) {
            weight
        } else {
            0.0
        }
    };
    let mut rng = Rng::new(0xf1, 90, 0, 0);
    let pilot = 2000;
    let mean = (0..pilot)
        .map(|i| {
            rng.set_step(i);
            draw(&mut seeds, &mut rng)
        })
        .sum::<f64>()
        / pilot as f64;
    let mut rng = Rng::new(0xf1, 91, 0, 0);
    let mut chain = Chain::<N>::new(world.max_edges, Rng::new(0xf1, 92, 0, 0));
    let mut pairs: BTreeMap<(usize, u32, u32), Moments> = BTreeMap::new();
    let mut local: Vec<((usize, u32, u32), f64, f64)> = Vec::new();
    for i in 0..samples {
        rng.set_step(i);
        let mut weight = draw(&mut seeds, &mut rng);
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

/// Samples of each test.
const SAMPLES: u64 = 500_000;

/// Options under which all strategies, and the choice among them, take part.
pub(super) fn mixed(direct: Direct) -> MltOptions {
    MltOptions {
        shares: Shares([0.25, 0.15, 0.15, 0.15, 0.1, 0.2]),
        direct,
        ..MltOptions::default()
    }
}

/// The flux is balanced, and an imbalance of `least` would have been seen between some lengths, between parts of the
/// image and between halves of the spectrum.
pub(super) fn balanced<const N: usize>(
    contents: Contents,
    aperture: Real,
    options: &MltOptions,
    least: f64,
) {
    balanced_over::<N>(contents, aperture, options, SAMPLES, least);
}

fn balanced_over<const N: usize>(
    contents: Contents,
    aperture: Real,
    options: &MltOptions,
    samples: u64,
    least: f64,
) {
    let v = with_room(contents, aperture, 6, |w| flux::<N>(w, options, samples));
    println!("{}", v.report());
    assert!(v.passes(), "{}", v.report());
    for family in ["length", "image", "wavelength"] {
        let d = v.detects(family);
        println!("{family}: detects {d:.4}");
        assert!(d < least, "{family}: {d}");
    }
}

#[test]
fn flux_is_balanced_in_a_diffuse_box() {
    balanced::<4>(BOX, 0.0, &mixed(Direct::InChain), 0.1);
}

#[test]
fn flux_is_balanced_among_specular_paths() {
    balanced::<4>(GLASS, 0.0, &mixed(Direct::InChain), 0.1);
}

#[test]
fn flux_is_balanced_among_specular_paths_of_one_wavelength() {
    let options = MltOptions {
        weigh_deletions: false,
        expected_values: false,
        ..mixed(Direct::Separate)
    };
    // One wavelength a path, of many brightnesses.
    balanced_over::<1>(GLASS, 0.0, &options, 2 * SAMPLES, 0.15);
}

#[test]
fn flux_is_balanced_among_glossy_vertices_under_a_thin_lens() {
    balanced::<4>(GLOSSY, 0.03, &mixed(Direct::Separate), 0.1);
}

#[test]
fn flux_is_balanced_under_a_sky_a_sun_and_a_bulb() {
    balanced::<4>(OPEN, 0.0, &mixed(Direct::InChain), 0.15);
}

#[test]
fn flux_is_balanced_under_a_plate_of_glass() {
    balanced::<4>(PLATE, 0.0, &mixed(Direct::Separate), 0.15);
}

/// The wavelength mutation alone: the cells "all" tell dispersive chains from what has none, by modes and colour.
#[test]
fn flux_is_balanced_between_the_colours_of_a_wedge() {
    let options = MltOptions {
        shares: Shares::only(Strategy::Wavelength, 0.0),
        direct: Direct::InChain,
        ..MltOptions::default()
    };
    let v = with_room(WEDGE, 0.0, 4, |w| flux::<4>(w, &options, 2 * SAMPLES));
    println!("{}", v.report());
    assert!(v.passes(), "{}", v.report());
    // LSSDE, retraced from the light, and LDSSE, retraced from the lens.
    for (modes, least) in [("all 10110", 0.1), ("all 11100", 0.2)] {
        println!("{modes}: detects {:.4}", v.detects(modes));
        assert!(v.detects(modes) < least, "{modes}: {}", v.detects(modes));
    }
}

#[test]
fn flux_is_balanced_through_the_surface_of_a_pool() {
    balanced::<4>(POOL, 0.0, &mixed(Direct::InChain), 0.15);
}

/// The flux under one strategy alone with one density false must not look balanced.
fn found_out(contents: Contents, density: Density, strategy: Strategy) {
    found_out_among(contents, 6, SAMPLES, density, strategy);
}

/// As [`found_out`], among paths of at most `edges` edges.
fn found_out_among(
    contents: Contents,
    edges: usize,
    samples: u64,
    density: Density,
    strategy: Strategy,
) {
    let options = MltOptions {
        shares: Shares::only(strategy, 0.0),
        direct: Direct::InChain,
        ..MltOptions::default()
    };
    FALSE.set(Some(density));
    let v = with_room(contents, 0.0, edges, |w| flux::<4>(w, &options, samples));
    FALSE.set(None);
    println!("{density:?}: {}", v.report());
    assert!(!v.passes(), "{density:?} goes unnoticed: {}", v.report());
}

#[test]
fn false_densities_of_the_bidirectional_mutation_are_found_out() {
    for d in [Density::Deletion, Density::Insertion, Density::Strategies] {
        found_out(BOX, d, Strategy::Bidirectional);
    }
}

#[test]
fn a_false_density_of_the_lens_perturbation_is_found_out() {
    found_out(BOX, Density::Lens, Strategy::Lens);
}

#[test]
fn a_false_density_of_the_caustic_perturbation_is_found_out() {
    found_out(PLATE, Density::Caustic, Strategy::Caustic);
}

#[test]
fn a_false_density_of_the_multi_chain_perturbation_is_found_out() {
    // LSDSE alone, which random walks from the lens must find by chance.
    found_out_among(
        POOL,
        4,
        6 * SAMPLES,
        Density::MultiChain,
        Strategy::MultiChain,
    );
}

#[test]
fn a_false_density_of_the_lens_subpath_mutation_is_found_out() {
    found_out(BOX, Density::LensSubpath, Strategy::LensSubpath);
}

#[test]
fn a_false_density_of_the_wavelength_mutation_is_found_out() {
    found_out(BOX, Density::Wavelength, Strategy::Wavelength);
}
