//! The command: it plans, renders, can be stopped, goes on, and each of its points can be made again.

use assert_cmd::Command;
use metrolux::output::read_image;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process;

fn scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.pbrt")
}

fn metrolux() -> Command {
    Command::new(env!("CARGO_BIN_EXE_metrolux"))
}

/// A study of path tracing, which needs no seeding: small enough for any test machine.
pub fn small_study(out: &Path, budget: &str) -> Vec<String> {
    let scene = scene().display().to_string();
    let out = out.display().to_string();
    let words = [
        "study", &scene, "-o", &out, "--budget", budget, "--repeat", "2", "--axis", "depth",
        "--axis", "accel",
    ];
    let shared = [
        "--reference-integrator",
        "pt",
        "--",
        "--integrator",
        "pt",
        "--resolution",
        "10x10",
        "--max-depth",
        "5",
    ];
    words
        .iter()
        .chain(&shared)
        .map(|w| (*w).to_owned())
        .collect()
}

/// Points of a folder with the time they were written.
fn points(dir: &Path) -> Vec<(PathBuf, std::time::SystemTime)> {
    let entries = fs::read_dir(dir.join("points"))
        .into_iter()
        .flatten()
        .flatten();
    let mut all: Vec<_> = entries
        .filter(|e| e.path().extension().is_some_and(|x| x == "json"))
        .map(|e| {
            (
                e.path(),
                e.metadata().and_then(|m| m.modified()).expect("a time"),
            )
        })
        .collect();
    all.sort();
    all
}

/// What the small study says when all its points are made, and those points. A run on a machine that slowed down
/// meanwhile leaves some out, and the same command goes on with them.
fn finished(out: &Path) -> (String, Vec<(PathBuf, std::time::SystemTime)>) {
    let mut before = points(out);
    loop {
        let done = metrolux().args(small_study(out, "8s")).assert().code(0);
        let now = points(out);
        if now == before {
            let text = done.get_output().stdout.clone();
            return (String::from_utf8(text).expect("UTF-8"), now);
        }
        before = now;
    }
}

#[test]
fn a_study_is_planned_made_and_repeated() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("study");
    let dry: Vec<String> = [
        small_study(&out, "8s")[..2].to_vec(),
        vec!["--dry-run".into()],
        small_study(&out, "8s")[2..].to_vec(),
    ]
    .concat();
    let told = metrolux().args(&dry).assert().code(0);
    let told = String::from_utf8(told.get_output().stderr.clone()).expect("UTF-8");
    for word in [
        "depth 5, depth 4, depth 2",
        "obvhs",
        "5 settings",
        "of the 8 s allowed",
    ] {
        assert!(told.contains(word), "{word} in {told}");
    }
    assert!(points(&out).is_empty());

    let (text, before) = finished(&out);
    for word in [
        "How long need paths be?",
        "Who should answer rays?",
        "Time to reach",
        "depth 2",
    ] {
        assert!(text.contains(word), "{word} in {text}");
    }
    let json: Value =
        serde_json::from_slice(&fs::read(out.join("study.json")).expect("JSON")).expect("JSON");
    let settings = json["settings"].as_array().expect("settings");
    assert_eq!(settings.len(), 5);
    let count: usize = settings
        .iter()
        .map(|s| s["points"].as_array().expect("points").len())
        .sum();
    let table = fs::read_to_string(out.join("study.csv")).expect("CSV");
    assert_eq!(table.lines().count(), count + 1);
    let point = &settings[1]["points"][0];
    for key in [
        "rel_rms", "bias", "rel_mse", "l1", "l2", "l_inf", "mape", "flip",
    ] {
        assert!(point["errors"][key].is_f64(), "{key} in {point}");
    }
    assert!(point["wall_seconds"].as_f64() > Some(0.0) && point["claimed"].is_f64());
    // What the figures hold is tested elsewhere; here they have to be there.
    let parts = &settings[1]["summary"]["parts"];
    assert!(
        parts["bias"]["value"].is_f64() && parts["floor_square"]["high"].is_f64(),
        "{parts}"
    );

    // A point's command makes its image again, to the bit.
    let words = point["command"].as_array().expect("words");
    let again = dir.path().join("again.exr");
    let words = words.iter().map(|w| w.as_str().expect("a word"));
    metrolux()
        .arg("render")
        .args(words)
        .arg("-q")
        .arg("-o")
        .arg(&again)
        .assert()
        .code(0);
    let again = read_image(&again).expect("an image");
    let kept = points(&out)
        .iter()
        .any(|(p, _)| read_image(&p.with_extension("exr")).expect("an image") == again);
    assert!(kept, "{point}");

    let page = fs::read_to_string(out.join("index.html")).expect("a page");
    for foreign in [
        "http:", "https:", "url(", "src=\"/", "@import", "<script", "<link",
    ] {
        assert!(!page.contains(foreign), "{foreign} in the page");
    }
    assert!(page.matches("data:image/").count() > 12 && page.contains("--max-depth 2"));
    assert!(!page.contains("NaN"), "the page holds a NaN");

    // The same again renders nothing, and a point that is lost is made anew.
    metrolux().args(small_study(&out, "8s")).assert().code(0);
    assert_eq!(points(&out), before);
    fs::remove_file(&before[0].0).expect("removed");
    metrolux().args(small_study(&out, "8s")).assert().code(0);
    let after = points(&out);
    assert_eq!(after.len(), before.len());
    assert_eq!(after.iter().zip(&before).filter(|(a, b)| a != b).count(), 1);
}

