//! Rays per second: Embree through the trait against a bare C loop over the same rays, which sets the mode for denormal
//! numbers once instead of for each ray, and obvhs beside it.
//!
//! Without more, the rays are random ones in a soup of a million random triangles;
//! `METROLUX_BENCH_TRIANGLES=N` sets its size. `METROLUX_RAYS=FILE` replays a recorded run instead
//! (see `metrolux::accel::record`; the file holds the geometry too).

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use metrolux::accel::record::{self, Kind};
use metrolux::accel::{Accel, Embree, EmbreeOptions, Obvhs, Ray, closest};
use metrolux::scene::{Geometry, NONE, PrimId, Shape};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// SplitMix64, uniform in [0, 1).
struct Rng(u64);

impl Rng {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 * 2f32.powi(-24)
    }

    fn vec3(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

/// `n` triangles in the unit cube, of about the size of the gaps between them.
fn soup(n: usize) -> Geometry {
    let mut rng = Rng(1);
    let size = (n as f32).powf(-1.0 / 3.0);
    let mut positions = Vec::with_capacity(3 * n + 1);
    for _ in 0..n {
        let center = rng.vec3();
        positions.extend((0..3).map(|_| center + (rng.vec3() - 0.5) * size));
    }
    positions.push(Vec3::ZERO);
    let corner = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2];
    Geometry {
        positions,
        triangles: (0..n as u32).map(corner).collect(),
        prim_shape: vec![0; n],
        prim_light: vec![NONE; n],
        shapes: vec![Shape {
            material: 0,
            has_normals: false,
            has_uvs: false,
        }],
        ..Geometry::default()
    }
}

fn random_rays(n: usize, kind: Kind) -> Vec<(Ray, Kind)> {
    let mut rng = Rng(2);
    (0..n)
        .map(|_| {
            let (o, target) = (rng.vec3(), rng.vec3());
            let t_max = match kind {
                Kind::Closest => f32::INFINITY,
                Kind::Any => 1.0,
            };
            let d = target - o;
            (Ray { o, d, t_max }, kind)
        })
        .collect()
}

/// What the bare loop sums, by way of the trait.
fn by_trait(accel: &impl Accel, rays: &[Ray], kinds: &[u8]) -> u64 {
    rays.iter()
        .zip(kinds)
        .map(|(r, k)| match k {
            0 => accel.nearest(r).unwrap_or(PrimId::NONE).raw(),
            _ => accel.occluded(r) as u64,
        })
        .fold(0, u64::wrapping_add)
}

/// Time of `b` over time of `a`, less 1: the two take turns on small pieces of the work, so that both meet the same
/// weather, and the quickest of many turns at each piece counts.
fn overhead(
    pieces: usize,
    mut a: impl FnMut(usize) -> u64,
    mut b: impl FnMut(usize) -> u64,
) -> f64 {
    const TURNS: usize = 15;
    let (mut sum_a, mut sum_b) = (0.0, 0.0);
    for piece in 0..pieces {
        let (mut best_a, mut best_b) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..TURNS {
            let start = Instant::now();
            black_box(a(piece));
            best_a = best_a.min(start.elapsed().as_secs_f64());
            let start = Instant::now();
            black_box(b(piece));
            best_b = best_b.min(start.elapsed().as_secs_f64());
        }
        sum_a += best_a;
        sum_b += best_b;
    }
    sum_b / sum_a - 1.0
}

fn measure(c: &mut Criterion, name: &str, geometry: &Geometry, rays: &[(Ray, Kind)]) {
    let kinds: Vec<u8> = rays.iter().map(|(_, k)| *k as u8).collect();
    let rays: Vec<Ray> = rays.iter().map(|(r, _)| *r).collect();
    let embree = Embree::new(geometry, EmbreeOptions::default()).expect("Embree builds");
    let fast = EmbreeOptions {
        robust: false,
        ..EmbreeOptions::default()
    };
    let fast = Embree::new(geometry, fast).expect("Embree builds");
    let obvhs = Obvhs::new(geometry);
    eprintln!(
        "{name}: {} rays, {} primitives; {}: {:.1} MB, built in {:.2} s; obvhs: {:.1} MB",
        rays.len(),
        geometry.prim_count(),
        embree.name(),
        embree.memory_bytes() as f64 * 1e-6,
        embree.build_time().as_secs_f64(),
        obvhs.memory_bytes() as f64 * 1e-6,
    );

    const PIECE: usize = 500;
    let span = |i: usize| i * PIECE..(i + 1) * PIECE;
    let cost = overhead(
        (rays.len() / PIECE).min(200),
        |i| embree.replay(&rays[span(i)], &kinds[span(i)], true),
        |i| by_trait(&embree, &rays[span(i)], &kinds[span(i)]),
    );
    eprintln!(
        "{name}: the trait costs {:+.2} % over the bare C loop",
        100.0 * cost
    );

    let cost = overhead(
        (rays.len() / PIECE).min(200),
        |i| embree.replay(&rays[span(i)], &kinds[span(i)], true),
        |i| embree.replay(&rays[span(i)], &kinds[span(i)], false),
    );
    eprintln!(
        "{name}: where denormal numbers are kept the bare loop takes {:+.2} %",
        100.0 * cost
    );

    let mut group = c.benchmark_group(name);
    group
        .throughput(Throughput::Elements(rays.len() as u64))
        .sample_size(20)
        .warm_up_time(Duration::from_secs(1))
        .measurement_time(Duration::from_secs(8));
    group.bench_function("bare C loop", |b| {
        b.iter(|| black_box(embree.replay(black_box(&rays), &kinds, true)))
    });
    group.bench_function("trait", |b| {
        b.iter(|| black_box(by_trait(&embree, black_box(&rays), &kinds)))
    });
    group.bench_function("trait, not robust", |b| {
        b.iter(|| black_box(by_trait(&fast, black_box(&rays), &kinds)))
    });
    group.bench_function("obvhs", |b| {
        b.iter(|| black_box(by_trait(&obvhs, black_box(&rays), &kinds)))
    });
    if kinds.iter().all(|k| *k == 0) {
        group.bench_function("canonical hit", |b| {
            b.iter(|| {
                let hits = rays.iter().filter_map(|r| closest(&embree, r));
                black_box(hits.map(|h| h.t as f64).sum::<f64>())
            })
        });
    }
    group.finish();
}

fn rays(c: &mut Criterion) {
    let env = |name| std::env::var(name).ok();
    if let Some(path) = env("METROLUX_RAYS") {
        let file = std::fs::File::open(&path).expect("the file of METROLUX_RAYS");
        let (geometry, rays) = record::read(std::io::BufReader::new(file)).expect("a ray file");
        measure(c, "recorded", &geometry, &rays);
        return;
    }
    let n = env("METROLUX_BENCH_TRIANGLES").map_or(1_000_000, |v| v.parse().expect("a number"));
    let geometry = soup(n);
    measure(
        c,
        "closest",
        &geometry,
        &random_rays(100_000, Kind::Closest),
    );
    measure(c, "visibility", &geometry, &random_rays(100_000, Kind::Any));
}

criterion_group!(benches, rays);
criterion_main!(benches);
