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
        text += &format!("{}\n{}{}\n\n", path.display(), plan.text(), plan.short());
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
}
