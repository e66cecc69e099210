//! Scenes and figures of the benches.

use metrolux::accel::{Embree, EmbreeOptions};
use metrolux::scene::Scene;
use metrolux::scene::load::{LoadOptions, load_scene};
use std::path::Path;

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

/// "median (least … most)" of some figures.
pub fn spread(figures: impl Iterator<Item = f64>) -> String {
    let mut v: Vec<f64> = figures.collect();
    v.sort_by(f64::total_cmp);
    let n = v.len();
    let median = 0.5 * (v[(n - 1) / 2] + v[n / 2]);
    format!("{median:.3} ({:.3} … {:.3})", v[0], v[n - 1])
}
