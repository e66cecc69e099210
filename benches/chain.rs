//! Mutations per second on the Cornell box: depth 8, box filter, four lanes. Failed proposals count, as everywhere, so
//! what was constructed and accepted is printed beside.

mod common;
#[path = "common/paired.rs"]
mod paired;

use common::{embree, pool, scene, spread};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use metrolux::accel::Accel;
use metrolux::chain::{
    Chain, Direct, Mlt, MltOptions, Setting, Shares, Splat, replay, seed_group, stage,
};
use metrolux::mutation::Strategy;
use metrolux::path::{Sampler, Tally, World};
use metrolux::sampling::Rng;
use metrolux::scene::{FilterKind, Scene};
use paired::paired;
use std::hint::black_box;
use std::time::Duration;

/// Lanes of `--lanes auto`.
const LANES: usize = 4;

fn cornell() -> Scene {
    let scene = scene("scenes/cornell/cornell.pbrt");
    assert_eq!(scene.settings.max_depth, 8);
    assert_eq!(scene.settings.filter.kind, FilterKind::Box);
    scene
}

fn options(direct: Direct) -> MltOptions {
    MltOptions {
        direct,
        // Steps are measured, not seeding: one generation lasts for the whole bench.
        rounds_per_generation: u32::MAX,
        ..MltOptions::default()
    }
}

const MODES: [(&str, Direct); 2] = [
    ("direct separate", Direct::Separate),
    ("direct in chain", Direct::InChain),
];

/// Whole chains with their splats, on one and two threads.
fn threads(c: &mut Criterion) {
    const ROUNDS: u64 = 4;
    let scene = cornell();
    let embree = embree(&scene);
    let world = World::new(&scene, &embree, scene.settings.max_depth);
    let mut group = c.benchmark_group("mutations");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    for (name, direct) in MODES {
        let options = options(direct);
        group.throughput(Throughput::Elements(ROUNDS * options.mutations_per_round()));
        let mut run = Mlt::<_, LANES>::new(&world, options, 1);
        let pools = [pool(1), pool(2)];
        pools[1].install(|| run.run(64));
        for (n, pool) in pools.iter().enumerate() {
            group.bench_function(format!("{name}, threads {}", n + 1), |b| {
                b.iter(|| pool.install(|| run.run(ROUNDS)))
            });
        }
        let stats = run.stats();
        eprintln!("{name}: {}", told(&stats.strategies));
        // A run that criterion's filter left out did not warm up, but pairs do so themselves.
        let mut other = Mlt::<_, LANES>::new(&world, options, 1);
        let runs = paired(
            7,
            || pools[0].install(|| run.run(16)),
            || pools[1].install(|| other.run(16)),
        );
        eprintln!(
            "{name}: two threads are {} times as fast as one, in {} times the processor time",
            spread(runs.iter().map(|(one, two)| one.wall / two.wall)),
            spread(runs.iter().map(|(one, two)| two.cpu / one.cpu))
        );
    }
    group.finish();
}

fn told(strategies: &[metrolux::chain::StrategyStats; Strategy::ALL.len()]) -> String {
    let each = Strategy::ALL.iter().zip(strategies).map(|(s, n)| {
        let percent = |part: u64| 100.0 * part as f64 / n.proposed.max(1) as f64;
        format!(
            "{} {:.1} % constructed, {:.1} % accepted",
            s.name(),
            percent(n.constructed),
            percent(n.accepted)
        )
    });
    each.collect::<Vec<_>>().join("; ")
}

/// Chains of all groups after a while of default steps.
fn chains<A: Accel>(world: &World<A>, options: &MltOptions) -> Vec<Chain<LANES>> {
    let set = Setting::new(world, options);
    let mut sampler = Sampler::<LANES>::new(world.max_edges);
    let mut chains = Vec::new();
    for group in 0..options.groups {
        let batch = seed_group::<LANES, A>(&set, 1, 0, group, &mut Tally::default());
        for (c, seed) in batch.seeds.iter().enumerate() {
            if replay(
                world,
                options,
                1,
                0,
                group,
                *seed,
                &mut sampler,
                &mut Tally::default(),
            ) {
                let rng = Rng::new(1, stage::CHAIN, group, c as u32);
                let mut chain = Chain::new(world.max_edges, rng);
                let entries = options.entries(&world.lens, 1, 0, group, c as u32);
                if let Some(e) = entries {
                    chain.stratify(e);
                }
                let (path, pool) = sampler.joined();
                chain.start(path, pool);
                for _ in 0..500 {
                    chain.step(&set, &mut |s: Splat| {
                        black_box(s);
                    });
                }
                chains.push(chain);
            }
        }
    }
    chains
}

/// One strategy alone, on the chains whose paths it suits: a strategy that keeps the kind of a path suits them for ever.
fn strategies(c: &mut Criterion) {
    const STEPS: u64 = 32;
    let scene = cornell();
    let embree = embree(&scene);
    let world = World::new(&scene, &embree, scene.settings.max_depth);
    let mut group = c.benchmark_group("strategy");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    for (name, direct) in MODES {
        let options = options(direct);
        for strategy in Strategy::ALL {
            let mut chains = chains(&world, &options);
            chains.retain(|c| strategy.suits(world.dispersive, &c.x, c.pool()));
            if chains.is_empty() {
                continue;
            }
            let alone = MltOptions {
                shares: Shares::only(strategy, 0.0),
                ..options
            };
            let set = Setting::new(&world, &alone);
            let steps = STEPS * chains.len() as u64;
            group.throughput(Throughput::Elements(steps));
            group.bench_function(format!("{}, {name}", strategy.name()), |b| {
                b.iter(|| {
                    let mut light = 0.0;
                    for chain in &mut chains {
                        for _ in 0..STEPS {
                            chain.step(&set, &mut |s: Splat| light += s.weight);
                        }
                    }
                    black_box(light)
                })
            });
        }
    }
    group.finish();
}

criterion_group!(benches, threads, strategies);
criterion_main!(benches);
