//! The promises of the room, kept by both backends: the same answers, no leaks, no ray that meets the surface it
//! leaves, at any scale.

use super::checked::same_place;
use super::testing::{Rng, geometry, icosphere, mixed, scaled, soup};
use super::*;
use glam::DVec3;

fn embree(geometry: &Geometry) -> Embree<'_> {
    Embree::new(geometry, EmbreeOptions::default()).expect("builds")
}

fn to_infinity(o: Vec3, d: Vec3) -> Ray {
    Ray {
        o,
        d,
        t_max: f32::INFINITY,
    }
}

/// A ray from in or around the unit cube into it.
fn random_ray(rng: &mut Rng) -> Ray {
    let (o, target) = (rng.vec3() * 2.0 - 0.5, rng.vec3());
    to_infinity(o, target - o)
}

#[test]
fn backends_agree_on_triangles_spheres_and_disks() {
    let mut rng = Rng(10);
    let g = mixed(&mut rng, 1000, 200);
    let (a, b) = (embree(&g), Obvhs::new(&g));
    let (mut hits, mut ties, mut shadows) = (0, 0, 0);
    for i in 0..100_000 {
        let mut ray = random_ray(&mut rng);
        let (p, q) = (closest(&a, &ray), closest(&b, &ray));
        match (p, q) {
            (None, None) => {}
            (Some(p), Some(q)) if p.prim == q.prim => {
                assert_eq!(p, q, "the same primitive must give the same bits");
                hits += 1;
            }
            (Some(p), Some(q)) => {
                assert!(same_place(&g, p.prim, q.prim, &ray), "ray {i}: {p:?} {q:?}");
                ties += 1;
            }
            // Past the silhouette of a triangle a rounding decides; nothing else may lie behind it.
            (Some(h), None) | (None, Some(h)) => {
                let smallest = h.b1.min(h.b2).min(1.0 - h.b1 - h.b2);
                assert!(smallest.abs() < 1e-4, "ray {i}: only one sees {h:?}");
                ties += 1;
            }
        }
        // Cut the ray in front of the hit: nothing, and behind it: something.
        if let Some(h) = p.filter(|h| !h.clamped) {
            for (factor, expected) in [(0.999, false), (1.001, true)] {
                ray.t_max = h.t * factor;
                assert_eq!(a.occluded(&ray), expected, "ray {i}");
                assert_eq!(b.occluded(&ray), expected, "ray {i}");
                shadows += 1;
            }
        }
    }
    assert!(hits > 30_000 && shadows > 60_000, "{hits} {shadows}");
    // Two random faces cross a ray at the same float distance, or an edge is met exactly, about once in 10⁵.
    assert!(ties < 20, "{ties}");
}

#[test]
fn checked_counts_what_differs() {
    let mut rng = Rng(11);
    let (g, other) = (soup(&mut rng, 300), soup(&mut rng, 300));
    let same = Checked::new(embree(&g), Obvhs::new(&g));
    let wrong = Checked::new(embree(&g), Obvhs::new(&other));
    for _ in 0..2000 {
        let ray = random_ray(&mut rng);
        for checked in [&same, &wrong] {
            checked.nearest(&ray);
            checked.occluded(&ray);
        }
    }
    let (same, wrong) = (same.disagreement(), wrong.disagreement());
    assert_eq!((same.rays, same.nearest, same.occluded), (4000, 0, 0));
    assert!(wrong.nearest > 200 && wrong.occluded > 200, "{wrong:?}");
}

