//! Instances: both backends give the same answers through them, those of the flattened scene, and no ray meets the
//! surface it leaves.

use super::super::testing::{Rng, geometry, icosphere, mixed, soup};
use super::super::*;
use super::*;
use crate::scene::flatten::flatten;
use crate::scene::load::{LoadOptions, load_str};
use crate::scene::{Instance, Quadric, Scene, Source};
use glam::{DAffine3, DMat3, DVec3};
use std::path::Path;

/// A linear map: a rotation, alone, mirrored, stretched along three axes, or sheared.
fn linear(rng: &mut Rng, kind: usize) -> DMat3 {
    let axis = rng.direction().as_dvec3();
    let turn = DMat3::from_axis_angle(axis, 6.0 * rng.next() as f64);
    let each = |f: &mut dyn FnMut() -> f64| DVec3::new(f(), f(), f());
    match kind % 5 {
        0 => DMat3::IDENTITY,
        1 => turn,
        2 => turn * DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)),
        3 => turn * DMat3::from_diagonal(each(&mut || 10f64.powf(rng.next() as f64 - 0.5))),
        _ => {
            let mut shear = DMat3::IDENTITY;
            shear.y_axis.x = rng.next() as f64;
            shear.z_axis.y = -(rng.next() as f64);
            turn * shear
        }
    }
}

/// The radius of a geometry about its origin, under a map.
fn radius(g: &Geometry, m: &DMat3) -> f64 {
    let (lo, hi) = g.bounds().expect("not empty");
    let corner = lo.abs().max(hi.abs()).as_dvec3().length();
    let norm = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.length_squared());
    corner * norm.iter().sum::<f64>().sqrt()
}

/// A geometry that holds objects under the given maps.
fn placed(mut world: Geometry, objects: Vec<Geometry>, places: &[(u32, DAffine3)]) -> Geometry {
    world.objects = objects;
    let reach = places.iter().map(|(o, m)| {
        let own = radius(&world.objects[*o as usize], &m.matrix3);
        own + m.translation.abs().max_element()
    });
    let reach = reach.fold(3.0, f64::max);
    for (object, m) in places {
        let own = radius(&world.objects[*object as usize], &m.matrix3);
        let instance = Instance::new(*object, m, own, reach).expect("f32 carries it");
        world.instances.push(instance);
    }
    world
}

/// About the unit cube, 40 places of a heap of triangles, spheres and disks and of a ball, among some triangles.
pub(super) fn crowd(rng: &mut Rng, kinds: std::ops::Range<usize>, quadrics: usize) -> Geometry {
    let mut heap = mixed(rng, 60, quadrics);
    heap.positions
        .iter_mut()
        .for_each(|p| *p = (*p - 0.5) * 0.5);
    for q in &mut heap.quadrics {
        match q {
            Quadric::Sphere { center, radius, .. } | Quadric::Disk { center, radius, .. } => {
                *center = (*center - 0.5) * 0.5;
                *radius *= 0.5;
            }
        }
    }
    let mut places = Vec::new();
    for i in 0..40 {
        let size = if i % 2 == 0 { 0.6 } else { 0.1 };
        let matrix3 = linear(rng, kinds.start + i % kinds.len()) * size;
        let translation = rng.vec3().as_dvec3();
        let m = DAffine3 {
            matrix3,
            translation,
        };
        places.push((i as u32 % 2, m));
    }
    placed(soup(rng, 30), vec![heap, icosphere(2)], &places)
}

/// The same with every instance in the world.
fn flat(g: &Geometry) -> Geometry {
    let mut scene: Scene =
        load_str("WorldBegin", Path::new(""), &LoadOptions::default()).expect("an empty scene");
    scene.geometry = g.clone();
    scene.geometry.facets.take();
    let sources = |o: &Geometry| vec![Source::unknown("shape"); o.shapes.len()];
    let of = |o: &Geometry| (Source::unknown("object"), sources(o));
    scene.sources.shapes = sources(g);
    scene.sources.objects = g.objects.iter().map(of).collect();
    flatten(&mut scene, |_| true);
    assert!(scene.geometry.objects.is_empty() && scene.geometry.instances.is_empty());
    scene.geometry
}

