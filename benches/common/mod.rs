//! Two pieces of work measured against each other on a machine that others use too.

use metrolux::accel::{Embree, EmbreeOptions};
use metrolux::scene::Scene;
use metrolux::scene::load::{LoadOptions, load_scene};
use std::path::Path;
use std::time::Instant;

/// Reads a scene; a relative path starts at the package.
pub fn scene(path: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    load_scene(
        &path,
        &LoadOptions {
            lenient: true,
            ..LoadOptions::default()
        },
    )
    .unwrap_or_else(|e| panic!("{e}"))
}

/// Embree as a render uses it.
pub fn embree(scene: &Scene) -> Embree<'_> {
    Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree builds")
}

/// A pool of so many threads.
pub fn pool(threads: usize) -> rayon::ThreadPool {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    builder.build().expect("threads start")
}

/// Wall time and processor time of one run, in seconds. Other people's load lengthens the first much, the second little.
#[derive(Clone, Copy)]
pub struct Cost {
    pub wall: f64,
    pub cpu: f64,
}

impl Cost {
    fn of(work: &mut dyn FnMut()) -> Self {
        let (start, cpu) = (Instant::now(), processor_seconds());
        work();
        Self {
            wall: start.elapsed().as_secs_f64(),
            cpu: processor_seconds() - cpu,
        }
    }
}

/// Runs both in turn, so often, after one turn that does not count. Who begins alternates.
pub fn paired(repeats: usize, mut a: impl FnMut(), mut b: impl FnMut()) -> Vec<(Cost, Cost)> {
    a();
    b();
    let mut turn = |i: usize| {
        if i.is_multiple_of(2) {
            let first = Cost::of(&mut a);
            (first, Cost::of(&mut b))
        } else {
            let first = Cost::of(&mut b);
            (Cost::of(&mut a), first)
        }
    };
    (0..repeats).map(&mut turn).collect()
}

/// "median (least … most)" of some figures.
pub fn spread(figures: impl Iterator<Item = f64>) -> String {
    let mut v: Vec<f64> = figures.collect();
    v.sort_by(f64::total_cmp);
    let n = v.len();
    let median = 0.5 * (v[(n - 1) / 2] + v[n / 2]);
    format!("{median:.3} ({:.3} … {:.3})", v[0], v[n - 1])
}

/// Processor time of all threads of this process that are alive; 0 where the system does not tell.
fn processor_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let nanoseconds = tasks.flatten().filter_map(|t| {
        let text = std::fs::read_to_string(t.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    nanoseconds.sum::<f64>() * 1e-9
}
