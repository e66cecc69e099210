//! What the Embree backend promises beside answers: the same build every time, honest words, no bad memory.

use super::super::testing::{Rng, geometry, icosphere, mixed};
use super::super::*;
use super::*;

/// FNV-1a over the answers to many rays.
fn hash(a: &impl Accel, rays: &[Ray]) -> u64 {
    let mut h = 0xcbf2_9ce4_8422_2325u64;
    for ray in rays {
        let word = a.nearest(ray).map_or(0xffff_ffff, PrimId::raw) | (a.occluded(ray) as u64) << 32;
        h = (h ^ word).wrapping_mul(0x0100_0000_01b3);
    }
    h
}

#[test]
fn builds_answer_the_same_whatever_the_number_of_build_threads() {
    let mut rng = Rng(17);
    for g in [mixed(&mut rng, 30_000, 50), icosphere(5)] {
        let mut rays: Vec<Ray> = (0..20_000).map(|_| random_ray(&mut rng)).collect();
        // Rays at corners, where faces tie.
        let corners = g.positions.len() - 1;
        rays.extend((0..20_000).map(|i| {
            let o = rng.direction() * 0.3;
            to_infinity(o, g.positions[i % corners] - o)
        }));
        for quality in [Quality::Low, Quality::Medium, Quality::High] {
            let hashes = [1, 2, 7].map(|threads| {
                let options = EmbreeOptions {
                    threads,
                    quality,
                    ..EmbreeOptions::default()
                };
                hash(&Embree::new(&g, options).expect("builds"), &rays)
            });
            assert_eq!(hashes[0], hashes[1], "{quality:?}");
            assert_eq!(hashes[0], hashes[2], "{quality:?}");
        }
    }
}

#[test]
fn obvhs_builds_the_same_whatever_the_number_of_threads() {
    let mut rng = Rng(34);
    let g = mixed(&mut rng, 30_000, 50);
    let rays: Vec<Ray> = (0..20_000).map(|_| random_ray(&mut rng)).collect();
    let hashes = [1, 2, 7].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let built = pool.expect("threads start").install(|| Obvhs::new(&g));
        (hash(&built, &rays), built.memory_bytes())
    });
    assert_eq!(hashes[0], hashes[1]);
    assert_eq!(hashes[0], hashes[2]);
}

#[test]
fn a_build_tells_how_far_it_is() {
    let g = icosphere(6);
    let heard = std::sync::Mutex::new(Vec::new());
    let tell = |done: f64| heard.lock().unwrap_or_else(|e| e.into_inner()).push(done);
    Embree::build(&g, EmbreeOptions::default(), &tell).expect("builds");
    let heard = heard.into_inner().expect("no panic");
    assert!(
        heard.iter().all(|d| (0.0..=1.0 + 1e-9).contains(d)),
        "{heard:?}"
    );
    assert!(heard.iter().any(|d| *d > 0.5), "{heard:?}");
}

/// Denormal numbers do not decide what Embree answers.
#[test]
fn denormal_numbers_do_not_change_the_answers() {
    let mut rng = Rng(39);
    let g = icosphere(4);
    let a = embree(&g);
    let rays: Vec<Ray> = (0..20_000).map(|_| random_ray(&mut rng)).collect();
    let kinds: Vec<u8> = (0..rays.len()).map(|i| (i % 2) as u8).collect();
    assert_eq!(
        a.replay(&rays, &kinds, false),
        a.replay(&rays, &kinds, true)
    );
}

#[test]
fn an_empty_scene_answers_nothing() {
    let g = geometry(vec![], vec![], vec![]);
    let ray = to_infinity(Vec3::ZERO, Vec3::X);
    let (a, b) = (embree(&g), Obvhs::new(&g));
    assert_eq!((a.nearest(&ray), b.nearest(&ray)), (None, None));
    assert!(!a.occluded(&ray) && !b.occluded(&ray));
}

#[test]
fn embree_says_what_it_is_and_holds() {
    let g = icosphere(3);
    let a = embree(&g);
    let version = a.version();
    assert!(
        version.starts_with("3.") || version.starts_with("4."),
        "{version}"
    );
    assert!(a.memory_bytes() > g.triangles.len() * 16);
    assert!(a.peak_bytes() >= a.memory_bytes() && !a.isa().is_empty());
    assert_eq!(a.check(), Ok(()));
    assert!(a.build_time().as_nanos() > 0);
}

