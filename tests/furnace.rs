//! Energy: inside a sphere of reflectance 1/2 whose light makes every radiance 1, by every integrator, in every pixel
//! and by path length. The scenes are explained in scenes/furnace/README.md.
//!
//! A path of k edges, one lamp end and k−1 reflections: with emission 1/2 it brings 2⁻ᵏ. A point of intensity π at the
//! centre gives irradiance π, of which the first reflection sends on (1/2)/π·π = 1/2, and a point is never hit:
//! nothing for k = 1, 2^−(k−1) from then on.

mod common;

use common::estimate::{self, Chains, Grid, Run};
use common::scene::{embree, of_file};
use common::stats::{Estimate, Pair, agree};
use metrolux::accel::{Accel, Obvhs};
use metrolux::chain::{Direct, MltOptions};
use metrolux::integrator::{Bdpt, Budget, Quiet, bdpt, mlt, pt};
use metrolux::output::Image;
use metrolux::path::{Heuristic, Tally, World};
use metrolux::scene::Scene;
use rayon::prelude::*;

/// Radiance in paths of k edges.
fn share(file: &str, k: usize) -> f64 {
    let n = if file == "emission" { k } else { k - 1 };
    if n == 0 { 0.0 } else { 0.5f64.powi(n as i32) }
}

/// Each length up to `single`, then the rest together, against the series.
fn against_series(name: &str, file: &str, run: &Run, single: usize, limit: f64) -> Vec<Pair> {
    let first = if file == "emission" { 1 } else { 2 };
    let rest = Some(single + 1..=run.edges()).filter(|r| !r.is_empty());
    let parts = (first..=single).map(|k| k..=k).chain(rest);
    parts
        .map(|ks| Pair {
            name: format!("{file} {name}, edges {ks:?}"),
            found: run.length(ks.clone()),
            reference: Estimate::exact(ks.map(|k| share(file, k)).sum()),
            limit,
        })
        .collect()
}

/// Short runs with many seeds: the chain's share of the time, not the seeding's.
fn options(direct: Direct) -> MltOptions {
    MltOptions {
        chains: 4,
        seeds: 512,
        direct,
        ..MltOptions::default()
    }
}

/// All integrators by path length on one backend.
fn by_length<const N: usize, A: Accel>(
    file: &str,
    scene: &Scene,
    accel: &A,
    pairs: &mut Vec<Pair>,
) {
    let world = World::new(scene, accel, scene.settings.max_depth);
    let grid = Grid::new(&world, 16);
    let on = format!("on {} with {N} lanes", accel.name());
    let run = estimate::pt::<N, A>(&world, grid, 11, 32, 128);
    pairs.extend(against_series(&format!("pt {on}"), file, &run, 5, 0.07));
    for heuristic in [Heuristic::Balance, Heuristic::Power] {
        let run = estimate::bdpt::<N, A>(&world, grid, heuristic, 12, 32, 16);
        let name = format!("bdpt {heuristic:?} {on}");
        pairs.extend(against_series(&name, file, &run, 5, 0.07));
    }
    // Shorter paths only, of which a chain visits each length often enough.
    let world = World::new(scene, accel, 4);
    let grid = Grid::new(&world, 16);
    for direct in [Direct::Separate, Direct::InChain] {
        let chains = Chains {
            options: options(direct),
            steps: 20_000,
            direct: 16,
        };
        // With direct light the chain spends its time in the shortest paths.
        let limit = if direct == Direct::InChain { 0.2 } else { 0.1 };
        let run = estimate::mlt::<N, A>(&world, grid, chains, 13, 32);
        let name = format!("mlt {direct:?} {on}");
        pairs.extend(against_series(&name, file, &run, 5, limit));
    }
}

fn lengths_of(file: &str) {
    let scene = of_file(&format!("furnace/{file}.pbrt"), 16, 16);
    let (e, o) = (embree(&scene), Obvhs::new(&scene.geometry));
    let mut pairs = Vec::new();
    by_length::<4, _>(file, &scene, &e, &mut pairs);
    if file != "four-points" {
        by_length::<1, _>(file, &scene, &o, &mut pairs);
    }
    agree(&format!("furnace {file} by path length"), &pairs);
}

#[test]
fn a_point_by_length() {
    lengths_of("point");
}

#[test]
fn four_points_by_length() {
    lengths_of("four-points");
}

#[test]
fn emission_by_length() {
    lengths_of("emission");
}

/// An image of one seed.
type Render<'a> = &'a (dyn Fn(u64, &mut Tally) -> Vec<[f64; 3]> + Sync);

/// Every pixel's luminance and the image's mean red, green and blue are 1.
fn pixels(name: &str, size: [u32; 2], seeds: u64, render: Render) -> Vec<Pair> {
    let images: Vec<Vec<[f64; 3]>> = (1..=seeds)
        .into_par_iter()
        .map(|seed| {
            let mut tally = Tally::default();
            let image = render(seed, &mut tally);
            assert_eq!(tally.impossible(), 0, "{tally:?}");
            image
        })
        .collect();
    let n = images[0].len();
    let mut pairs: Vec<Pair> = (0..n)
        .map(|i| Pair {
            name: format!("{name}, pixel {i}"),
            found: Estimate::of(images.iter().map(|im| im[i][1])),
            reference: Estimate::exact(1.0),
            limit: 0.5,
        })
        .collect();
    let [w, h] = size.map(|v| v as usize);
    let means: Vec<[f64; 3]> = images
        .iter()
        .map(|im| {
            let rgb = Image::from_xyz(w, h, im).rgb;
            [0, 1, 2].map(|c| rgb.iter().map(|p| p[c] as f64).sum::<f64>() / n as f64)
        })
        .collect();
    pairs.extend((0..3).map(|c| Pair {
        name: format!("{name}, mean of channel {c}"),
        found: Estimate::of(means.iter().map(|m| m[c])),
        reference: Estimate::exact(1.0),
        limit: 0.03,
    }));
    pairs
}

/// The images that the integrators themselves put on the film.
fn images_of(file: &str) {
    let scene = of_file(&format!("furnace/{file}.pbrt"), 8, 8);
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, scene.settings.max_depth);
    let size = [8, 8];
    let mut all = pixels("pt", size, 16, &|seed, tally| {
        pt::<4, _>(&world, Budget::Rounds(256), seed, &Quiet, tally).0
    });
    for heuristic in [Heuristic::Balance, Heuristic::Power] {
        let what = Bdpt {
            heuristic,
            indirect_only: false,
        };
        all.extend(pixels(
            &format!("bdpt {heuristic:?}"),
            size,
            16,
            &|seed, tally| bdpt::<4, _>(&world, what, Budget::Rounds(64), seed, &Quiet, tally).0,
        ));
    }
    for direct in [Direct::Separate, Direct::InChain] {
        let options = MltOptions {
            groups: 4,
            ..options(direct)
        };
        all.extend(pixels(
            &format!("mlt {direct:?}"),
            size,
            16,
            &|seed, tally| {
                let budget = Budget::PerPixel(2000.0);
                mlt::<4, _>(&world, &options, budget, seed, &Quiet, tally).image
            },
        ));
    }
    agree(&format!("furnace {file} by pixel"), &all);
}

#[test]
fn a_point_by_pixel() {
    images_of("point");
}

#[test]
fn four_points_by_pixel() {
    images_of("four-points");
}

#[test]
fn emission_by_pixel() {
    images_of("emission");
}
