//! Triangles as meshes have them at their worst, on both backends.

use super::common::scene::embree;
use super::{all_images, images_on, scene_of};
use glam::Vec3;
use metrolux::accel::surface::surface_at;
use metrolux::accel::{Accel, Obvhs, Ray, closest, surface};
use metrolux::path::{Kind, Palette, Tally, Vertex, World, trace};
use metrolux::plan::{Effect, Options, Plan};
use metrolux::sampling::Rng;
use metrolux::sampling::warp;
use metrolux::scene::{PrimId, Scene};
use rayon::prelude::*;
use std::fmt::Write;

/// A scene of a mesh alone, with a constant sky.
fn mesh(points: &[Vec3], triangles: &[[usize; 3]], light: &str) -> Scene {
    let (mut p, mut i) = (String::new(), String::new());
    for v in points {
        write!(p, " {} {} {}", v.x, v.y, v.z).unwrap();
    }
    for [a, b, c] in triangles {
        write!(i, " {a} {b} {c}").unwrap();
    }
    scene_of(&format!(
        "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\nWorldBegin\n{light}\n\
         Shape \"trianglemesh\" \"point3 P\" [{p} ] \"integer indices\" [{i} ]"
    ))
}

fn to_infinity(o: Vec3, d: Vec3) -> Ray {
    Ray {
        o,
        d,
        t_max: f32::INFINITY,
    }
}

/// Needles of aspect 10^`from` … 10^`to`, 1000 rays from each: how many needles; rays that met the needle they left, on Embree
/// and obvhs, as a render asks them; and the same of rays that are asked of every triangle.
fn needles(count: u32, [from, to]: [f32; 2]) -> [u32; 5] {
    let counts: Vec<[u32; 5]> = (0..count)
        .into_par_iter()
        .map(|i| {
            let mut rng = Rng::new(31, 1000, i, 0);
            let (a, b) = warp::sphere(rng.next_vec2()).any_orthonormal_pair();
            let aspect = 10f32.powf(from + (to - from) * rng.next_f32());
            let at = (warp::sphere(rng.next_vec2()) * 4.0 * rng.next_f32()) * (i % 2) as f32;
            let apex = at + a * rng.next_f32() + b / aspect;
            let mut scene = mesh(&[at, at + a, apex], &[[0, 1, 2]], "");
            if scene.geometry.triangles.is_empty() {
                return [0; 5];
            }
            let plan = Plan::make(&mut scene, &Options::default());
            assert_eq!(
                plan.on(Effect::Slivers),
                scene.geometry.aspect_squared(0) > 1e6
            );
            let g = &scene.geometry;
            let (e, o) = (embree(&scene), Obvhs::new(g));
            let (on_e, on_o) = (World::new(&scene, &e, 1), World::new(&scene, &o, 1));
            let palette = Palette::<1>::new(on_e.lanes(0.5));
            let mut tally = Tally::default();
            let mut met = [1, 0, 0, 0, 0];
            for _ in 0..1000 {
                let [_, b1, b2] = warp::triangle(rng.next_vec2());
                let s = surface_at(g, 0, b1, b2);
                assert!(s.p.is_finite() && s.error.is_finite() && s.ng.is_normalized());
                let w = warp::sphere(rng.next_vec2());
                let v = Vertex::from_surface(&scene, PrimId::of(0), &s, &palette);
                // It is seen from wherever light is, too.
                let lamp = Vertex::bare(Kind::Point, s.p + w * 3.0, Vec3::ZERO, 0);
                let sky = Vertex::bare(Kind::Infinite, w, Vec3::ZERO, 0);
                let t = &mut tally;
                met[1] += u32::from(trace(&on_e, &v, w, &palette, t).is_some());
                met[2] += u32::from(trace(&on_o, &v, w, &palette, t).is_some());
                for far in [&lamp, &sky] {
                    met[1] += u32::from(!on_e.visible(&v, far, t) || !on_e.visible(far, &v, t));
                    met[2] += u32::from(!on_o.visible(&v, far, t) || !on_o.visible(far, &v, t));
                }
                let ray = s.ray(w);
                met[3] += u32::from(closest(&e, &ray).is_some());
                met[4] += u32::from(closest(&o, &ray).is_some());
            }
            met
        })
        .collect();
    counts.iter().fold([0; 5], |mut s, c| {
        s.iter_mut().zip(c).for_each(|(s, c)| *s += c);
        s
    })
}

