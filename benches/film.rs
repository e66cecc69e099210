//! Splats per second: bounded ones into 64 bits, those of any size into 128, and the price of a flush.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec2;
use metrolux::film::{Crop, Film, Filter, SplatBuffer, WideBuffer};
use metrolux::scene::{FilterKind, FilterSettings};
use std::hint::black_box;
use std::time::Duration;

const WIDTH: u32 = 640;
const HEIGHT: u32 = 360;
const SPLATS: usize = 50_000;

/// Raster points of a chain: a walk by a few pixels, now and then a leap.
fn points() -> Vec<Vec2> {
    let mut state = 1u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 * 2f32.powi(-24)
    };
    let size = Vec2::new(WIDTH as f32, HEIGHT as f32);
    let mut p = size * 0.5;
    (0..SPLATS)
        .map(|_| {
            p = match next() {
                u if u < 0.2 => Vec2::new(next(), next()) * size,
                _ => p + 8.0 * (Vec2::new(next(), next()) - 0.5),
            };
            p = p.clamp(Vec2::ZERO, size - 0.01);
            p
        })
        .collect()
}

fn filters() -> [(&'static str, Filter); 2] {
    let mitchell = FilterKind::Mitchell {
        b: 1.0 / 3.0,
        c: 1.0 / 3.0,
    };
    [("box", FilterKind::Box, 0.5), ("mitchell", mitchell, 2.0)].map(|(name, kind, r)| {
        let radius = [r; 2];
        (name, Filter::new(&FilterSettings { kind, radius }))
    })
}

fn film(c: &mut Criterion) {
    let crop = Crop::from([0, 0, WIDTH, HEIGHT]);
    let points = points();
    let mut group = c.benchmark_group("film");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .throughput(Throughput::Elements(SPLATS as u64));
    let mut film = Film::new(crop);
    for (name, filter) in filters() {
        let mut buffer = SplatBuffer::new(crop, filter.clone());
        group.bench_function(BenchmarkId::new("64 bits", name), |b| {
            b.iter(|| {
                for p in &points {
                    let added = buffer.splat(*p, black_box([0.4, 1.0, 0.3]), 0.5);
                    debug_assert!(added.is_ok());
                }
                if buffer.is_full() {
                    film.absorb(&mut buffer);
                }
            })
        });
        film.absorb(&mut buffer);
        let mut buffer = WideBuffer::new(crop, filter);
        group.bench_function(BenchmarkId::new("128 bits", name), |b| {
            b.iter(|| {
                for p in &points {
                    let added = buffer.splat(*p, black_box([40.0, 100.0, 30.0]));
                    debug_assert!(added.is_ok());
                }
            })
        });
        film.absorb_wide(&mut buffer);
    }
    // A flush with every pixel touched.
    let (_, filter) = filters()[0].clone();
    let mut buffer = SplatBuffer::new(crop, filter);
    group.throughput(Throughput::Elements(crop.pixels() as u64));
    group.bench_function("absorb, per pixel", |b| {
        b.iter_batched(
            || {
                for (x, y) in (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y))) {
                    let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                    buffer.splat(p, [1.0; 3], 1.0).expect("bounded");
                }
                buffer.clone()
            },
            |mut full| film.absorb(&mut full),
            criterion::BatchSize::LargeInput,
        )
    });
    group.finish();
    assert!(film.total()[1] > 0.0);
}

criterion_group!(benches, film);
criterion_main!(benches);
