//! A scene of another size or at another place is the same picture.

use super::common::estimate::{self, Grid};
use super::common::scene::embree;
use super::common::stats::{Estimate, Pair, agree};
use super::{all_images, chains_on, scene_of, small};
use metrolux::chain::Direct;
use metrolux::path::{Heuristic, World};
use metrolux::scene::Scene;

/// A corner of two walls with a mirror ball, a glass ball, a lamp, a point light and a wide lens, at `scale` times the size.
/// Intensities of points grow with the square, so that irradiance stays. `place` stands before everything, the camera
/// too.
fn room(scale: f64, place: [f64; 3]) -> Scene {
    let [x, y, z] = place;
    let to_world = format!("Translate {x} {y} {z} Scale {scale} {scale} {scale}");
    // The world of the camera is moved the other way.
    let back = 1.0 / scale;
    let to_camera = format!("Scale {back} {back} {back} Translate {} {} {}", -x, -y, -z);
    let power = 3.0 * scale * scale;
    scene_of(&format!(
        r#"
Film "rgb" "integer xresolution" 12 "integer yresolution" 10
Integrator "path" "integer maxdepth" 5
LookAt 0.5 -3 1.25  0 0 0.5  0 0 1
{to_camera}
Camera "perspective" "float fov" 40 "float lensradius" 0.0625 "float focaldistance" 3
WorldBegin
{to_world}
Material "diffuse" "rgb reflectance" [ 0.7 0.6 0.4 ]
Shape "trianglemesh" "point3 P" [ -2 -2 0  2 -2 0  2 2 0  -2 2 0  -2 1 0  2 1 0  2 1 2  -2 1 2 ]
    "integer indices" [ 0 1 2 0 2 3 4 5 6 4 6 7 ]
LightSource "point" "rgb I" [ {power} {power} {power} ] "point3 from" [ -1 -1 1.5 ]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 4 4 3 ]
Shape "trianglemesh" "point3 P" [ -0.5 -0.5 2  -0.5 0.5 2  0.5 0.5 2  0.5 -0.5 2 ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeEnd
AttributeBegin
Translate -0.5 0.25 0.5
Material "conductor" "rgb reflectance" [ 0.8 0.8 0.9 ] "float roughness" 0.04
Shape "sphere" "float radius" 0.5
AttributeEnd
Translate 0.75 -0.5 0.5
Material "dielectric" "float eta" 1.5
Shape "sphere" "float radius" 0.375
"#
    ))
}

/// Lengths enter only as ratios: a size that is a power of two changes no bit of any image, 2²⁰ ≈ 10⁶ either way. A
/// single length in scene units anywhere, be it an epsilon, would show.
#[test]
fn powers_of_two_change_no_bit() {
    let unit = all_images(&room(1.0, [0.0; 3]), 4);
    for power in [-20, -10, 10, 20] {
        let scaled = all_images(&room(2f64.powi(power), [0.0; 3]), 4);
        for ((name, a), (_, b)) in unit.iter().zip(&scaled) {
            assert_eq!(a, b, "{name} at 2^{power} times the size");
        }
    }
}

/// The loader recentres in steps of a power of two above twice the scene's size (here 8): moved by whole steps, some
/// 10⁵ of them, every bit stays.
#[test]
fn whole_steps_change_no_bit() {
    let unit = all_images(&room(1.0, [0.0; 3]), 4);
    for place in [[1e5, -1e5, 1e5], [8e5, 0.0, -3.2e6]] {
        let moved = all_images(&room(1.0, place), 4);
        for ((name, a), (_, b)) in unit.iter().zip(&moved) {
            assert_eq!(a, b, "{name} at {place:?}");
        }
    }
}

/// Any other size and place rounds other bits: the same light within noise, by path length and tile.
#[test]
fn any_size_and_place_is_the_same_picture() {
    let light = |scene: &Scene, seed: u64| {
        let accel = embree(scene);
        let world = World::new(scene, &accel, 4);
        let grid = Grid::new(&world, 6);
        let run = estimate::bdpt::<4, _>(&world, grid, Heuristic::Balance, seed, 32, 64);
        let b = chains_on(&world, &small(Direct::Separate), 1.0).b;
        (run, b)
    };
    // The estimates by length want a pixel's own light.
    let of = |scale, place| {
        let mut scene = room(scale, place);
        scene.settings.filter = super::common::scene::unit_box();
        scene
    };
    let (unit, b) = light(&of(1.0, [0.0; 3]), 1);
    let mut pairs = Vec::new();
    let cases = [
        (1e-6, [0.0; 3]),
        (1e-3, [0.0; 3]),
        (1e3, [0.0; 3]),
        (1e6, [0.0; 3]),
        (1.0, [100_000.37, -99_999.11, 1e5 / 3.0]),
    ];
    for (i, (scale, place)) in cases.into_iter().enumerate() {
        let name = format!("size {scale:e} at {place:?}");
        let (run, its_b) = light(&of(scale, place), 2 + i as u64);
        for k in 1..=5 {
            pairs.push(Pair {
                name: format!("{name}, {k} edges"),
                found: run.length(k..=k),
                reference: unit.length(k..=k),
                limit: 0.25,
            });
        }
        for tile in 0..unit.tiles() {
            pairs.push(Pair {
                name: format!("{name}, tile {tile}"),
                found: run.tile(tile),
                reference: unit.tile(tile),
                limit: 0.25,
            });
        }
        // The same seeds: what differs are roundings, and a few paths that they turn.
        let of_b = |(mean, error): (f64, f64)| Estimate {
            mean,
            variance: error * error,
            freedom: 3.0,
        };
        pairs.push(Pair {
            name: format!("{name}, b"),
            found: of_b(its_b),
            reference: of_b(b),
            limit: f64::INFINITY,
        });
    }
    agree("sizes and places", &pairs);
}