/// A ray that leaves a needle of aspect 1 to 10⁷, to whatever side, is never told that it meets that needle again, and what
/// lies on the needle is seen. Up to 1000 that is so although it is asked of the needle too.
#[test]
fn rays_that_leave_slivers_do_not_meet_them_again() {
    let [made, met @ ..] = needles(1000, [0.0, 3.0]);
    assert_eq!((made, met), (1000, [0; 4]));
    let [made, met @ ..] = needles(1000, [3.0, 7.0]);
    assert_eq!(met[..2], [0; 2]);
    // Some are too thin for the coordinates they stand at.
    assert!(made > 750, "{made}");
    // Asked of the needle too, some rays meet it (docs/faults.md says why). How many is told, not bounded: it hangs on the
    // roundings of a test that tells nothing there.
    assert!(met[2] > 0 && met[3] > 0, "{met:?}");
    for k in 3..7 {
        let [made, met @ ..] = needles(200, [k as f32, (k + 1) as f32]);
        let [.., e, o] = met.map(|m| 100.0 * f64::from(m) / f64::from(1000 * made));
        println!(
            "aspect 10^{k} to 10^{}: Embree {e:.3} %, obvhs {o:.3} % of {made} 000 rays",
            k + 1
        );
    }
}

/// A floor and a wall cut into `strips` strips of two triangles each, turned so that no plane holds exactly.
fn cut(strips: usize) -> Scene {
    let turn = "1 0.3 0.2";
    let sheet = |to: &dyn Fn(f64, f64) -> [f64; 3]| {
        let (mut p, mut indices) = (String::new(), String::new());
        for i in 0..=strips {
            for s in [0.0, 1.0] {
                let [x, y, z] = to(i as f64 / strips as f64, s);
                write!(p, " {x} {y} {z}").unwrap();
            }
        }
        for i in (0..2 * strips).step_by(2) {
            write!(
                indices,
                " {} {} {} {} {} {}",
                i,
                i + 2,
                i + 3,
                i,
                i + 3,
                i + 1
            )
            .unwrap();
        }
        format!("Shape \"trianglemesh\" \"point3 P\" [{p} ] \"integer indices\" [{indices} ]\n")
    };
    let floor = sheet(&|u, v| [4.0 * u - 2.0, 4.0 * v - 2.0, 0.0]);
    let wall = sheet(&|u, v| [4.0 * u - 2.0, 1.0, 2.0 * v]);
    super::common::scene::of_text(
        4,
        &format!(
            "LookAt 0.5 -3 1.25  0 0 0.5  0 0 1\nRotate -37 {turn}\nCamera \"perspective\" \"float fov\" 40"
        ),
        &format!(
            "Rotate 37 {turn}\nLightSource \"point\" \"rgb I\" [ 3 3 3 ] \"point3 from\" [ -1 -1 1.5 ]\n\
             Material \"diffuse\" \"rgb reflectance\" [ 0.7 0.7 0.7 ]\n{floor}{wall}"
        ),
    )
}

/// A scene of nothing but slivers, of aspect 10³ and 10⁴, shows what the same walls of two triangles each show. The seeds are the
/// same, so that a darkening shows in the digits before it shows here; at 10⁵ it was 2·10⁻⁴.
#[test]
fn walls_of_slivers_are_as_bright_as_walls() {
    let of = |n| {
        let mut scene = cut(n);
        // As a render has them; the plan of some knows slivers.
        let plan = Plan::make(&mut scene, &Options::default());
        assert_eq!(plan.on(Effect::Slivers), n > 1);
        super::by_length(&scene, 2, 1)
    };
    let plain = of(1);
    let mut pairs = Vec::new();
    for n in [1000, 10_000] {
        for ((name, a), (_, b)) in of(n).iter().zip(&plain) {
            for k in 2..=3 {
                pairs.push(super::common::stats::Pair {
                    name: format!("aspect {n}, {name}, {k} edges"),
                    found: a.length(k..=k),
                    reference: b.length(k..=k),
                    limit: 0.5,
                });
            }
        }
    }
    super::common::stats::agree("slivers", &pairs);
}

/// Faces of no area: the loader leaves them out, and to a backend that is given some they do no harm.
#[test]
fn triangles_without_area_do_no_harm() {
    let points = [Vec3::ZERO, Vec3::X, Vec3::X * 0.3, Vec3::Y, Vec3::ONE];
    let mut scene = mesh(&points, &[[0, 1, 2], [3, 3, 3], [0, 1, 3], [4, 4, 1]], "");
    assert_eq!(scene.geometry.triangles.len(), 1);
    assert!(
        scene
            .warnings
            .iter()
            .any(|w| w.contains("3 triangles without area"))
    );
    let g = &mut scene.geometry;
    g.triangles = vec![[0, 1, 2], [3, 3, 3], [4, 4, 1]];
    g.prim_shape = vec![0; 3];
    g.prim_light = vec![u32::MAX; 3];
    g.facets = Default::default();
    let (e, o) = (embree(&scene), Obvhs::new(&scene.geometry));
    let mut rng = Rng::new(32, 1000, 0, 0);
    for i in 0..100_000 {
        let from = warp::sphere(rng.next_vec2()) * 2.0;
        // At a corner, at a point of an edge, anywhere.
        let at = match i % 3 {
            0 => points[i % 5],
            1 => Vec3::X * rng.next_f32(),
            _ => warp::sphere(rng.next_vec2()),
        };
        let ray = to_infinity(from, at - from);
        // A face on one line may be met by a rounding, at a point of it.
        for hit in [closest(&o, &ray), closest(&e, &ray)].into_iter().flatten() {
            let s = surface(&scene.geometry, &hit, &ray);
            assert!(
                hit.prim == 0 && s.p.is_finite() && s.ng.is_normalized(),
                "{ray:?} {s:?}"
            );
        }
    }
}