#[test]
fn a_closed_mesh_leaks_no_ray() {
    let g = icosphere(4);
    let mut rng = Rng(12);
    let (a, b) = (embree(&g), Obvhs::new(&g));
    for i in 0..100_000 {
        let o = rng.direction() * (0.9 * rng.next());
        let face = g.triangles[(rng.next() * g.triangles.len() as f32) as usize];
        let [p, q, _] = face.map(|v| g.positions[v as usize]);
        let d = match i % 3 {
            0 => rng.direction(),
            1 => (p + q) * 0.5 - o,
            _ => p - o,
        };
        let ray = to_infinity(o, d);
        let hit = closest(&b, &ray);
        assert!(hit.is_some_and(|h| !h.clamped), "obvhs leaks {ray:?}");
        assert!(b.occluded(&ray), "obvhs leaks {ray:?}");
        // Of rays aimed at a corner exactly, Embree's robust mode lets some through: its edge tests agree along an
        // edge, but around a corner their roundings are independent and may all say "outside".
        if i % 3 != 2 {
            assert!(closest(&a, &ray).is_some(), "Embree leaks {ray:?}");
            assert!(a.occluded(&ray), "Embree leaks {ray:?}");
        }
    }
}

/// Rays from points of a lone primitive meet nothing, at any scale, away from the origin of coordinates too.
#[test]
fn spawned_rays_never_meet_their_own_surface() {
    let mut rng = Rng(13);
    for i in 0..100 {
        let scale = 10f32.powi(i % 13 - 6);
        let unit = if i % 5 == 4 {
            let kind = i as usize / 5 % 2;
            let mut g = mixed(&mut rng, 1, 2);
            g = geometry(vec![], vec![], vec![g.quadrics[kind]]);
            g
        } else {
            soup(&mut rng, 1)
        };
        let g = scaled(unit, scale);
        let (a, b) = (embree(&g), Obvhs::new(&g));
        let triangle = g.quadrics.is_empty();
        for _ in 0..1000 {
            let s = if triangle {
                let (b1, b2) = rng.barycentric();
                surface::surface_at(&g, 0, b1, b2)
            } else {
                let near = g.bounding_sphere().0 + rng.direction() * scale;
                surface::quadric_at(&g.quadrics[0], near.as_dvec3())
            };
            let mut d = rng.direction();
            // A sphere is left outward only; inward it is met on its far side, as it must be.
            if matches!(g.quadric(0), Some(crate::scene::Quadric::Sphere { .. })) {
                let c = g.bounding_sphere().0;
                if d.dot(s.p - c) < 0.0 {
                    d = -d;
                }
            }
            let ray = s.ray(d);
            assert_eq!(closest(&a, &ray), None, "Embree, scale {scale}: {s:?} {d}");
            assert_eq!(closest(&b, &ray), None, "obvhs, scale {scale}: {s:?} {d}");
            assert!(!a.occluded(&ray) && !b.occluded(&ray), "scale {scale}");
        }
    }
}

#[test]
fn points_in_a_sphere_see_each_other_both_ways_and_not_through_a_wall() {
    let mut rng = Rng(14);
    for scale in [1e-6, 1.0, 1e6] {
        // A tessellated ball from inside: convex, so every two of its points see each other.
        let g = scaled(icosphere(3), scale);
        let (a, b) = (embree(&g), Obvhs::new(&g));
        let faces = g.triangles.len() as f32;
        let mut point = || {
            let (b1, b2) = rng.barycentric();
            let prim = (rng.next() * faces) as u32;
            (prim, surface::surface_at(&g, prim, b1, b2))
        };
        for _ in 0..20_000 {
            let ((f, s), (h, t)) = (point(), point());
            // Faces that nearly share a plane hide each other's edges by less than the offsets.
            if f == h || s.ng.dot(t.ng) > 0.9 {
                continue;
            }
            let see = |a: &dyn Fn(&Surface, &Surface) -> bool| (a(&s, &t), a(&t, &s));
            let by_embree = see(&|s, t| visible(&a, s.p, s.error, s.ng, t.p, t.error, t.ng));
            let by_obvhs = see(&|s, t| visible(&b, s.p, s.error, s.ng, t.p, t.error, t.ng));
            assert_eq!(by_embree, (true, true), "scale {scale} {s:?} {t:?}");
            assert_eq!(by_obvhs, (true, true), "scale {scale} {s:?} {t:?}");
            // A point outside is hidden by the ball from the far side of it, and both ways agree.
            let out = -s.p * 2.0;
            let to = |p0, p1| visible(&a, p0, 0.0, Vec3::ZERO, p1, 0.0, Vec3::ZERO);
            assert!(!to(out, s.p * 0.5) && !to(s.p * 0.5, out));
        }
    }
}