#[test]
fn backends_agree_through_instances() {
    let mut rng = Rng(51);
    let g = crowd(&mut rng, 0..5, 12);
    let (a, b) = (embree(&g), Obvhs::new(&g));
    let checked = Checked::new(&a, &b);
    let (mut hits, mut quadrics, mut differ) = (0, 0, 0);
    for _ in 0..60_000 {
        let ray = random_ray(&mut rng);
        checked.nearest(&ray);
        checked.occluded(&ray);
        match (closest(&a, &ray), closest(&b, &ray)) {
            (None, None) => {}
            (Some(p), Some(q)) if p.prim == q.prim => {
                assert_eq!(p, q, "the same primitive must give the same bits");
                let (s, t) = (surface(&g, &p, &ray), surface(&g, &q, &ray));
                assert_eq!(s, t);
                assert_eq!(surface::surface_again(&g, p.prim, s.at), s, "made again");
                let (instance, object, prim) = g.resolve(p.prim);
                hits += instance.is_some() as u32;
                quadrics += (instance.is_some() && object.quadric(prim).is_some()) as u32;
            }
            // `checked` judges.
            _ => differ += 1,
        }
    }
    let found = checked.disagreement();
    assert_eq!(found.wrong(), 0, "{found:#?}");
    assert!(hits > 20_000 && quadrics > 2_000, "{hits} {quadrics}");
    // A carried ray is off by some ten roundings of the scene, so ten times as many edges are met within them as
    // without instances.
    assert!(
        differ < 60 && found.different() < 120,
        "{differ} {found:#?}"
    );
}

/// What a ray meets of an instance is what it meets of a copy, to the bounds of both.
#[test]
fn instances_are_met_where_their_copies_are() {
    let mut rng = Rng(52);
    for kinds in [0..1, 1..2, 2..3, 3..4, 4..5] {
        // Under a stretch a copy's quadrics would be tessellated.
        let quadrics = if kinds.start < 3 { 12 } else { 0 };
        let g = crowd(&mut rng, kinds.clone(), quadrics);
        let copies = flat(&g);
        assert_eq!(copies.prim_count() as u64, g.flat_count());
        let (a, b) = (embree(&g), embree(&copies));
        let (mut same, mut other) = (0, 0);
        for _ in 0..20_000 {
            let ray = random_ray(&mut rng);
            let (Some(p), Some(q)) = (closest(&a, &ray), closest(&b, &ray)) else {
                other += (a.nearest(&ray).is_some() != b.nearest(&ray).is_some()) as u32;
                continue;
            };
            let (s, t) = (surface(&g, &p, &ray), surface(&copies, &q, &ray));
            let cos = s.ng.dot(ray.d).abs() / ray.d.length();
            // The rounding of a copy's corners, of coordinates below 2, and of its narrowest triangles' normals.
            let near = (s.p - t.p).length() * cos < s.error + t.error + 1e-6;
            let turned = s.ng.dot(t.ng) > 1.0 - 1e-4;
            if near && turned {
                same += 1;
            } else {
                other += 1;
            }
        }
        assert!(same > 4_000 && other < 20, "{kinds:?}: {same} {other}");
    }
}

/// Under maps that round nothing, points and normals are the copies' to the rounding of either.
#[test]
fn exact_maps_give_the_hits_of_the_copies() {
    let mut rng = Rng(53);
    let mut object = soup(&mut rng, 100);
    for p in &mut object.positions {
        // Few bits, so that sums with other such numbers are exact.
        *p = (*p * 256.0).round() / 256.0;
    }
    let places: Vec<_> = (0..20)
        .map(|i| {
            let t = (rng.vec3() * 64.0).round().as_dvec3() / 16.0;
            let mirror = DVec3::new(1.0, if i % 2 == 0 { 1.0 } else { -1.0 }, 1.0);
            (
                0,
                DAffine3::from_scale_rotation_translation(mirror, Default::default(), t),
            )
        })
        .collect();
    let g = placed(Geometry::default(), vec![object], &places);
    let copies = flat(&g);
    let (a, b) = (embree(&g), embree(&copies));
    let mut same = 0;
    for _ in 0..20_000 {
        let (o, target) = (rng.vec3() * 4.0, rng.vec3() * 4.0);
        let ray = to_infinity(o, target - o);
        if let (Some(p), Some(q)) = (closest(&a, &ray), closest(&b, &ray)) {
            let (s, t) = (surface(&g, &p, &ray), surface(&copies, &q, &ray));
            // Elsewhere two triangles meet, and each names its own.
            if (s.ng - t.ng).length() < 1e-3 {
                let (p, n) = ((s.p - t.p).abs(), (s.ng - t.ng).abs());
                let cos = s.ng.dot(ray.d).abs() / ray.d.length();
                assert!(p.max_element() * cos <= t.error, "{s:?} {t:?}");
                assert!(n.max_element() <= f32::EPSILON, "{s:?} {t:?}");
                same += 1;
            }
        }
    }
    assert!(same > 5_000, "{same}");
}

