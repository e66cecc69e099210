//! The program's `--spectral`: the file's layout and what is refused.

use assert_cmd::Command;
use exr::prelude::{self as ex, ReadChannels, ReadLayers};
use std::path::Path;

fn command(extra: &[&str]) -> Command {
    let mut c = Command::new(env!("CARGO_BIN_EXE_metrolux"));
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/cornell.pbrt");
    c.args(["render", scene, "--quiet", "--resolution", "6x4"])
        .args(extra);
    c
}

fn name(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn the_file_has_the_layout() {
    let dir = tempfile::tempdir().unwrap();
    let (exr, png) = (dir.path().join("a.exr"), dir.path().join("a.png"));
    for how in [
        ["--integrator", "pt", "--spp", "2"],
        ["--integrator", "bdpt", "--spp", "2"],
        ["--integrator", "mlt", "--mutations", "16"],
    ] {
        let files = ["-o", name(&exr), "-o", name(&png), "--spectral", "5"];
        command(&how).args(files).assert().success();
        assert!(png.exists());
        let file = ex::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_file(&exr)
            .unwrap();
        let layer = file.layer_data;
        let text = |k: &str| layer.attributes.other.get(&ex::Text::from(k)).cloned();
        let is = |v: &str| Some(ex::AttributeValue::Text(ex::Text::from(v)));
        assert_eq!(text("spectralLayoutVersion"), is("1.0"));
        assert_eq!(text("emissiveUnits"), is("W.m^-2.sr^-1"));
        let channels = &layer.channel_data.list;
        let mut names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
        names.sort();
        // Centres of five slices of 94 nm from 360 nm on.
        let expected = [
            "B",
            "G",
            "R",
            "S0.407,000000nm",
            "S0.501,000000nm",
            "S0.595,000000nm",
            "S0.689,000000nm",
            "S0.783,000000nm",
            "error",
        ];
        assert_eq!(names, expected);
        for c in channels {
            let v: Vec<f32> = c.sample_data.values_as_f32().collect();
            assert_eq!(v.len(), 24);
            assert!(v.iter().all(|v| v.is_finite()));
            assert!(v.iter().any(|v| *v > 0.0), "{} is black", c.name);
        }
    }
}

/// Film `iso` scales bins as it scales colours.
#[test]
fn the_film_scales_bins_and_colours_alike() {
    let dir = tempfile::tempdir().unwrap();
    let read = |iso: u32| {
        let (scene, out) = (dir.path().join("a.pbrt"), dir.path().join("a.exr"));
        let text = format!(
            "Film \"rgb\" \"float iso\" {iso} \"integer xresolution\" 2 \"integer yresolution\" 2\n\
             Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n"
        );
        std::fs::write(&scene, text).unwrap();
        let mut c = Command::new(env!("CARGO_BIN_EXE_metrolux"));
        c.args(["render", name(&scene), "-o", name(&out), "--quiet"])
            .args(["--integrator", "pt", "--spp", "4", "--spectral", "2"])
            .assert()
            .success();
        let file = ex::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_file(&out)
            .unwrap();
        let list = file.layer_data.channel_data.list;
        let sum = |c: &ex::AnyChannel<ex::FlatSamples>| {
            c.sample_data.values_as_f32().map(f64::from).sum::<f64>()
        };
        list.iter().map(sum).collect::<Vec<f64>>()
    };
    for (a, b) in read(100).into_iter().zip(read(400)) {
        // One rounding to f32 on either side.
        assert!((b / a - 4.0).abs() < 1e-5, "{a} {b}");
    }
}

#[test]
fn what_cannot_be_is_a_usage_error() {
    let dir = tempfile::tempdir().unwrap();
    let (exr, png) = (dir.path().join("a.exr"), dir.path().join("a.png"));
    let (exr, png) = (name(&exr), name(&png));
    for wrong in [
        &["-o", png, "--spectral", "8"][..],
        &["-o", exr, "--spectral", "0"],
        &["-o", exr, "--spectral", "129"],
        &["-o", exr, "--spectral", "8", "--target", "luminance"],
        &["-o", exr, "--integrator", "pt", "--target", "luminance"],
    ] {
        command(wrong).assert().code(2);
        assert!(!Path::new(exr).exists() && !Path::new(png).exists());
    }
}

/// The target changes which paths are visited, not the image: here only that both run and differ.
#[test]
fn the_target_can_be_chosen() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("a.exr");
    let bytes = |target: &str| {
        let args = ["-o", name(&out), "--mutations", "16", "--target", target];
        command(&["--integrator", "mlt"])
            .args(args)
            .assert()
            .success();
        std::fs::read(&out).unwrap()
    };
    assert_ne!(bytes("mixed"), bytes("luminance"));
}