/// Every face of a room twice, in reverse order too: the same light, to the bit by every integrator, as with faces once.
#[test]
fn faces_given_twice_are_the_same_picture() {
    let room = |twice: &str| {
        scene_of(&format!(
            r#"Film "rgb" "integer xresolution" 10 "integer yresolution" 10
            Integrator "path" "integer maxdepth" 4
            LookAt 0.3 -2.2 2.1  0 0.1 0.3  0 0 1
            Camera "perspective" "float fov" 40
            WorldBegin
            LightSource "point" "rgb I" [ 4 4 4 ] "point3 from" [ 1 -1 2 ]
            Material "diffuse" "rgb reflectance" [ 0.7 0.6 0.4 ]
            Shape "trianglemesh" "point3 P" [ -2 -2 0  2 -2 0  2 2 0  -2 2 0  -2 1 0  2 1 0  2 1 2  -2 1 2 ]
                "integer indices" [ 0 1 2 0 2 3 4 5 6 4 6 7 {twice} ]"#
        ))
    };
    let (once, twice) = (room(""), room("4 6 7 4 5 6 0 2 3 0 1 2"));
    let sums = |images: Vec<(&'static str, super::Pixels)>| -> Vec<(&'static str, f64)> {
        let mean = |i: &super::Pixels| i.iter().map(|p| p[1]).sum::<f64>() / i.len() as f64;
        images.iter().map(|(n, i)| (*n, mean(i))).collect()
    };
    let reference = sums(all_images(&once, 16));
    let pairs = [
        sums(all_images(&twice, 16)),
        sums(images_on(&twice, &Obvhs::new(&twice.geometry), 16)),
    ];
    for ((name, a), (_, b)) in pairs.iter().flat_map(|p| reference.iter().zip(p)) {
        assert_eq!(a, b, "{name}");
    }
}

/// A closed mesh, smooth nowhere: a sphere of some 20,000 faces with radii drawn anew for each corner, thin triangles at
/// its poles. A million rays from inside find it on both backends, and so does visibility.
#[test]
fn a_closed_mesh_lets_none_of_a_million_rays_out() {
    let (rows, cols) = (100, 100);
    let mut rng = Rng::new(33, 1000, 0, 0);
    let mut points = vec![Vec3::Z, Vec3::NEG_Z];
    for i in 1..rows {
        for j in 0..cols {
            let (s, c) = (std::f32::consts::PI * i as f32 / rows as f32).sin_cos();
            let (t, d) = (std::f32::consts::TAU * j as f32 / cols as f32).sin_cos();
            points.push(Vec3::new(s * d, s * t, c) * (0.9 + 0.1 * rng.next_f32()));
        }
    }
    let at = |i: usize, j: usize| match i {
        0 => 0,
        _ if i == rows => 1,
        _ => 2 + (i - 1) * cols + j % cols,
    };
    let mut triangles = Vec::new();
    for i in 0..rows {
        for j in 0..cols {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            triangles.extend(
                [[a, b, c], [a, c, d]]
                    .into_iter()
                    .filter(|[a, b, c]| a != b && b != c && a != c),
            );
        }
    }
    let scene = mesh(&points, &triangles, "");
    let (e, o) = (embree(&scene), Obvhs::new(&scene.geometry));
    (0..1000u32).into_par_iter().for_each(|block| {
        let mut rng = Rng::new(34, 1000, block, 0);
        for _ in 0..1000 {
            let from = warp::sphere(rng.next_vec2()) * (0.8 * rng.next_f32());
            let ray = to_infinity(from, warp::sphere(rng.next_vec2()));
            let (a, b) = (closest(&e, &ray), closest(&o, &ray));
            let (Some(a), Some(b)) = (a, b) else {
                panic!("{ray:?} leaves the mesh: {a:?} {b:?}");
            };
            // Neighbours tie on an edge; the distance then differs by roundings of coordinates and depth: 2⁻¹⁸ at most.
            assert!(a.prim == b.prim || (a.t - b.t).abs() < 4e-6, "{a:?} {b:?}");
            assert!(e.occluded(&ray) && o.occluded(&ray), "{ray:?}");
            let s = surface(&scene.geometry, &a, &ray);
            assert!(closest(&e, &s.ray(-ray.d)).is_some(), "back from {s:?}");
        }
    });
}
