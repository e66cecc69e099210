//! Both backends give the same answers, and nothing slips between faces.

use super::super::obvhs::{Preset, Tree};
use super::super::referee::same_place;
use super::super::testing::{Rng, icosphere, mixed, soup};
use super::super::*;
use super::*;

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

/// No box hides a primitive that the shared routine hits, not even by a rounding at its rim.
#[test]
fn the_trees_of_obvhs_name_what_asking_every_primitive_names() {
    let mut rng = Rng(19);
    for i in 0..600 {
        // A lone triangle fills its box to the rim; several make a tree, and 60 one of several levels.
        let n = [1, 20, 1, 60][i % 4];
        let g = soup(&mut rng, n);
        let trees = [Tree::Wide, Tree::Binary].map(|tree| {
            let options = ObvhsOptions {
                tree,
                ..ObvhsOptions::default()
            };
            Obvhs::with_options(&g, options)
        });
        for k in 0..200 {
            // Aimed at corners and edges, from far away too, where roundings are largest against the boxes.
            let [p, q, _] = g.corners((rng.next() * n as f32) as u32);
            let target = if i % 2 == 0 { p } else { p.lerp(q, rng.next()) };
            // Every third ray runs along an axis but for a little, where faces of boxes are met at grazing angles.
            let (along, aside) = match k % 3 {
                0 => (Vec3::AXES[k as usize % 9 / 3], 1e-4),
                1 => (rng.direction(), 1e-3),
                _ => (rng.direction(), 1.0),
            };
            let o = target + along * 10f32.powi(k % 4) + rng.direction() * aside;
            let ray = to_infinity(o, target - o);
            let sheared = triangle::Sheared::new(&ray);
            let mut best = (f32::INFINITY, None);
            for prim in 0..n as u32 {
                match sheared.intersect(&g.corners(prim)) {
                    Some(h) if h.t > 0.0 && h.t < best.0 => best = (h.t, Some(PrimId::of(prim))),
                    _ => {}
                }
            }
            for tree in &trees {
                assert_eq!(tree.nearest(&ray), best.1, "{} {ray:?}", tree.name());
                assert_eq!(tree.occluded(&ray), best.1.is_some(), "{ray:?}");
            }
        }
    }
}

/// Every kind of tree answers as every other.
#[test]
fn presets_and_splits_of_obvhs_agree() {
    let mut rng = Rng(33);
    let mut g = mixed(&mut rng, 3000, 30);
    // Long triangles among small ones, so that there is something to split.
    for i in (0..300).step_by(3) {
        g.positions[i] = rng.vec3();
    }
    let plain = Obvhs::new(&g);
    let rays: Vec<Ray> = (0..5000).map(|_| random_ray(&mut rng)).collect();
    let named: Vec<Option<PrimId>> = rays.iter().map(|r| plain.nearest(r)).collect();
    for tree in [Tree::Wide, Tree::Binary] {
        for preset in Preset::ALL {
            for splits in [false, true] {
                let options = ObvhsOptions {
                    tree,
                    preset,
                    splits,
                };
                let other = Obvhs::with_options(&g, options);
                assert_eq!(other.entries() > g.prim_count(), splits, "{options}");
                for (ray, expected) in rays.iter().zip(&named) {
                    let named = other.nearest(ray);
                    // A piece's box may cut off a distance that only a rounding makes the nearest.
                    let tie = splits
                        && matches!((named, expected), (Some(a), Some(b)) if same_place(&g, a, *b, ray));
                    assert!(named == *expected || tie, "{options}: {ray:?}");
                    assert_eq!(
                        other.occluded(ray),
                        expected.is_some(),
                        "{options}: {ray:?}"
                    );
                }
            }
        }
    }
}
