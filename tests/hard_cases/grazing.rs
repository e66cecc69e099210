//! Where cosines vanish and geometry terms grow without bound: grazing light and view, corners, touching surfaces,
//! connections of no length.

use super::common::scene::{embree, of_text};
use super::common::stats::{Pair, agree};
use super::{all_images, brings, by_length, images_on, scene_of};
use glam::Vec3;
use metrolux::accel::surface::surface_at;
use metrolux::accel::{Obvhs, visible};
use metrolux::path::{Kind, Palette, Path, Pool, Tally, Vertex, World};
use metrolux::scatter::Mode;
use metrolux::scene::PrimId;
use metrolux::scene::spectrum::{Lanes, Spectrum};

/// Tangent of half the field of view of 0.002 degrees.
const HALF: f64 = 1.745_329_252e-5;

/// Mean of `f` over the window −1 … 1 in both directions, by the midpoint rule.
pub(super) fn over_window(f: impl Fn(f64, f64) -> f64) -> f64 {
    let n = 100;
    let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
    let rows = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    rows.map(|(i, j)| f(at(i), at(j))).sum::<f64>() / f64::from(n * n)
}

/// Camera and point light both some 10⁻⁴ rad above a floor. Its radiance is known: ρ/π·I·cos θ/d².
#[test]
fn light_and_view_within_a_tenth_of_a_milliradian() {
    let scene = of_text(
        4,
        "LookAt -1 0 1e-4  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 0.002",
        r#"LightSource "point" "rgb I" [ 1e5 1e5 1e5 ] "point3 from" [ 1.5 0 1.5e-4 ]
        Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
        Shape "trianglemesh" "point3 P" [ -2 -2 0  2 -2 0  2 2 0  -2 2 0 ] "integer indices" [ 0 1 2 0 2 3 ]"#,
    );
    let expected = over_window(|x, y| {
        // Down by 10⁻⁴ per unit of length, and by the raster point.
        let t = 1e-4 / (1e-4 - y * HALF);
        let (px, py) = (-1.0 + t, x * HALF * t);
        let d2 = (1.5 - px).powi(2) + py * py + 1.5e-4f64.powi(2);
        0.5 / std::f64::consts::PI * 1e5 * 1.5e-4 / d2.powf(1.5)
    });
    let runs = by_length(&scene, 1, 2);
    agree("grazing", &brings("grazing", &runs, 2..=2, expected, 0.02));
}

/// A lamp that stands on the floor, seen where they meet: 1.5·10⁻⁴ from the edge geometry terms reach 10⁸, and yet
/// the floor sees the lamp in nearly half of its sky. The form factor of a rectangle is known.
const CORNER: &str = r#"
    Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
    Shape "trianglemesh" "point3 P" [ 0 -2 0  2 -2 0  2 2 0  0 2 0 ] "integer indices" [ 0 1 2 0 2 3 ]
    AreaLightSource "diffuse" "rgb L" [ 4 4 4 ]
    Shape "trianglemesh" "point3 P" [ 0 -0.5 0  0 0.5 0  0 0.5 1  0 -0.5 1 ] "integer indices" [ 0 1 2 0 2 3 ]"#;

#[test]
fn a_corner_where_geometry_terms_have_no_bound() {
    let camera = "LookAt 1 0 1  1.5e-4 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 0.002";
    let scene = of_text(4, camera, CORNER);
    let away = 2f64.sqrt();
    let expected = over_window(|_, y| {
        // The plane of the image crosses the floor at 45°.
        let a = 1.5e-4 - y * HALF * away * away;
        let (b, c) = (0.5f64, 1.0f64);
        let r = a.hypot(c);
        let factor = ((b / a).atan() - a / r * (b / r).atan()) / std::f64::consts::PI;
        0.5 * 4.0 * factor
    });
    let runs = by_length(&scene, 3, 4);
    let mut pairs = brings("corner", &runs, 2..=2, expected, 0.05);
    // What comes back from the lamp's own face and from the floor again.
    for k in [3, 4] {
        for (name, run) in &runs[1..] {
            pairs.push(Pair {
                name: format!("corner, {k} edges, {name} against pt"),
                found: run.length(k..=k),
                reference: runs[0].1.length(k..=k),
                limit: 0.5,
            });
        }
    }
    agree("corner", &pairs);
}

