//! `scenes/furnace`: an inward sphere in which every radiance is 1.

use super::Output;
use super::text::Head;

const CAMERA: &str = r#"# Off the centre and askew, so that no symmetry hides an error.
LookAt 0.3 -0.2 0.1   -0.5 0.6 -0.3   0 0 1
Camera "perspective"
    "float fov" 60

WorldBegin

"#;

const SPHERE: &str = r#"Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
ReverseOrientation
Shape "sphere" "float radius" 1
"#;

fn point(intensity: f64) -> String {
    let i = intensity as f32;
    format!("LightSource \"point\" \"rgb I\" [ {i} {i} {i} ] \"point3 from\" [ 0 0 0 ]\n")
}

/// The three scene files.
pub fn outputs() -> Vec<Output> {
    use std::f64::consts::PI;
    let emission = "AreaLightSource \"diffuse\" \"rgb L\" [ 0.5 0.5 0.5 ]\n";
    let file = |name: &str, lights: String| {
        let head = Head {
            film: name,
            depth: 40,
            mutations: 1000,
            samples: 1024,
            resolution: [16; 2],
            ..Head::default()
        };
        let text = format!("{head}{CAMERA}{lights}{SPHERE}");
        Output::text(&format!("furnace/{name}.pbrt"), text)
    };
    vec![
        file("point", point(PI)),
        file("four-points", point(PI / 4.0).repeat(4)),
        file("emission", emission.to_string()),
    ]
}
