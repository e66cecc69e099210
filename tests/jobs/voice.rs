//! What a render tells programs: events, and progress for engines.

use super::kill::{folder, metrolux, scene};
use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A render of a moment.
fn render(dir: &Path, more: &[&str]) -> Command {
    let mut c = metrolux();
    c.current_dir(dir).arg("render").arg(scene());
    c.args(["--resolution", "16x12", "--rounds", "24"])
        .args(more);
    c
}

pub fn lines(text: &[u8]) -> Vec<Value> {
    let text = std::str::from_utf8(text).expect("UTF-8");
    let each = text.lines();
    each.map(|l| serde_json::from_str(l).unwrap_or_else(|e| panic!("{e}: {l}")))
        .collect()
}

pub fn names(events: &[Value]) -> Vec<&str> {
    let each = events.iter();
    each.map(|e| e["event"].as_str().expect("a name")).collect()
}

pub fn find<'a>(events: &'a [Value], name: &str) -> &'a Value {
    let found = events.iter().find(|e| e["event"] == name);
    found.unwrap_or_else(|| panic!("no {name} in {events:#?}"))
}

#[test]
fn stderr_has_events_and_nothing_else() {
    let dir = folder();
    let dir = dir.path();
    let more = ["-o", "a.exr", "--log", "json", "--stats", "s.json"];
    let kept = ["--checkpoint", "a.run"];
    let done = render(dir, &[&more[..], &kept[..]].concat())
        .assert()
        .code(0);
    assert_eq!(done.get_output().stdout, b"");
    let events = lines(&done.get_output().stderr);
    let all = names(&events);
    assert_eq!((all.first(), all.last()), (Some(&"start"), Some(&"done")));
    let order = [
        "start",
        "plan",
        "progress",
        "checkpoint",
        "written",
        "counters",
        "done",
    ];
    let at = order.map(|n| all.iter().position(|a| *a == n));
    assert!(at.iter().all(Option::is_some) && at.is_sorted(), "{all:?}");
    let start = find(&events, "start");
    assert_eq!(start["seed"], 1);
    assert_eq!(start["resolution"], serde_json::json!([16, 12]));
    assert_eq!(start["outputs"][0], "a.exr");
    let effects = find(&events, "plan")["effects"].as_array().expect("a list");
    assert!(effects.contains(&"indirect".into()), "{effects:?}");
    // Progress goes one way, up to the end.
    let parts: Vec<f64> = events
        .iter()
        .filter(|e| e["event"] == "progress" && e["doing"] == "rendering")
        .map(|e| e["part"].as_f64().expect("a number"))
        .collect();
    assert!(parts.is_sorted() && parts.last() == Some(&1.0), "{parts:?}");
    let bytes = fs::metadata(dir.join("a.run")).expect("there").len();
    assert_eq!(find(&events, "checkpoint")["bytes"], bytes);
    // The counters are those of --stats.
    let stats = fs::read(dir.join("s.json")).expect("written");
    let stats: Value = serde_json::from_slice(&stats).expect("JSON");
    let counters = find(&events, "counters");
    for (key, value) in stats.as_object().expect("a map") {
        assert_eq!(&counters[key], value, "{key}");
    }
    assert_eq!(find(&events, "done")["code"], 0);
    let times: Vec<f64> = events.iter().filter_map(|e| e["time"].as_f64()).collect();
    assert!(times.len() == events.len() && times.is_sorted());
}

#[test]
fn a_log_file_goes_on_with_the_render() {
    let dir = folder();
    let dir = dir.path();
    let more = [
        "-o",
        "a.exr",
        "--log",
        "json=logs/a.jsonl",
        "--checkpoint",
        "a.run",
        "--resume",
    ];
    for _ in 0..2 {
        let done = render(dir, &more).assert().code(0);
        // A person reads on.
        assert!(String::from_utf8_lossy(&done.get_output().stderr).contains("M mutations"));
    }
    let events = lines(&fs::read(dir.join("logs/a.jsonl")).expect("written"));
    let count = |n: &str| names(&events).iter().filter(|a| **a == n).count();
    assert_eq!((count("start"), count("done"), count("written")), (2, 2, 2));
    // Before the render, not after it.
    render(dir, &["-o", "b.exr", "--log", "json=a.run/log"])
        .assert()
        .code(4);
    render(dir, &["-o", "b.exr", "--log", "xml"])
        .assert()
        .code(2);
    assert!(!dir.join("b.exr").exists());
}

#[test]
fn errors_are_events_and_lines_for_engines_too() {
    let dir = folder();
    let dir = dir.path();
    fs::write(dir.join("bad.pbrt"), "WorldBegin\nMaterial \"marble\"\n").expect("written");
    let mut c = metrolux();
    c.current_dir(dir)
        .args(["render", "bad.pbrt", "-o", "a.exr", "--log", "json"]);
    let done = c.args(["--progress", "openjd"]).assert().code(2);
    let events = lines(&done.get_output().stderr);
    let message = find(&events, "message");
    assert_eq!(message["level"], "error");
    assert!(
        message["text"]
            .as_str()
            .is_some_and(|t| t.contains("bad.pbrt:2:1")),
        "{message}"
    );
    assert_eq!(find(&events, "done")["code"], 2);
    let out = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
    assert!(out.starts_with("openjd_fail: bad.pbrt:2:1"), "{out}");
}

