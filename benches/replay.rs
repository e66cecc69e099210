//! What a Metropolis render costs over its rays: its time over the time to replay exactly the same rays through bare
//! Embree calls on as many threads.
//!
//! `METROLUX_SCENE=FILE` (scenes/ajar/ajar.pbrt), `METROLUX_THREADS=N` (one per core), `METROLUX_ROUNDS=R` (64; a round
//! is 16 384 mutations) and `METROLUX_REPEATS=K` (5) change what is measured. Loading, building and output are outside;
//! seeding and the direct pass are inside. A generation is 2048 rounds: fewer give seeding, which is printed with the
//! direct pass as what the chains did not trace, too large a part.
//!
//! A render repeats itself bit for bit, so its rays are recorded once and render and replay then take turns. The ratio
//! of wall times is what the issue of speed is about; that of processor times says the same with less noise where other
//! programs run.

mod common;
#[path = "common/paired.rs"]
mod paired;

use common::{embree, pool, scene, spread};
use metrolux::accel::{Accel, Embree, Ray, Recorder};
use metrolux::chain::MltOptions;
use metrolux::integrator::{Budget, MltResult, Quiet, mlt};
use metrolux::path::{Tally, World};
use metrolux::scene::Scene;
use paired::paired;
use rayon::prelude::*;
use std::hint::black_box;

/// Rays one thread replays at a time: small enough to share the work evenly, large enough to keep what lies near
/// together.
const PIECE: usize = 4096;

fn render<A: Accel>(scene: &Scene, accel: &A, rounds: u64) -> MltResult {
    let world = World::new(scene, accel, scene.settings.max_depth);
    let (options, budget) = (MltOptions::default(), Budget::Rounds(rounds));
    mlt::<4, A>(&world, &options, budget, 1, &Quiet, &mut Tally::default())
}

fn replay(embree: &Embree, rays: &[Ray], kinds: &[u8]) -> u64 {
    let pieces = rays.par_chunks(PIECE).zip(kinds.par_chunks(PIECE));
    pieces.map(|(r, k)| embree.replay(r, k, false)).sum()
}

fn main() {
    let env = |name: &str| std::env::var(name).ok();
    let number = |name: &str, default: u64| {
        env(name).map_or(default, |v| {
            v.parse()
                .unwrap_or_else(|_| panic!("{name}: expected a number, found “{v}”"))
        })
    };
    let path = env("METROLUX_SCENE").unwrap_or_else(|| "scenes/ajar/ajar.pbrt".into());
    let rounds = number("METROLUX_ROUNDS", 64).max(1);
    let repeats = number("METROLUX_REPEATS", 5).max(1) as usize;
    let pool = pool(number("METROLUX_THREADS", 0) as usize);
    let scene = scene(&path);
    let embree = embree(&scene);
    let recorder = Recorder::new(&embree, usize::MAX);
    let result = pool.install(|| render(&scene, &recorder, rounds));
    let (rays, kinds): (Vec<Ray>, Vec<u8>) = recorder
        .rays()
        .into_iter()
        .map(|(r, k)| (r, k as u8))
        .unzip();
    drop(recorder);
    let visibility = kinds.iter().filter(|k| **k == 1).count() as f64;
    let chains = result.stats.tally;
    let by_chains = chains.rays_closest + chains.rays_visibility;
    println!(
        "{path} at {}x{}: {:.2} M mutations, {:.2} M rays ({:.0} % visibility, {:.0} % by the chains), {} threads, {}",
        scene.camera.resolution[0],
        scene.camera.resolution[1],
        result.mutations as f64 * 1e-6,
        rays.len() as f64 * 1e-6,
        100.0 * visibility / rays.len() as f64,
        100.0 * by_chains as f64 / rays.len() as f64,
        pool.current_num_threads(),
        embree.name(),
    );
    let runs = paired(
        repeats,
        || drop(black_box(pool.install(|| render(&scene, &embree, rounds)))),
        || {
            black_box(pool.install(|| replay(&embree, &rays, &kinds)));
        },
    );
    println!("median (least … most) of {repeats} turns");
    println!(
        "render, s:              {}",
        spread(runs.iter().map(|r| r.0.wall))
    );
    println!(
        "bare rays, s:           {}",
        spread(runs.iter().map(|r| r.1.wall))
    );
    println!(
        "ratio of wall times:    {}",
        spread(runs.iter().map(|(a, b)| a.wall / b.wall))
    );
    println!(
        "ratio of processor times: {}",
        spread(runs.iter().map(|(a, b)| a.cpu / b.cpu))
    );
}