#[test]
fn geometry_that_reads_out_of_bounds_is_refused() {
    let spare_missing = Geometry {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Geometry::default()
    };
    let infinite = geometry(
        vec![Vec3::ZERO, Vec3::X, Vec3::INFINITY],
        vec![[0, 1, 2]],
        vec![],
    );
    for g in [spare_missing, infinite] {
        let error = Embree::new(&g, EmbreeOptions::default()).err();
        assert!(matches!(error, Some(EmbreeError::Geometry(_))), "{error:?}");
    }
}

#[test]
fn the_bare_loop_gives_the_sum_of_the_answers() {
    let mut rng = Rng(18);
    let g = mixed(&mut rng, 200, 20);
    let a = embree(&g);
    let rays: Vec<Ray> = (0..1000).map(|_| random_ray(&mut rng)).collect();
    let kinds: Vec<u8> = (0..1000).map(|i| (i % 2) as u8).collect();
    let expected: u64 = rays
        .iter()
        .zip(&kinds)
        .map(|(r, k)| match k {
            0 => a.nearest(r).unwrap_or(PrimId::NONE).raw(),
            _ => a.occluded(r) as u64,
        })
        .fold(0, u64::wrapping_add);
    assert_eq!(a.replay(&rays, &kinds, false), expected);
}

#[test]
fn the_librarys_own_words_reach_the_caller() {
    let geometry = icosphere(0);
    let built = Embree::new(&geometry, EmbreeOptions::default()).expect("builds");
    // No such kind of geometry.
    let Err(EmbreeError::Refused(text)) = built.scene.geometry(9999) else {
        panic!("accepted");
    };
    assert!(text.contains("code"), "{text}");
    assert_eq!(built.check(), Ok(()));
}

/// Embree works with denormal numbers counted as 0, in its queries and its builds; Rust never does, be it behind a query or
/// in what C calls.
#[test]
fn rust_keeps_its_denormal_numbers() {
    let is_kept = || std::hint::black_box(f32::MIN_POSITIVE) * std::hint::black_box(0.5) > 0.0;
    let mut rng = Rng(43);
    let g = mixed(&mut rng, 20_000, 2000);
    let told = std::sync::atomic::AtomicU32::new(0);
    let built = Embree::build(&g, EmbreeOptions::default(), &|_| {
        assert!(is_kept());
        told.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    });
    let built = built.expect("builds");
    assert!(told.into_inner() > 0 && is_kept());
    let rays: Vec<Ray> = (0..100).map(|_| random_ray(&mut rng)).collect();
    for ray in &rays {
        built.nearest(ray);
        assert!(is_kept());
        built.occluded(ray);
        assert!(is_kept());
    }
    for flush in [false, true] {
        built.replay(&rays, &[0; 100], flush);
        assert!(is_kept());
    }
}

/// Rays whose numbers are denormal, wholly or in part: both backends name the same, though one of them counts them as 0.
#[test]
fn denormal_rays_are_the_same_on_both_backends() {
    let mut rng = Rng(44);
    // No edge lies in a plane of coordinates, where faces would tie.
    let g = mixed(&mut rng, 1000, 50);
    let (a, b) = (embree(&g), Obvhs::new(&g));
    for i in 0..20_000 {
        let mut ray = random_ray(&mut rng);
        let tiny = 1e-39 * (rng.next() - 0.5);
        match i % 4 {
            // Along an axis but for this; from a plane of coordinates but for this.
            0 => ray.d[i % 3] = tiny,
            1 => ray.o[i % 3] = tiny,
            2 => (ray.d[i % 3], ray.o[i % 3]) = (tiny, tiny),
            _ => ray.t_max = tiny.abs(),
        }
        let same = a.nearest(&ray) == b.nearest(&ray) && a.occluded(&ray) == b.occluded(&ray);
        assert!(same, "{ray:?}: {:?} {:?}", a.nearest(&ray), b.nearest(&ray));
    }
}
