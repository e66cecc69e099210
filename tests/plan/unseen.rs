//! Shapes that no path can meet fall away, if that is certain, and the image keeps its bits.

use super::scene;
use metrolux::accel::{Embree, EmbreeOptions};
use metrolux::integrator::{Budget, Quiet, pt};
use metrolux::path::{Tally, World};
use metrolux::plan::{Effect, Options, Plan, unseen_shapes};
use metrolux::sampling::Rng;
use metrolux::scene::Scene;
use metrolux::scene::subset::leave_out;

/// A camera in the origin that looks along z with a field of view of 90°, over a grey floor, with `more` in its world.
fn text(prelude: &str, depth: u32, more: &str) -> String {
    format!(
        "Integrator \"volpath\" \"integer maxdepth\" {depth}\n\
         Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16\n\
         PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5\n\
         Camera \"perspective\" \"float fov\" 90 {prelude}\nWorldBegin\n\
         Material \"diffuse\"\n\
         Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ -9 -1 9  9 -1 9  9 -1 -9  -9 -1 -9 ]\n{more}"
    )
}

const LAMP: &str = "LightSource \"point\" \"point3 from\" [ 0 1 3 ] \"rgb I\" [ 2 2 2 ]\n";

/// A red sphere.
fn ball(x: f64, y: f64, z: f64, radius: f64) -> String {
    format!(
        "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [ 0.8 0.1 0.1 ] Translate {x} {y} {z}\n\
         Shape \"sphere\" \"float radius\" {radius} AttributeEnd\n"
    )
}

/// How many shapes fall away.
fn unseen(text: &str) -> usize {
    let (mut made, told) = (scene(text), scene(text));
    let plan = Plan::make(&mut made, &Options::default());
    let count = plan.unseen.len();
    assert_eq!(Plan::new(&told, &Options::default()).unseen, plan.unseen);
    let left = told.geometry.prim_count() - made.geometry.prim_count();
    assert_eq!(left, count, "the spheres are gone\n{text}");
    count
}

#[test]
fn what_is_behind_the_camera_or_beside_its_view_falls_away() {
    // Behind; to the right, to the left, above and below, 0.1 off the plane through the lens and the image's border.
    let off = 1.0 + 0.1;
    for (x, y, z) in [(0.0, 0.0, -2.0), (2.0 + off * 2f64.sqrt(), 0.0, 2.0)] {
        for (x, y) in [(x, y), (-x, y), (y, x), (y, -x)] {
            // The lamp stands to the camera's front, within the view.
            let text = text("", 1, &(LAMP.to_owned() + &ball(x, y, z, 1.0)));
            assert_eq!(unseen(&text), 1, "{x} {y} {z}");
            let plan = Plan::new(&scene(&text), &Options::default());
            assert!(!plan.on(Effect::Colour), "its colour is nobody's");
            assert!(plan.text(true).contains("is where no path can come"));
        }
    }
}

#[test]
fn what_a_path_may_meet_stays() {
    let behind = ball(0.0, 0.0, -2.0, 1.0);
    let beside = ball(2.0 + 1.1 * 2f64.sqrt(), 0.0, 2.0, 1.0);
    let lamp = |at: &str| LAMP.replace("0 1 3", at);
    let with = |more: &str| LAMP.to_owned() + more;
    // A second scattering.
    assert_eq!(unseen(&text("", 2, &with(&behind))), 0);
    // On the border of the view, or of the camera's plane.
    let near = ball(2.0 + 0.9 * 2f64.sqrt(), 0.0, 2.0, 1.0);
    assert_eq!(unseen(&text("", 1, &with(&near))), 0);
    assert_eq!(unseen(&text("", 1, &with(&ball(0.0, 0.0, -0.9, 1.0)))), 0);
    // Between a lamp behind the camera, or beside its view, and what is seen.
    assert_eq!(unseen(&text("", 1, &(lamp("0 3 -4") + &behind))), 0);
    assert_eq!(unseen(&text("", 1, &(lamp("9 1 3") + &beside))), 0);
    // Lights at infinity.
    let sun = "LightSource \"distant\"\n";
    assert_eq!(unseen(&text("", 1, &with(&(sun.to_owned() + &behind)))), 0);
    let sky = "LightSource \"infinite\"\n";
    assert_eq!(unseen(&text("", 1, &with(&(sky.to_owned() + &behind)))), 0);
    // Rays of a wide lens leave the view of its centre, but none goes back.
    let wide = "\"float lensradius\" 0.5 \"float focaldistance\" 4";
    assert_eq!(unseen(&text(wide, 1, &with(&beside))), 0);
    assert_eq!(unseen(&text(wide, 1, &with(&behind))), 1);
}

fn image(scene: &Scene, plan: &Plan) -> (Vec<[f64; 3]>, u64) {
    let embree = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree builds");
    let world = World::new(scene, &embree, scene.settings.max_depth).with_plan(plan);
    let mut tally = Tally::default();
    let budget = Budget::Rounds(16);
    let image = match plan.lanes {
        1 => pt::<1, _>(&world, budget, 1, &Quiet, &mut tally).0,
        _ => pt::<4, _>(&world, budget, 1, &Quiet, &mut tally).0,
    };
    (image, tally.rays_closest + tally.rays_visibility)
}

/// Forty random scenes of 30 spheres, some of them mirrors, under lamps anywhere: the same rays and the same image with
/// and without what falls away, bit by bit. With one shape more left out, the first that does not fall away, the images of
/// some scenes change: that much is seen.
#[test]
fn the_image_has_the_same_bits() {
    let (mut gone, mut changed) = (0, 0);
    for number in 0..40 {
        let mut rng = Rng::new(11, 0, number, 0);
        let mut number = |lo: f64, hi: f64| lo + (hi - lo) * rng.next_f64();
        let mut more = String::new();
        for _ in 0..2 {
            let [x, y, z] = [number(-6.0, 6.0), number(0.0, 3.0), number(-1.0, 6.0)];
            more += &LAMP.replace("0 1 3", &format!("{x} {y} {z}"));
        }
        for i in 0..30 {
            let [x, y, z] = [number(-6.0, 6.0), number(-1.0, 4.0), number(-6.0, 6.0)];
            let ball = ball(x, y, z, number(0.1, 0.6));
            more += &match i % 3 {
                0 => ball.replace(
                    "\"diffuse\" \"rgb reflectance\"",
                    "\"conductor\" \"rgb reflectance\"",
                ),
                _ => ball,
            };
        }
        let text = text("", 1, &more);
        let (mut made, whole) = (scene(&text), scene(&text));
        let plan = Plan::make(&mut made, &Options::default());
        gone += plan.unseen.len();
        let all = Plan::new(&whole, &Options::default());
        let kept = image(&made, &plan);
        assert_eq!(kept, image(&whole, &all), "{text}");
        // Shape 0 is the floor.
        let unseen = unseen_shapes(&whole, &all.lit);
        let next = (1..unseen.len()).find(|i| !unseen[*i]);
        let more: Vec<bool> = (0..unseen.len()).map(|i| Some(i) == next).collect();
        leave_out(&mut made, &more);
        changed += usize::from(image(&made, &plan) != kept);
    }
    println!("{gone} shapes fell away; {changed} of 40 images change with one shape more");
    assert!(gone > 200, "{gone}");
    assert!(changed > 4, "{changed}");
}
