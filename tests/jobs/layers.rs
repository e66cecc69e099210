//! Layers of an EXR file, against what they must be in scenes that can be reckoned by hand.

use super::kill::{folder, metrolux, scene};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

type Channels = BTreeMap<String, Vec<f32>>;

fn channels(file: &Path) -> Channels {
    use exr::prelude::{ReadChannels as _, ReadLayers as _};
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(file)
        .expect("an EXR file");
    let list = image.layer_data.channel_data.list;
    let each = list
        .iter()
        .map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()));
    each.collect()
}

fn render(dir: &Path, scene: &Path, more: &[&str]) -> Channels {
    let mut c = metrolux();
    c.current_dir(dir).arg("render").arg(scene).args(more);
    c.args(["-q", "-o", "a.exr"]).assert().code(0);
    channels(&dir.join("a.exr"))
}

/// A wall of two colours that faces the camera 4 units away, and nothing above it.
const WALL: &str = r#"
    Film "rgb" "integer xresolution" 8 "integer yresolution" 8
    PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
    LookAt 1 2 3  1 2 7  0 1 0
    Camera "perspective" "float fov" 90
    WorldBegin
    LightSource "point" "point3 from" [1 2 3] "rgb I" [9 9 9]
    Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
    Shape "bilinearmesh" "point3 P" [-9 -9 7  1 -9 7  -9 2 7  1 2 7]
    Material "diffuse" "rgb reflectance" [0.8 0.4 0.1]
    Shape "bilinearmesh" "point3 P" [1 -9 7  11 -9 7  1 2 7  11 2 7]
"#;

#[test]
fn the_first_hit_is_what_the_scene_says() {
    let dir = folder();
    let dir = dir.path();
    fs::write(dir.join("wall.pbrt"), WALL).expect("written");
    let wanted = [
        "--layers",
        "albedo,normal,depth",
        "--integrator",
        "pt",
        "--spp",
        "4",
    ];
    let found = render(dir, Path::new("wall.pbrt"), &wanted);
    let names: Vec<&str> = found.keys().map(String::as_str).collect();
    let all = [
        "B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "depth.Z", "error",
    ];
    assert_eq!(
        names,
        [&all[..], &["normal.X", "normal.Y", "normal.Z"]].concat()
    );
    let at = |name: &str, x: usize, y: usize| found[name][y * 8 + x];
    for y in 0..8 {
        for x in 0..8 {
            let albedo = ["R", "G", "B"].map(|c| at(&format!("albedo.{c}"), x, y));
            let normal = ["X", "Y", "Z"].map(|c| at(&format!("normal.{c}"), x, y));
            let depth = at("depth.Z", x, y);
            if y < 4 {
                assert_eq!((albedo, normal), ([0.0; 3], [0.0; 3]), "{x} {y}");
                assert!(depth == f32::INFINITY, "{x} {y}: {depth}");
                continue;
            }
            assert!((depth - 4.0).abs() < 1e-4, "{x} {y}: {depth}");
            assert!((normal[2] + 1.0).abs() < 1e-5, "{x} {y}: {normal:?}");
            // pbrt's x axis points right; of the colour a spectrum is made, which 64 wavelengths look at.
            let (expected, allowed) = if x < 4 {
                ([0.5; 3], 1e-4)
            } else {
                ([0.8, 0.4, 0.1], 0.03)
            };
            for c in 0..3 {
                assert!(
                    (albedo[c] - expected[c]).abs() < allowed,
                    "{x} {y}: {albedo:?}"
                );
            }
        }
    }
    // The same pixels with another seed and number of threads, and with other backends.
    let seeds = ["--seed", "9", "--threads", "1", "--accel", "obvhs"];
    let again = render(dir, Path::new("wall.pbrt"), &[&wanted[..], &seeds].concat());
    for name in names.iter().filter(|n| n.contains('.')) {
        assert!(again[*name] == found[*name], "{name}");
    }
}

#[test]
fn direct_and_indirect_light_make_the_image() {
    let dir = folder();
    let dir = dir.path();
    let work = ["--resolution", "24x18", "--rounds", "40"];
    let wanted = ["--layers", "direct,indirect"];
    let found = render(dir, &scene(), &[&work[..], &wanted].concat());
    for c in ["R", "G", "B"] {
        let (d, i) = (
            &found[&format!("direct.{c}")],
            &found[&format!("indirect.{c}")],
        );
        assert!(d.iter().sum::<f32>() > 0.0 && i.iter().sum::<f32>() > 0.0);
        for (p, v) in found[c].iter().enumerate() {
            let sum = d[p] + i[p];
            // One rounding to f32 of each.
            assert!(
                (sum - v).abs() <= 2.0 * f32::EPSILON * (d[p].abs() + i[p].abs()),
                "{p}: {sum} {v}"
            );
        }
    }
    // Direct light alone is what is left without indirect light.
    let short = [&work[..], &["--max-depth", "1"]].concat();
    let alone = render(dir, &scene(), &[&short[..], &wanted].concat());
    assert!(alone["indirect.G"].iter().all(|v| *v == 0.0));
    assert!(alone["direct.G"] == alone["G"]);
    let mean = |v: &[f32]| v.iter().map(|v| *v as f64).sum::<f64>() / v.len() as f64;
    let ratio = mean(&found["direct.G"]) / mean(&alone["G"]);
    // A few samples a pixel in both: the lamp's edges dominate, some 2 % of the mean.
    assert!((ratio - 1.0).abs() < 0.2, "{ratio}");
}

#[test]
fn layers_that_cannot_be_are_refused() {
    let dir = folder();
    for (more, says) in [
        (
            &["--layers", "direct", "--integrator", "pt"][..],
            "for --integrator mlt",
        ),
        (
            &["--layers", "indirect", "--direct", "chain"],
            "expected --direct separate",
        ),
        (
            &["--layers", "albedo", "--shard", "1/2", "-o", "part"],
            "not kept in parts",
        ),
        (&["--layers", "depth", "-o", "a.png"], "need an EXR"),
        (&["--layers", "shadow"], "albedo"),
    ] {
        let mut c = metrolux();
        c.current_dir(dir.path())
            .arg("render")
            .arg(scene())
            .args(more);
        if !more.contains(&"-o") {
            c.args(["-o", "a.exr"]);
        }
        let done = c.assert().code(2);
        let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(said.contains(says), "{more:?}: {said}");
    }
}