/// A closed box that stands on a floor, its bottom in the floor's plane, lamps around it, a ball that touches a wall inside:
/// a camera in it sees nothing, exactly.
#[test]
fn nothing_leaks_where_surfaces_touch() {
    let scene = scene_of(
        r#"Film "rgb" "integer xresolution" 8 "integer yresolution" 8
        Integrator "path" "integer maxdepth" 6
        LookAt 0.1 -0.2 0.5  0.3 0.4 0  0 0 1
        Camera "perspective" "float fov" 120
        WorldBegin
        AttributeBegin
        AreaLightSource "diffuse" "rgb L" [ 9 9 9 ] "bool twosided" true
        Shape "trianglemesh" "point3 P" [ -3 -3 1.5  3 -3 1.5  3 3 1.5  -3 3 1.5  -3 -3 -0.5  3 -3 -0.5  3 3 -0.5 ]
            "integer indices" [ 0 1 2 0 2 3 4 5 6 ]
        AttributeEnd
        LightSource "point" "rgb I" [ 9 9 9 ] "point3 from" [ 2 0 0.5 ]
        LightSource "infinite" "rgb L" [ 1 1 1 ]
        LightSource "distant" "rgb L" [ 1 1 1 ] "point3 from" [ 0.3 0.2 1 ] "point3 to" [ 0 0 0 ]
        Shape "trianglemesh" "point3 P" [ -3 -3 0  3 -3 0  3 3 0  -3 3 0 ] "integer indices" [ 0 1 2 0 2 3 ]
        Material "diffuse" "rgb reflectance" [ 0.9 0.9 0.9 ]
        Shape "trianglemesh"
            "point3 P" [ -1 -1 0  1 -1 0  1 1 0  -1 1 0  -1 -1 1  1 -1 1  1 1 1  -1 1 1 ]
            "integer indices" [ 0 2 1 0 3 2  4 5 6 4 6 7  0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7 ]
        Material "dielectric"
        Translate 0.5 0.75 0.25
        Shape "sphere" "float radius" 0.25"#,
    );
    let on_both = [
        all_images(&scene, 16),
        images_on(&scene, &Obvhs::new(&scene.geometry), 16),
    ];
    for (name, image) in on_both.iter().flatten() {
        assert!(image.iter().all(|p| *p == [0.0; 3]), "{name}: {image:?}");
    }
}

/// Points of floor and wall 10⁻⁷ of the scene and less from their edge see each other, and the path over both is finite
/// in every quantity; at no distance at all it carries nothing and is no fault.
#[test]
fn connections_of_no_length_are_finite() {
    let scene = of_text(
        4,
        "LookAt 1 0 1  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 40",
        &format!("{CORNER}\nLightSource \"point\" \"rgb I\" [ 1 1 1 ] \"point3 from\" [ 1 0.5 1 ]"),
    );
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 5);
    let palette = Palette::<4>::new(Lanes::new(0.4));
    let mut pool = Pool::new(8);
    let vertex = |prim, b1, b2| {
        let s = surface_at(&scene.geometry, prim, b1, b2);
        Vertex::from_surface(&scene, PrimId::of(prim), &s, &palette)
    };
    // The floor's edge runs from corner 0 to corner 3, the wall's from 0 to 1.
    let eye = world.lens.sample_vertex(glam::Vec2::ZERO);
    let mut lamp = Vertex::bare(Kind::Point, Vec3::new(1.0, 0.5, 1.0), Vec3::ZERO, 2);
    lamp.emission = Spectrum::ONE;
    for exp in [-3, -7, -9, -20, -46, i32::MIN] {
        let d = if exp == i32::MIN {
            0.0
        } else {
            10f32.powi(exp)
        };
        // Both at y = 0: the middle of the floor's edge, a quarter past the wall's.
        let (floor, wall) = (vertex(1, 0.5 * d, 0.5), vertex(2, 0.5 - d, d));
        let (dir, inv_d2) = floor.towards(&wall);
        assert!(dir.is_finite() && inv_d2.is_finite(), "{d}: {dir} {inv_d2}");
        let see = visible(
            &accel,
            floor.p,
            floor.error,
            floor.ng,
            wall.p,
            wall.error,
            wall.ng,
        );
        assert!(see, "{d}");
        let mut tally = Tally::default();
        let mut path = Path::new(6, Lanes::new(0.4));
        pool.reset();
        for v in [lamp, wall, floor, eye] {
            path.push(pool.put(v), Mode::NonSpecular);
        }
        path.relink(&world, &pool, 0, 3);
        let carries = path.measure(&world, &pool, &mut tally);
        assert_eq!(tally.impossible(), 0, "{d}");
        if carries {
            assert!(path.strategies() && path.total.is_finite(), "{d}: {path:?}");
            assert!(path.rho[..5].iter().all(|r| r.is_finite()), "{d}: {path:?}");
        }
        assert_eq!(carries, d > 0.0, "{d}: {path:?}");
    }
}