/// Percentages in lines of an engine.
fn percents(out: &str) -> Vec<f64> {
    let found = out
        .lines()
        .filter_map(|l| l.strip_prefix("openjd_progress: "));
    found.map(|n| n.parse().expect("a number")).collect()
}

#[test]
fn progress_is_shown_as_asked_for() {
    let dir = folder();
    let dir = dir.path();
    let shown = |how: &str, more: &[&str]| -> (String, String) {
        let all = [&["-o", "a.exr", "--progress", how], more].concat();
        let done = render(dir, &all).assert().code(0);
        let o = done.get_output();
        let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
        (text(&o.stdout), text(&o.stderr))
    };
    let (out, err) = shown("openjd", &["--quiet"]);
    let found = percents(&out);
    assert!(found.is_sorted() && found.last() == Some(&100.0), "{out}");
    let known = |l: &str| l.starts_with("openjd_progress: ") || l.starts_with("openjd_status: ");
    assert!(out.lines().all(known), "{out}");
    assert!(out.contains("openjd_status: rendering"), "{out}");
    assert_eq!(err, "");
    let (out, err) = shown("plain", &["--quiet"]);
    assert_eq!(out, "");
    assert!(err.contains("rendering 100 %, "), "{err}");
    assert!(!err.contains('\r') && !err.contains('\u{1b}'), "{err:?}");
    for how in ["auto", "none"] {
        assert_eq!(shown(how, &["--quiet"]), Default::default());
        let (out, err) = shown(how, &[]);
        assert!(
            out.is_empty() && !err.contains("100 %") && err.contains("mutations"),
            "{err}"
        );
    }
}

/// A reader that goes away, as `head` does, stops no render.
#[test]
fn nobody_has_to_listen() {
    use std::process::{Command as Process, Stdio};
    let dir = folder();
    let mut c = Process::new(env!("CARGO_BIN_EXE_metrolux"));
    c.current_dir(dir.path()).arg("render").arg(scene());
    c.args(["--resolution", "16x12", "--rounds", "40", "-o", "a.exr"]);
    c.args(["--progress", "openjd", "--log", "json"]);
    let mut child = c
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    drop((child.stdout.take(), child.stderr.take()));
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
    assert!(Path::new(&dir.path().join("a.exr")).exists());
}

#[test]
fn merging_tells_of_itself_too() {
    let dir = folder();
    let dir = dir.path();
    for k in ["1", "2"] {
        let (shard, part) = (format!("{k}/2"), format!("part.{k}"));
        render(dir, &["--shard", &shard, "-o", &part, "-q"])
            .assert()
            .code(0);
    }
    let mut c = metrolux();
    c.current_dir(dir)
        .args(["merge", "part.1", "part.2", "-o", "a.exr"]);
    let done = c
        .args(["--log", "json", "--progress", "openjd"])
        .assert()
        .code(0);
    let events = lines(&done.get_output().stderr);
    let all = names(&events);
    assert_eq!(all[0], "start");
    assert_eq!(all[all.len() - 1], "done");
    assert!(find(&events, "counters")["mlt"]["rounds"].as_u64() == Some(24));
    let out = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
    assert_eq!(percents(&out).last(), Some(&100.0), "{out}");
}

/// Commands that look at a render without making it refuse what they would have to ignore, and keep to the rest.
#[test]
fn what_only_a_render_can_do_is_refused_elsewhere() {
    let scene = scene().display().to_string();
    let looks: [&[&str]; 5] = [
        &["plan", &scene],
        &["verify", &scene, "--steps", "1"],
        &["replay", &scene, "--chain", "0", "--step", "0"],
        &["predict", &scene, "--target-error", "0.1", "--"],
        &["study", &scene, "-o", "study", "--"],
    ];
    let dir = folder();
    for look in looks {
        for option in [
            "--log=json",
            "--progress=plain",
            "--checkpoint=a.run",
            "--preview=tev",
        ] {
            let mut c = metrolux();
            let done = c.current_dir(dir.path()).args(look).arg(option);
            let done = done.assert().code(2);
            let o = done.get_output();
            let said = String::from_utf8_lossy(&o.stderr).into_owned();
            let name = option.split('=').next().expect("a name");
            let expected = format!("`metrolux {}` cannot take it", look[0]);
            assert!(said.contains(name) && said.contains(&expected), "{said}");
            assert!(o.stdout.is_empty());
        }
    }
    assert!(!dir.path().join("a.run").exists());
    // Layers of direct light ask for a pass of its own, and the plan says so.
    let plan = |more: &[&str]| {
        let mut c = metrolux();
        let done = c.args(["plan", &scene, "--two-stage=off"]).args(more);
        String::from_utf8_lossy(&done.assert().code(0).get_output().stdout).into_owned()
    };
    let separate = |text: &str| text.contains("direct light   separate, as the command line says");
    assert!(
        separate(&plan(&["--layers=direct"])),
        "{}",
        plan(&["--layers=direct"])
    );
    assert!(!separate(&plan(&[])), "{}", plan(&[]));
}
