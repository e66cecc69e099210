//! The plans of the committed scenes, as they are printed.

use metrolux::plan::{Options, Plan};
use metrolux::scene::load::{LoadOptions, load_scene};
use std::path::{Path, PathBuf};

fn committed() -> Vec<PathBuf> {
    let mut all = Vec::new();
    for folder in std::fs::read_dir("scenes").expect("tests run in the package") {
        let folder = folder.expect("an entry").path();
        let files = std::fs::read_dir(&folder).into_iter().flatten();
        let files = files.map(|f| f.expect("an entry").path());
        all.extend(files.filter(|f| f.extension().is_some_and(|e| e == "pbrt")));
    }
    all.sort();
    assert!(all.len() >= 9, "{all:?}");
    all
}

#[test]
fn plans_of_the_committed_scenes() {
    let mut text = String::new();
    for path in committed() {
        let scene = load_scene(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let plan = Plan::new(&scene, &Options::default());
        text += &format!(
            "{}\n{}{}\n\n",
            path.display(),
            plan.text(true),
            plan.short(true)
        );
    }
    insta::assert_snapshot!(text);
}

#[test]
fn json_has_every_effect_with_its_causes() {
    let exe = Path::new(env!("CARGO_BIN_EXE_metrolux"));
    let out = std::process::Command::new(exe)
        .args(["plan", "--json", "scenes/cornell-glass/cornell-glass.pbrt"])
        .output()
        .expect("it runs");
    assert!(out.status.success());
    assert!(out.stderr.is_empty());
    let told: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
    let effects = told["effects"].as_array().expect("a list");
    assert_eq!(effects.len(), metrolux::plan::Effect::ALL.len());
    assert_eq!(effects[2]["effect"], "specular");
    assert_eq!(effects[2]["verdict"], "called_for");
    let at = effects[2]["causes"][0]["at"].as_str().expect("a place");
    assert_eq!(at, "scenes/cornell-glass/cornell-glass.pbrt:45:1");
    assert_eq!(told["lanes"], 4);
    assert!(told["strategies"]["caustic"].as_f64().expect("a share") > 0.0);
    assert_eq!(told["embree"]["filter_callback"], false);
    assert_eq!(told["lights"]["chosen_by"], "luminous_power");
    let parts = told["lights"]["chosen"].as_array().expect("a list");
    let sum: f64 = parts.iter().filter_map(|c| c["part"].as_f64()).sum();
    assert!((sum - 1.0).abs() < 1e-9 && parts[0]["light"]["at"].is_string());
}

#[test]
fn decisions_are_told_and_can_be_made_by_the_user() {
    let exe = Path::new(env!("CARGO_BIN_EXE_metrolux"));
    let decisions = |extra: &[&str]| -> serde_json::Value {
        let out = std::process::Command::new(exe)
            .args(["plan", "--json", "scenes/pool/pool.pbrt"])
            .args(extra)
            .output()
            .expect("it runs");
        let text = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.success(), "{extra:?}: {text}");
        let told: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
        told["decisions"].clone()
    };
    let all = decisions(&[]);
    assert_eq!(all["direct"], "in_chain");
    assert_eq!(all["probe"]["samples"], 4096);
    let own = decisions(&["--direct", "chain", "--two-stage"]);
    assert_eq!(own["direct"], "in_chain");
    assert_eq!(own["two_stage"], true);
    assert!(own["probe"].is_null(), "nothing is left to find out");
    let own = decisions(&["--direct", "separate", "--two-stage"]);
    assert_eq!(own["direct"], "separate");
    assert_eq!(own["asked"], true);
    assert!(own["direct_rate"]["noise"].as_f64() > Some(0.0), "{own}");
    assert_eq!(decisions(&["--two-stage=off"])["two_stage"], false);
    // One scattering: the direct pass is all there is.
    let short = decisions(&["--max-depth", "1"]);
    assert_eq!(short["chain"], false);
    assert!(decisions(&["--integrator", "bdpt"]).is_null());
}
