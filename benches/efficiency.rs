//! What a mutation is worth: efficiency 1/(relMSE · time) beside mutations per second, so that cheap rejections do not
//! win. `METROLUX_SCENE=FILE` (scenes/cornell/cornell.pbrt), `METROLUX_MUTATIONS=M` (64 a pixel, for path tracing a quarter
//! of it in samples) and `METROLUX_REPEATS=K` (16) change what is measured.
//!
//! relMSE is the mean over pixels of the variance of luminance among the repeats, each with a seed of its own, over the
//! squared mean of the image: nothing needs a reference, and no bias is seen. Its standard error is the jackknife's.
//! Time is wall time with everything: shares from a pilot, seeding, the direct pass. Settings take turns.

mod common;

use common::{embree, pool, scene, spread};
use metrolux::accel::Accel;
use metrolux::chain::{Direct, MltOptions, Pilot};
use metrolux::integrator::{Budget, Quiet, mlt, pt};
use metrolux::path::{Tally, World};
use std::time::Instant;

const LANES: usize = 4;

/// One render: luminance of each pixel, seconds, and mutations or samples.
struct Run {
    image: Vec<f64>,
    seconds: f64,
    work: f64,
}

/// Renders with a seed; see the module.
type Setting<'a> = (&'a str, &'a (dyn Fn(u64) -> (Vec<[f64; 3]>, f64) + Sync));

fn chains<A: Accel>(world: &World<A>, direct: Direct, seed: u64, n: f64) -> (Vec<[f64; 3]>, f64) {
    let mut tally = Tally::default();
    let options = MltOptions {
        direct,
        ..MltOptions::default()
    };
    let pilot = Pilot::new::<LANES, A>(world, &options, seed, &mut tally);
    let options = MltOptions {
        shares: pilot.shares(&options.shares),
        ..options
    };
    let budget = Budget::PerPixel(n);
    let r = mlt::<LANES, A>(world, &options, budget, seed, &Quiet, &mut tally);
    (r.image, r.mutations as f64)
}

/// Mean over pixels of the variance among the runs, over the squared mean.
fn relative_mse(runs: &[&Run]) -> f64 {
    let n = runs.len() as f64;
    let (mut variance, mut mean) = (0.0, 0.0);
    for i in 0..runs[0].image.len() {
        let sum: f64 = runs.iter().map(|r| r.image[i]).sum();
        let squares: f64 = runs.iter().map(|r| r.image[i].powi(2)).sum();
        variance += (squares - sum * sum / n) / (n - 1.0);
        mean += sum / n;
    }
    variance * runs[0].image.len() as f64 / (mean * mean)
}

fn main() {
    let number = |name: &str, default: u32| {
        std::env::var(name).map_or(default, |v| {
            v.parse()
                .unwrap_or_else(|_| panic!("{name}: expected a number, found “{v}”"))
        })
    };
    let path = std::env::var("METROLUX_SCENE").unwrap_or("scenes/cornell/cornell.pbrt".into());
    let mutations = f64::from(number("METROLUX_MUTATIONS", 64).max(1));
    let repeats = number("METROLUX_REPEATS", 16).max(3);
    let scene = scene(&path);
    let embree = embree(&scene);
    let world = World::new(&scene, &embree, scene.settings.max_depth);
    let pool = pool(0);
    let separate = |seed| chains(&world, Direct::Separate, seed, mutations);
    let in_chain = |seed| chains(&world, Direct::InChain, seed, mutations);
    let paths = |seed| {
        let mut tally = Tally::default();
        let budget = Budget::PerPixel(0.25 * mutations);
        let (image, samples) = pt::<LANES, _>(&world, budget, seed, &Quiet, &mut tally);
        let work = samples as f64 * image.len() as f64;
        (image, work)
    };
    let settings: [Setting; 3] = [
        ("mlt, direct light separate", &separate),
        ("mlt, direct light in the chain", &in_chain),
        ("pt", &paths),
    ];
    let mut runs: [Vec<Run>; 3] = Default::default();
    for seed in 0..=u64::from(repeats) {
        for ((_, render), runs) in settings.iter().zip(&mut runs) {
            let start = Instant::now();
            let (image, work) = pool.install(|| render(seed));
            let seconds = start.elapsed().as_secs_f64();
            // The first turn warms up.
            if seed > 0 {
                runs.push(Run {
                    image: image.iter().map(|xyz| xyz[1]).collect(),
                    seconds,
                    work,
                });
            }
        }
    }
    let [w, h] = scene.camera.resolution;
    println!(
        "{path}, {w}×{h}, depth {}, {} threads; median (least … most) of {repeats} seeds",
        scene.settings.max_depth,
        pool.current_num_threads()
    );
    for ((name, _), runs) in settings.iter().zip(&runs) {
        let all: Vec<&Run> = runs.iter().collect();
        let without = |i: usize| {
            let others: Vec<&Run> = all
                .iter()
                .enumerate()
                .filter(|r| r.0 != i)
                .map(|r| *r.1)
                .collect();
            relative_mse(&others).ln()
        };
        let n = all.len() as f64;
        let left: Vec<f64> = (0..all.len()).map(without).collect();
        let mean = left.iter().sum::<f64>() / n;
        let squares: f64 = left.iter().map(|l| (l - mean).powi(2)).sum();
        let error = ((n - 1.0) / n * squares).sqrt();
        let seconds = runs.iter().map(|r| r.seconds).sum::<f64>() / n;
        let mse = relative_mse(&all);
        println!(
            "{name}: {} M mutations or samples a second; relMSE {mse:.3e} in {seconds:.3} s; 1/(relMSE·s) {:.1} ± {:.0} %",
            spread(runs.iter().map(|r| 1e-6 * r.work / r.seconds)),
            1.0 / (mse * seconds),
            100.0 * error
        );
    }
}
