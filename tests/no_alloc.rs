//! A Markov step allocates nothing: vertices live in fixed storage.

use metrolux::accel::{Embree, EmbreeOptions};
use metrolux::chain::{Chain, MltOptions, Setting, Shares, replay, seed_group};
use metrolux::path::{Sampler, Tally, World};
use metrolux::sampling::Rng;
use metrolux::scene::load::{LoadOptions, load_str};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    /// Allocations of this thread; the test harness has threads of its own.
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, counted.
struct Counting;

// SAFETY: every call goes to `System` unchanged; the counter is a plain thread-local that itself never allocates.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller's promises about `layout` are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        // SAFETY: `p` came from `System` with this layout.
        unsafe { System.dealloc(p, layout) }
    }

    unsafe fn realloc(&self, p: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: `p` came from `System` with this layout; `size` is the caller's.
        unsafe { System.realloc(p, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A room with glass, metal and a coat, seen through an aperture.
const ROOM: &str = r#"
Film "rgb" "integer xresolution" 16 "integer yresolution" 16
LookAt 0.5 0.45 0.03  0.5 0.45 1  0 1 0
Camera "perspective" "float fov" 75 "float lensradius" 0.02 "float focaldistance" 0.6
WorldBegin
Material "coateddiffuse" "rgb reflectance" [ 0.6 0.5 0.4 ] "float roughness" 0
Shape "trianglemesh" "point3 P" [ 0 0 0  1 0 0  1 0 1  0 0 1  0 1 0  1 1 0  1 1 1  0 1 1 ]
  "integer indices" [ 0 1 2 0 2 3 4 5 6 4 6 7 2 3 7 2 7 6 0 1 5 0 5 4 0 3 7 0 7 4 1 2 6 1 6 5 ]
Material "dielectric" "float eta" 1.5
AttributeBegin
  Translate 0.3 0.28 0.55
  Shape "sphere" "float radius" 0.18
AttributeEnd
Material "conductor" "float roughness" 0.2
AttributeBegin
  Translate 0.7 0.28 0.55
  Shape "sphere" "float radius" 0.18
AttributeEnd
AreaLightSource "diffuse" "rgb L" [ 12 10 7 ]
Material "diffuse"
Shape "trianglemesh" "point3 P" [ 0.3 0.95 0.35  0.6 0.95 0.35  0.6 0.95 0.65  0.3 0.95 0.65 ]
  "integer indices" [ 0 1 2 0 2 3 ]
"#;

/// Allocations during steps of a chain, and the steps accepted.
fn allocations<const N: usize>() -> (u64, u64) {
    let scene = load_str(ROOM, std::path::Path::new("."), &LoadOptions::default()).unwrap();
    let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).unwrap();
    let world = World::new(&scene, &accel, 7);
    let options = MltOptions {
        shares: Shares::for_scene(&scene),
        ..MltOptions::default()
    };
    assert!(options.shares.0.iter().all(|s| *s > 0.0));
    let mut tally = Tally::default();
    let set = Setting::new(&world, &options);
    let batch = seed_group::<N, _>(&set, 1, 0, 0, &mut tally);
    let mut sampler = Sampler::<N>::new(world.max_edges);
    assert!(replay(
        &world,
        &options,
        1,
        0,
        0,
        batch.seeds[0],
        &mut sampler,
        &mut tally
    ));
    let mut chain = Chain::<N>::new(world.max_edges, Rng::new(1, 0, 0, 0));
    let (path, pool) = sampler.joined();
    let entries = options.entries(&world.lens, 1, 0, 0, 0);
    chain.stratify(entries.expect("stratified by default"));
    chain.start(path, pool);
    let mut light = 0.0f64;
    let mut sink = |s: metrolux::chain::Splat| light += s.weight as f64;
    for _ in 0..1000 {
        chain.step(&set, &mut sink);
    }
    let before = COUNT.get();
    for _ in 0..100_000 {
        chain.step(&set, &mut sink);
    }
    chain.flush(&mut sink);
    let after = COUNT.get();
    assert!((light - 101_000.0).abs() < 1.0, "{light}");
    (
        after - before,
        chain.stats.strategies.iter().map(|s| s.accepted).sum(),
    )
}

#[test]
fn a_markov_step_allocates_nothing() {
    // The counter counts.
    let before = COUNT.get();
    drop(std::hint::black_box(Box::new(1u8)));
    assert!(COUNT.get() > before);
    for (count, accepted) in [allocations::<4>(), allocations::<1>()] {
        assert!(accepted > 10_000, "only {accepted} steps accepted");
        assert_eq!(count, 0);
    }
}
