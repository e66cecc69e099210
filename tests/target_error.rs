//! `--target-error` and the error in files, as a user meets them.

use assert_cmd::Command;
use metrolux::output::read_image;
use serde_json::Value;
use std::fs;

/// The channel and the attribute say the same, and a target ends the render where it can.
#[test]
fn an_error_is_written_and_stops_a_render() {
    let dir = tempfile::tempdir().expect("a folder");
    let (out, stats) = (dir.path().join("a.exr"), dir.path().join("s.json"));
    let render = |extra: &[&str]| -> (String, Value) {
        let mut c = Command::new(env!("CARGO_BIN_EXE_metrolux"));
        let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/cornell.pbrt");
        c.args(["render", scene, "--resolution", "8x6", "--max-depth", "3"]);
        let done = c
            .arg("-o")
            .arg(&out)
            .arg("--stats")
            .arg(&stats)
            .args(extra)
            .assert()
            .code(0);
        let json = serde_json::from_slice(&fs::read(&stats).expect("stats")).expect("JSON");
        let told = String::from_utf8(done.get_output().stderr.clone()).expect("UTF-8");
        (told, json)
    };
    for (integrator, target) in [("mlt", "0.2"), ("pt", "0.3"), ("bdpt", "0.3")] {
        let how = ["--integrator", integrator];
        let (told, json) = render(&[&how[..], &["--target-error", target]].concat());
        assert!(told.contains(" % reached"), "{told}");
        let error = &json["error"];
        let relative = error["relative"].as_f64().expect("a number");
        assert!(relative > 0.0 && relative <= target.parse().expect("a number"));
        assert_eq!(error["target_met"], true);
        // Of camera samples, four whole blocks.
        assert!(error["degrees_of_freedom"].as_u64() >= Some(3), "{error}");
        let done = json
            .pointer("/mlt/rounds")
            .or(json.get("samples_per_pixel"));
        let done = done.and_then(Value::as_u64).expect("a number of rounds");
        assert!(done.is_power_of_two(), "{integrator}: {done}");

        let file = exr::prelude::read_all_flat_layers_from_file(&out).expect("an EXR");
        let layer = &file.layer_data[0];
        let attribute = layer
            .attributes
            .other
            .get(&exr::prelude::Text::from("relativeError"));
        let Some(exr::prelude::AttributeValue::Text(text)) = attribute else {
            panic!("{attribute:?}");
        };
        assert_eq!(text.to_string().parse::<f64>().expect("a number"), relative);
        let channel = layer.channel_data.list.iter().find(|c| c.name == *"error");
        let se = channel.expect("the channel").sample_data.values_as_f32();
        let square: f64 = se.map(|v| (v as f64).powi(2)).sum::<f64>() / 48.0;
        let rgb = read_image(&out).expect("an image").rgb;
        // To the left and right of the box there is nothing.
        let black = rgb.iter().filter(|p| **p == [0.0; 3]).count();
        assert!(
            black > 0 && error["black_pixels"] == black,
            "{error} {black}"
        );
        let y = rgb.iter().map(|p| metrolux::study::metrics::luminance(*p));
        let again = square.sqrt() / (y.sum::<f64>() / 48.0);
        // Four digits of BT.709's luminance.
        assert!((again / relative - 1.0).abs() < 1e-3, "{again} {relative}");
    }
    let (told, json) = render(&["--target-error", "1e-6", "--rounds", "3"]);
    assert!(told.contains("not reached"), "{told}");
    assert_eq!(json["error"]["target_met"], false);
    assert_eq!(json["mlt"]["rounds"], 3);
    let (told, json) = render(&["--rounds", "1"]);
    assert!(
        told.contains("relative error") && !told.contains("target"),
        "{told}"
    );
    assert!(json["error"].get("target_met").is_none());
    let wide = ["--target-error", "1e-9", "--time-limit", "200ms"];
    assert!(render(&wide).0.contains("not reached"));
}
