//! Chains whose directions are each made of the last one: what bends a direction by a millionth of a radian each time, and
//! always towards the same side, moves a caustic by pixels where the camera looks so closely that turns are small too.

use super::common::scene::{embree, of_file};
use metrolux::path::{Kind, Palette, Start, Tally, Vertex, World, scatter, trace, trace_ray};
use metrolux::sampling::Rng;
use metrolux::scatter::Transport;
use metrolux::scene::spectrum::Lanes;

/// A ray from x in direction w meets y. How far the direction from x to y lies from w towards the normal of x, in the mean
/// over many rays of a room, and the standard error of that mean.
fn bend(
    leave: impl Fn(&World<metrolux::accel::Embree>, &Vertex<4>, glam::Vec3) -> Start,
) -> (f64, f64) {
    let scene = of_file("cornell/cornell.pbrt", 16, 16);
    let embree = embree(&scene);
    let world = World::new(&scene, &embree, 5);
    let palette = Palette::new(Lanes::new(0.5));
    let mut tally = Tally::default();
    let mut rng = Rng::new(1, 0, 0, 0);
    let (mut n, mut sum, mut squares) = (0.0f64, 0.0f64, 0.0f64);
    for i in 0..200_000 {
        rng.set_step(i);
        let eye: Vertex<4> = world.lens.sample_vertex(rng.next_vec2());
        let seen = world
            .lens
            .direction(eye.p, world.lens.sample_raster(rng.next_vec2()));
        let found = trace(&world, &eye, seen, &palette, &mut tally)
            .filter(|x| x.kind == Kind::Surface)
            .and_then(|x| Some((scatter(&x, -seen, Transport::FromEye, &mut rng)?.0, x)))
            .and_then(|(w, x)| {
                let y = trace_ray(&world, leave(&world, &x, w), w, &palette, &mut tally)?;
                (y.kind == Kind::Surface).then_some((x, w, y))
            });
        // Not into the next corner, and not along the surface, where the line would begin far off: there few rays would
        // make all of the mean.
        let clear = |x: &Vertex<4>, w: glam::Vec3, y: &Vertex<4>| {
            x.p.distance(y.p) > 0.1 * x.p.distance(eye.p) && w.dot(x.ng).abs() > 0.02
        };
        let Some((x, w, y)) = found.filter(|(x, w, y)| clear(x, *w, y)) else {
            continue;
        };
        let w = w.as_dvec3();
        let to = (y.p.as_dvec3() - x.p.as_dvec3()).normalize();
        let up = x.ng.as_dvec3() * x.ng.as_dvec3().dot(w).signum();
        let towards = (up - w * w.dot(up)).normalize_or_zero();
        let bend = (to - w / w.length()).dot(towards);
        n += 1.0;
        sum += bend;
        squares += bend * bend;
    }
    assert!(n > 1e5);
    let mean = sum / n;
    (mean, ((squares / n - mean * mean) / n).sqrt())
}

/// Origins beside their points bend every direction towards the normal, by some 4·10⁻⁶ here. With origins on the line
/// nothing is left but roundings, each of at most 2⁻²⁵ in a component below 1.
#[test]
fn directions_do_not_drift_towards_the_normal() {
    let (beside, e) = bend(|world, x, w| world.leave(x, x.p, w));
    println!("origins beside their points bend directions by {beside:e} ± {e:e}");
    assert!(
        beside > 20.0 * e,
        "{beside:e} ± {e:e}: the test cannot see it"
    );
    let (on_line, e) = bend(|world, x, w| world.leave_on_line(x, w));
    println!("origins on the line bend directions by {on_line:e} ± {e:e}");
    assert!(on_line.abs() < 0.5f64.powi(25), "{on_line:e} ± {e:e}");
}