#[test]
fn what_makes_no_sense_is_told() {
    let dir = tempfile::tempdir().expect("a folder");
    let study = |more: &[&str]| {
        let mut c = metrolux();
        c.arg("study")
            .arg(scene())
            .arg("-o")
            .arg(dir.path().join("s"));
        let done = c.args(more).assert().code(2);
        String::from_utf8(done.get_output().stderr.clone()).expect("UTF-8")
    };
    for (words, about) in [
        (&["--axis", "moods"][..], "moods"),
        (&["--", "--seed", "3"], "--seed"),
        (&["--", "--rounds", "3"], "--rounds"),
        (&["--", "--max-depth", "many"], "many"),
        (
            &["--axis", "depth", "--", "--max-depth", "2"],
            "nothing to vary",
        ),
        (
            &["--reference", "none.exr", "--reference-time", "3s"],
            "cannot be used with",
        ),
        (
            &["--budget", "1ms", "--", "--resolution", "8x8"],
            "too short",
        ),
        (&["--repeat", "0"], "1 to 999"),
    ] {
        let told = study(words);
        assert!(told.contains(about), "{words:?}: {told}");
    }
    let mut c = metrolux();
    c.args(["study", "none.pbrt", "-o"])
        .arg(dir.path().join("s"));
    c.assert().code(2);
}

/// An interrupt ends a study with the page of what is done, and the same command goes on from there.
#[cfg(unix)]
#[test]
fn an_interrupt_leaves_a_page() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("study");
    // A reference of its own would take minutes of the long budget.
    let reference = dir.path().join("ones.exr");
    let ones = metrolux::output::Image {
        width: 10,
        height: 10,
        rgb: vec![[1.0; 3]; 100],
    };
    metrolux::output::write_exr(&reference, &ones, &Default::default(), Default::default())
        .expect("written");
    let given = |words: Vec<String>| -> Vec<String> {
        let at = words
            .iter()
            .position(|w| w == "--reference-integrator")
            .expect("there");
        let mut words = words;
        words.splice(
            at..at + 2,
            ["--reference".to_owned(), reference.display().to_string()],
        );
        words
    };
    let mut child = process::Command::new(env!("CARGO_BIN_EXE_metrolux"))
        .args(given(small_study(&out, "600s")))
        .stderr(process::Stdio::null())
        .stdout(process::Stdio::null())
        .spawn()
        .expect("started");
    let begin = std::time::Instant::now();
    while points(&out).len() < 2 {
        assert!(begin.elapsed().as_secs() < 60, "no point in a minute");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let id = child.id().to_string();
    let sent = process::Command::new("kill")
        .args(["-INT", &id])
        .status()
        .expect("kill");
    assert!(sent.success());
    let code = child.wait().expect("ended").code();
    assert_eq!(code, Some(75));
    let json: Value =
        serde_json::from_slice(&fs::read(out.join("study.json")).expect("JSON")).expect("JSON");
    let count: usize = json["settings"]
        .as_array()
        .expect("settings")
        .iter()
        .map(|s| s["points"].as_array().map_or(0, Vec::len))
        .sum();
    assert!(count >= 2 && count == points(&out).len(), "{count}");
    let page = fs::read_to_string(out.join("index.html")).expect("a page");
    assert!(page.ends_with("</html>\n") && page.contains("data:image/"));
}
