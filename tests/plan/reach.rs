//! Lights that give nothing fall away, if that is certain, and only then.

use super::scene;
use metrolux::plan::{Dark, Options, Plan};

fn plan(world: &str) -> Plan {
    let text = format!(
        "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\n\
         LookAt 0 0 -3  0 0 0  0 1 0 Camera \"perspective\"\nWorldBegin\n{world}"
    );
    Plan::new(&scene(&text), &Options::default())
}

/// A lamp in the plane y = 1 that shines up, or down.
fn lamp(up: bool) -> String {
    let indices = if up { "0 1 2" } else { "0 2 1" };
    format!(
        "Shape \"sphere\" \"float radius\" 0.5\nAreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ]\n\
         Shape \"trianglemesh\" \"integer indices\" [ {indices} ] \"point3 P\" [ 0 1 0  0 1 1  1 1 0 ]"
    )
}

#[test]
fn a_lamp_with_everything_behind_it_is_not_sampled() {
    let up = plan(&lamp(true));
    assert_eq!(up.lit, [false]);
    assert_eq!(up.unlit[0].why, Dark::FacesAway);
    assert!(
        up.text(true).contains("0 of 1 are sampled"),
        "{}",
        up.text(true)
    );
    assert_eq!(plan(&lamp(false)).lit, [true]);
    // Something above it, be it ever so little, or another side that shines.
    let above = lamp(true)
        + "\nAttributeBegin Translate 0 1.0001 0 Shape \"sphere\" \"float radius\" 0.0002 AttributeEnd";
    assert_eq!(plan(&above).lit[..1], [true]);
    let both = lamp(true).replace("[ 1 1 1 ]", "[ 1 1 1 ] \"bool twosided\" true");
    assert_eq!(plan(&both).lit, [true]);
}

#[test]
fn a_lamp_the_camera_sees_is_sampled() {
    let text = lamp(true);
    let seen = format!("LookAt 0 3 0  0 0 0  0 0 1 Camera \"perspective\"\nWorldBegin\n{text}");
    let plan = Plan::new(&scene(&seen), &Options::default());
    assert_eq!(plan.lit, [true]);
}

#[test]
fn a_spot_that_points_away_is_not_sampled() {
    let spot = |to: &str| {
        plan(&format!(
            "LightSource \"spot\" \"point3 from\" [ 0 0 -2 ] \"point3 to\" [ {to} ]\nShape \"sphere\""
        ))
    };
    assert_eq!(spot("0 0 -9").unlit[0].why, Dark::Misses);
    assert_eq!(spot("0 0 0").lit, [true]);
    // A part of the box around the scene is before it, though the cone is narrow.
    assert_eq!(spot("0 -9 -1.9").lit, [true]);
}

#[test]
fn black_lights_are_not_sampled() {
    let plan = plan(
        "LightSource \"point\" \"float scale\" 0\nLightSource \"infinite\" \"rgb L\" [ 0 0 0 ]\n\
         LightSource \"distant\"\nShape \"sphere\"",
    );
    assert_eq!(plan.lit, [false, false, true]);
    let why: Vec<Dark> = plan.unlit.iter().map(|u| u.why).collect();
    assert_eq!(why, [Dark::Black, Dark::Black]);
    assert_eq!(plan.unlit[1].light.at.as_ref().expect("a place").line, 5);
}
