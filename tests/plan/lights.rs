//! The choice among lights: told, and made, in proportion to their luminous power.

use super::scene;
use metrolux::accel::{Embree, EmbreeOptions};
use metrolux::path::{Kind, LightPoint, Palette, World};
use metrolux::plan::{Options, Plan};
use metrolux::sampling::Rng;
use metrolux::scene::Light;
use metrolux::scene::spectrum::Lanes;

/// A lamp of two triangles, of 2 square units in all, two points, and one that gives nothing.
const LAMPS: &str = "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\n\
    LookAt 0 0 -3  0 0 0  0 1 0 Camera \"perspective\"\nWorldBegin\n\
    LightSource \"point\" \"rgb I\" [ 1 1 1 ] \"float scale\" 0.5\n\
    LightSource \"point\" \"rgb I\" [ 0 0 0 ]\n\
    LightSource \"point\" \"rgb I\" [ 1 1 1 ] \"float scale\" 2.5\n\
    AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ] \"bool twosided\" true\n\
    Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ 0 1 0  0 1 1  2 1 1  2 1 0 ]\n\
    AttributeEnd\nShape \"sphere\"";

/// 2π, 10π and π·2·2 for both sides of the lamp, so 16π in all.
#[test]
fn parts_are_those_of_the_power() {
    let lamps = scene(LAMPS);
    let plan = Plan::new(&lamps, &Options::default());
    let told: Vec<(u32, usize)> = plan
        .chosen
        .iter()
        .map(|c| (c.light.at.as_ref().expect("a place").line, c.count))
        .collect();
    assert_eq!(told, [(6, 1), (7, 2), (4, 1)]);
    for (c, part) in plan
        .chosen
        .iter()
        .zip([10.0 / 16.0, 4.0 / 16.0, 2.0 / 16.0])
    {
        // Radiances are f32.
        assert!((c.part - part).abs() < 1e-6, "{c:?} {part}");
    }
    let text = plan.text(true);
    assert!(
        text.contains("4 of 5 are sampled, chosen by luminous power"),
        "{text}"
    );
    assert!(
        text.contains(") 25 %, light \"point\" (<text>:4:1)"),
        "{text}"
    );
    assert!(
        text.contains("not light \"point\" emits nothing (<text>:5:1)"),
        "{text}"
    );
}

/// What is told is done: the density of a sampled point is its light's part, over the area of a lamp.
#[test]
fn lights_are_sampled_as_told() {
    let lamps = scene(LAMPS);
    let plan = Plan::new(&lamps, &Options::default());
    let embree = Embree::new(&lamps.geometry, EmbreeOptions::default()).expect("Embree builds");
    let world = World::new(&lamps, &embree, 8).with_plan(&plan);
    let palette: Palette<4> = Palette::new(Lanes::new(0.5));
    let total: f64 = plan.power.iter().sum();
    let mut met = [0; 5];
    for i in 0..1000 {
        let mut rng = Rng::new(1, 0, 0, i);
        let x0 = world
            .emitters
            .sample_point(&lamps, &palette, LightPoint::new(&mut rng));
        let x0 = x0.expect("there are lights");
        let light = x0.light as usize;
        met[light] += 1;
        let part = plan.power[light] / total;
        // Each triangle of the lamp is one square unit, so a density over it is the part itself.
        let lamp = matches!(lamps.lights[light], Light::Area { .. });
        assert_eq!(x0.kind == Kind::Surface, lamp);
        let found = world.emitters.pdf_point(&lamps, &x0);
        assert!((found / part - 1.0).abs() < 1e-6, "{light}: {found} {part}");
    }
    // A thousand draws miss a light of an eighth with a probability below 1e-50.
    for (met, lit) in met.into_iter().zip(&plan.lit) {
        assert_eq!(met > 0, *lit, "{met}");
    }
    assert_eq!(plan.lit.iter().filter(|l| **l).count(), 4);
}