/// Rays from points of a lone primitive that stands somewhere meet nothing.
#[test]
fn rays_never_meet_the_instance_they_leave() {
    let mut rng = Rng(54);
    for i in 0..200 {
        let lone = match i % 5 {
            3 => geometry(vec![], vec![], vec![mixed(&mut rng, 0, 1).quadrics[0]]),
            4 => geometry(vec![], vec![], vec![mixed(&mut rng, 0, 2).quadrics[1]]),
            _ => soup(&mut rng, 1),
        };
        let scale = 10f64.powi(i % 7 - 3);
        let away = 10f64.powi(i % 4) * scale;
        let m = DAffine3 {
            matrix3: linear(&mut rng, i as usize / 5) * scale,
            translation: rng.direction().as_dvec3() * away,
        };
        let g = placed(Geometry::default(), vec![lone], &[(0, m)]);
        let (a, b) = (embree(&g), Obvhs::new(&g));
        let center = g.instances[0].to_world().transform_point3(
            g.objects[0]
                .bounds()
                .map(|(lo, hi)| 0.5 * (lo + hi))
                .expect("one")
                .as_dvec3(),
        );
        for k in 0..300 {
            // A point found by a ray, as any point of an instance is.
            let (lo, hi) = g.bounds().expect("one");
            let size = (hi - lo).length();
            let from = center.as_vec3() + rng.direction() * size;
            let target = lo + (hi - lo) * rng.vec3();
            let Some(hit) = closest(&a, &to_infinity(from, target - from)) else {
                continue;
            };
            let s = surface(&g, &hit, &to_infinity(from, target - from));
            let mut d = rng.direction();
            let sphere = matches!(g.objects[0].quadrics.first(), Some(Quadric::Sphere { .. }));
            if sphere && d.dot(s.ng) * (s.p - center.as_vec3()).dot(s.ng) < 0.0 {
                d = -d;
            }
            let ray = s.ray(d);
            assert_eq!(closest(&a, &ray), None, "Embree, {i} {k}: {s:?} {d} {m:?}");
            assert_eq!(closest(&b, &ray), None, "obvhs, {i} {k}: {s:?} {d} {m:?}");
            // Nor does one that comes from as far away as the scene reaches.
            let far = s.p + d * (away as f32 + size);
            for accel in [&a as &dyn Accel, &b] {
                let seen = visible(&accel, far, 0.0, Vec3::ZERO, s.p, s.error, s.ng);
                assert!(seen, "{}, {i} {k}: {s:?} {d} {m:?}", accel.name());
            }
        }
    }
}

/// The bound of [`Instance::new`] against f32 arithmetic as Embree does it, and it is of use.
#[test]
fn a_carried_ray_errs_no_more_than_the_bound() {
    let mut rng = Rng(55);
    let mut worst = 0f64;
    for i in 0..20_000 {
        let size = 10f64.powi(i % 9 - 4);
        let m = DAffine3 {
            matrix3: linear(&mut rng, i as usize) * size,
            translation: (rng.vec3() - 0.5).as_dvec3() * 20.0,
        };
        let (radius, reach) = (size, 10.0 + size);
        let Some(instance) = Instance::new(0, &m, radius, reach) else {
            panic!("{m:?}")
        };
        // A point of the object, and a ray of length up to 2·reach to it.
        let x = (rng.vec3() - 0.5) * 0.5;
        let there = instance.to_world().transform_point3(x.as_dvec3());
        let o = (rng.vec3() - 0.5) * 2.0 * reach as f32;
        let d = there.as_vec3() - o;
        let exact = o.as_dvec3() + d.as_dvec3();
        // Cofactors, determinant, reciprocal, −W·b, each operation rounded to f32.
        let l = instance.linear;
        let inverse = {
            let (x, y, z) = (l.x_axis, l.y_axis, l.z_axis);
            let rows = [y.cross(z), z.cross(x), x.cross(y)];
            let det = x.dot(rows[0]);
            let r = 1.0 / det;
            glam::Mat3::from_cols(rows[0] * r, rows[1] * r, rows[2] * r).transpose()
        };
        let w = -(inverse * instance.translation);
        let carried = (inverse * o + w).as_dvec3() + (inverse * d).as_dvec3();
        let back = instance.to_world().transform_point3(carried);
        let off = (back - exact).abs().max_element();
        let bound = instance.error as f64;
        assert!(off <= bound, "{off} {bound} {m:?}");
        worst = worst.max(off / bound);
    }
    assert!(worst > 0.03, "{worst}");
}

#[test]
fn instances_that_name_nothing_are_refused() {
    let mut rng = Rng(56);
    let g = crowd(&mut rng, 1..2, 12);
    let build = |change: &dyn Fn(&mut Geometry)| {
        let mut g = g.clone();
        change(&mut g);
        match Embree::new(&g, EmbreeOptions::default()) {
            Err(EmbreeError::Geometry(text)) => text,
            _ => panic!("accepted"),
        }
    };
    let text = build(&|g| g.instances[3].object = 2);
    assert!(text.contains("instance 3 is of object 2"), "{text}");
    let text = build(&|g| g.instances[1].linear = glam::Mat3::ZERO);
    assert!(text.contains("instance 1 has the transform"), "{text}");
    let text = build(&|g| g.objects[1].triangles[0] = [0, 1, 9999]);
    assert!(text.contains("object 1: triangle 0"), "{text}");
}
