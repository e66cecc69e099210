//! No ray meets the surface it leaves, and points see each other both ways, at any scale.

use super::super::testing::{Rng, geometry, icosphere, mixed, scaled, soup};
use super::super::*;
use super::*;
use crate::scene::Quadric;
use glam::DVec3;

/// A triangle with a corner at the origin of coordinates, where the point's own rounding vanishes; `height` of its
/// edge wide.
fn needle(rng: &mut Rng, height: f32) -> Geometry {
    let (a, b) = rng.direction().any_orthonormal_pair();
    let shear = rng.next();
    geometry(
        vec![Vec3::ZERO, a, a * shear + b * height],
        vec![[0, 1, 2]],
        vec![],
    )
}

/// Rays from points of a lone primitive meet nothing, at any scale, away from the origin of coordinates too.
#[test]
fn spawned_rays_never_meet_their_own_surface() {
    let mut rng = Rng(13);
    for i in 0..130 {
        let scale = 10f32.powi(i % 13 - 6);
        let unit = if i % 5 == 4 {
            let kind = i as usize / 5 % 2;
            let mut g = mixed(&mut rng, 1, 2);
            g = geometry(vec![], vec![], vec![g.quadrics[kind]]);
            g
        } else if i % 5 >= 2 {
            // Widths down to 1/316: the bound on needles holds from √(128u) = 1/362.
            {
                let height = 10f32.powf(-2.5 * rng.next().sqrt());
                needle(&mut rng, height)
            }
        } else {
            soup(&mut rng, 1)
        };
        let g = scaled(unit, scale);
        let (a, b) = (embree(&g), Obvhs::new(&g));
        let triangle = g.quadrics.is_empty();
        for _ in 0..1000 {
            let s = if triangle {
                // Towards corner 0 as often as anywhere.
                let (b1, b2) = rng.barycentric();
                let near = 10f32.powf(-6.0 * rng.next());
                surface::surface_at(&g, 0, b1 * near, b2 * near)
            } else {
                let near = g.bounding_sphere().0 + rng.direction() * scale;
                surface::quadric_at(&g.quadrics[0], near.as_dvec3())
            };
            let mut d = rng.direction();
            // A sphere is left outward only; inward it is met on its far side, as it must be.
            if matches!(g.quadric(0), Some(Quadric::Sphere { .. })) {
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
fn a_small_face_far_away_does_not_hide_itself() {
    let mut rng = Rng(20);
    for _ in 0..200 {
        let g = needle(&mut rng, 0.5);
        let (a, b) = (embree(&g), Obvhs::new(&g));
        for _ in 0..200 {
            let (b1, b2) = rng.barycentric();
            let s = surface::surface_at(&g, 0, 1e-3 * b1, 1e-3 * b2);
            let from = rng.direction() * 1000.0;
            assert!(
                visible(&a, from, 0.0, Vec3::ZERO, s.p, s.error, s.ng),
                "{from} {s:?}"
            );
            assert!(
                visible(&b, from, 0.0, Vec3::ZERO, s.p, s.error, s.ng),
                "{from} {s:?}"
            );
        }
    }
}

#[test]
fn visibility_is_the_same_both_ways() {
    let mut rng = Rng(15);
    let g = soup(&mut rng, 500);
    let (a, b) = (embree(&g), Obvhs::new(&g));
    let mut seen = 0;
    for i in 0..50_000 {
        let point = |rng: &mut Rng| {
            let (b1, b2) = rng.barycentric();
            surface::surface_at(&g, (rng.next() * 500.0) as u32, b1, b2)
        };
        let (s, mut t) = (point(&mut rng), point(&mut rng));
        if i % 2 == 1 {
            // The far end where the segment grazes an edge, on which a rounding decides.
            let [p, q, _] = g.corners((rng.next() * 500.0) as u32);
            t.p = s.p + (p.lerp(q, rng.next()) - s.p) * 1.5;
            t.ng = Vec3::ZERO;
        }
        let ways = |there: &Surface, back: &Surface| {
            (
                visible(
                    &a,
                    there.p,
                    there.error,
                    there.ng,
                    back.p,
                    back.error,
                    back.ng,
                ),
                visible(
                    &b,
                    there.p,
                    there.error,
                    there.ng,
                    back.p,
                    back.error,
                    back.ng,
                ),
            )
        };
        assert_eq!(ways(&s, &t), ways(&t, &s));
        seen += ways(&s, &t).0 as u32;
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
        assert_eq!(surface::surface_again(&g, hit.prim, s.at), s);
        let off = match g.quadric(hit.prim.prim()) {
            None => {
                let [p0, p1, p2] = g.corners(hit.prim.prim()).map(|p| p.as_dvec3());
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
        assert!(!needle || g.quadric(hit.prim.prim()).is_none(), "{s:?}");
        // The point lies on the ray within the bound and the roundings of the recomputation over the cosine.
        let on_ray = ray.o.as_dvec3() + ray.d.as_dvec3() * hit.t as f64;
        let cos = s.ng.dot(ray.d).abs() as f64;
        let apart: DVec3 = on_ray - s.p.as_dvec3();
        assert!(apart.length() <= 2e-5 / cos, "{apart} {hit:?}");
    }
    assert!(tested[0] > 10_000 && tested[1] > 1_000, "{tested:?}");
}