#[test]
fn visibility_in_a_soup_is_the_same_both_ways() {
    let mut rng = Rng(15);
    let g = soup(&mut rng, 500);
    let (a, b) = (embree(&g), Obvhs::new(&g));
    let mut seen = 0;
    for _ in 0..50_000 {
        let mut point = || {
            let (b1, b2) = rng.barycentric();
            surface::surface_at(&g, (rng.next() * 500.0) as u32, b1, b2)
        };
        let (s, t) = (point(), point());
        let there = visible(&a, s.p, s.error, s.ng, t.p, t.error, t.ng);
        let back = visible(&a, t.p, t.error, t.ng, s.p, s.error, s.ng);
        assert_eq!(there, back);
        let there = visible(&b, s.p, s.error, s.ng, t.p, t.error, t.ng);
        let back = visible(&b, t.p, t.error, t.ng, s.p, s.error, s.ng);
        assert_eq!(there, back);
        seen += there as u32;
    }
    assert!(seen > 1000 && seen < 49_000, "{seen}");
}

#[test]
fn the_error_bound_holds_against_f64() {
    let mut rng = Rng(16);
    let g = mixed(&mut rng, 1000, 200);
    let a = embree(&g);
    let mut tested = [0; 2];
    for _ in 0..50_000 {
        let ray = random_ray(&mut rng);
        let Some(hit) = closest(&a, &ray) else {
            continue;
        };
        let s = surface(&g, &hit, &ray);
        let off = match g.quadric(hit.prim) {
            None => {
                let [p0, p1, p2] = g.corners(hit.prim).map(|p| p.as_dvec3());
                let (b1, b2) = (hit.b1 as f64, hit.b2 as f64);
                tested[0] += 1;
                s.p.as_dvec3() - (p0 * (1.0 - b1 - b2) + p1 * b1 + p2 * b2)
            }
            Some(q) => {
                tested[1] += 1;
                s.p.as_dvec3() - quadric::project(q, s.p.as_dvec3()).0
            }
        };
        assert!(off.abs().max_element() <= s.error as f64, "{off} {s:?}");
        // The bound is of use: a few roundings of coordinates and edges below 2, not more.
        let needle = s.error > 1e-4;
        assert!(!needle || g.quadric(hit.prim).is_none(), "{s:?}");
        // The point lies on the ray within the bound and the roundings of the recomputation over the cosine.
        let on_ray = ray.o.as_dvec3() + ray.d.as_dvec3() * hit.t as f64;
        let cos = s.ng.dot(ray.d).abs() as f64;
        let apart: DVec3 = on_ray - s.p.as_dvec3();
        assert!(apart.length() <= 2e-5 / cos, "{apart} {hit:?}");
    }
    assert!(tested[0] > 10_000 && tested[1] > 1_000, "{tested:?}");
}

/// FNV-1a over the answers to many rays.
fn hash(a: &Embree, rays: &[Ray]) -> u64 {
    let mut h = 0xcbf2_9ce4_8422_2325u64;
    for ray in rays {
        let word = a.nearest(ray).unwrap_or(u32::MAX) as u64 | (a.occluded(ray) as u64) << 32;
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
        for high_quality in [false, true] {
            let hashes = [1, 2, 7].map(|threads| {
                let options = EmbreeOptions {
                    threads,
                    high_quality,
                    ..EmbreeOptions::default()
                };
                hash(&Embree::new(&g, options).expect("builds"), &rays)
            });
            assert_eq!(hashes[0], hashes[1], "high quality: {high_quality}");
            assert_eq!(hashes[0], hashes[2], "high quality: {high_quality}");
        }
    }
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
            0 => a.nearest(r).unwrap_or(u32::MAX) as u64,
            _ => a.occluded(r) as u64,
        })
        .sum();
    assert_eq!(a.replay(&rays, &kinds), expected);
}
