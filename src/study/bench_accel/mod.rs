//! Embree against obvhs on the same rays.

pub mod contender;
pub mod machine;
pub mod measure;
mod page;
pub mod report;
pub mod sets;
pub mod terrain;
pub mod thicket;

use crate::accel::EmbreeError;
use crate::scene::Geometry;
use crate::study::process::{forget_peak, peak_bytes, resident_bytes};
use contender::{Built, Contender};
use measure::{Patience, Spread, measure};
use report::{BuildRow, Report, SpeedRow};
use sets::RaySet;

/// Repeats of a build that takes less than [`LONG`] seconds.
const BUILDS: usize = 3;
/// A build this long is made once.
const LONG: f64 = 2.0;

/// What is measured.
pub struct Plan {
    /// Who takes part; ratios are to the first.
    pub contenders: Vec<Contender>,
    /// Numbers of threads, 1 first.
    pub threads: Vec<usize>,
    /// How long.
    pub patience: Patience,
}

/// Why there are no figures.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A backend refused.
    #[error(transparent)]
    Accel(#[from] EmbreeError),
    /// Threads could not be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Builds every contender over a geometry, and over the same without instances if that is given, and times it on every
/// set. `say` gets a line on what is done now; `peak` tells the memory a build takes in a process of its own, where
/// nothing was freed before that it could take again (the flag: without instances).
///
/// # Errors
/// A backend that refuses, threads that cannot be started.
pub fn bench(
    name: &str,
    (geometry, flat): (&Geometry, Option<&Geometry>),
    sets: &[RaySet],
    plan: &Plan,
    report: &mut Report,
    say: &dyn Fn(String),
    peak: &dyn Fn(&Contender, usize, bool) -> Option<u64>,
) -> Result<(), BenchError> {
    let geometries = [(geometry, ""), (flat.unwrap_or(geometry), "-flat")];
    let geometries = &geometries[..if flat.is_some() { 2 } else { 1 }];
    for (g, _) in geometries {
        crate::accel::surface::prepare(g);
    }
    let pools: Vec<rayon::ThreadPool> = plan
        .threads
        .iter()
        .map(|n| rayon::ThreadPoolBuilder::new().num_threads(*n).build())
        .collect::<Result<_, _>>()?;
    let (mut keys, mut built) = (Vec::new(), Vec::new());
    let each = plan.contenders.iter();
    for (contender, (g, suffix)) in each.flat_map(|c| geometries.iter().map(move |g| (c, g))) {
        let key = contender.key() + suffix;
        say(format!("{name}: building {key}"));
        for (pool, threads) in pools.iter().zip(&plan.threads) {
            let (mut row, last) = builds(name, contender, g, pool, *threads)?;
            row.contender = key.clone();
            row.peak_bytes = peak(contender, *threads, !suffix.is_empty());
            report.builds.push(row);
            if *threads == *plan.threads.last().expect("at least one") {
                built.push(last);
            }
        }
        keys.push(key);
    }
    for set in sets {
        let mut alone = Vec::new();
        for (pool, threads) in pools.iter().zip(&plan.threads) {
            say(format!("{name}: {} on {threads} threads", set.title()));
            let speeds = measure(&built, set, pool, plan.patience);
            if alone.is_empty() {
                alone = speeds
                    .iter()
                    .map(|s| s.rate.median / *threads as f64)
                    .collect();
            }
            for (i, speed) in speeds.into_iter().enumerate() {
                report.speeds.push(SpeedRow {
                    scene: name.to_owned(),
                    set: set.title(),
                    contender: keys[i].clone(),
                    threads: *threads,
                    rays: set.rays.len(),
                    hits: speed.hits,
                    rays_per_second: speed.rate,
                    ratio: speed.ratio,
                    efficiency: speed.rate.median / (*threads as f64 * alone[i]),
                });
            }
        }
    }
    Ok(())
}

/// Builds a few times; the row and the last.
fn builds<'a>(
    name: &str,
    contender: &Contender,
    geometry: &'a Geometry,
    pool: &rayon::ThreadPool,
    threads: usize,
) -> Result<(BuildRow, Built<'a>), BenchError> {
    let mut times = Vec::new();
    loop {
        let built = pool.install(|| contender.build(geometry, threads))?;
        let seconds = built.build_time().as_secs_f64();
        times.push(seconds);
        if times.len() >= BUILDS || seconds > LONG {
            let primitives = geometry.parts().map(Geometry::prim_count).sum::<usize>();
            let row = BuildRow {
                scene: name.to_owned(),
                contender: contender.key(),
                threads,
                primitives,
                seconds: Spread::of(times),
                bytes: built.bytes(),
                bytes_per_primitive: built.bytes() as f64 / primitives.max(1) as f64,
                peak_bytes: None,
            };
            return Ok((row, built));
        }
    }
}

/// Builds once; by how much resident memory rose at most, bytes. `None` where the system does not tell.
///
/// # Errors
/// As [`bench`].
pub fn peak_of_build(
    contender: &Contender,
    geometry: &Geometry,
    threads: usize,
) -> Result<Option<u64>, BenchError> {
    crate::accel::surface::prepare(geometry);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()?;
    let told = forget_peak();
    let before = resident_bytes();
    let built = pool.install(|| contender.build(geometry, threads))?;
    let most = peak_bytes().saturating_sub(before);
    drop(built);
    Ok(told.then_some(most))
}
