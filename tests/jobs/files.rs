//! Files of one command that get into each other's way, and names that are no text.

use super::kill::{bits, folder, metrolux, render, scene, signal};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command as Process, Stdio};

/// A picture that must stay.
fn picture(dir: &Path, name: &str) -> Vec<u8> {
    let small = ["--rounds", "1", "--resolution", "4x4", "-q", "-o", name];
    let mut c = metrolux();
    c.current_dir(dir).arg("render").arg(scene()).args(small);
    c.assert().code(0);
    fs::read(dir.join(name)).expect("there")
}

/// A command that must fail as a usage error.
fn refused(dir: &Path, args: &[&str]) {
    let done = metrolux().current_dir(dir).args(args).assert().code(2);
    let told = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(told.contains("is named for two things"), "{args:?}: {told}");
}

#[test]
fn a_file_is_named_for_one_thing() {
    let dir = folder();
    let before = picture(dir.path(), "a.png");
    let sky = "LookAt 0 0 5 0 0 0 0 1 0\nCamera \"perspective\"\nWorldBegin\n\
               LightSource \"infinite\" \"string filename\" \"a.png\"\nShape \"sphere\"\n";
    fs::write(dir.path().join("s.pbrt"), sky).expect("written");
    let all: [&[&str]; 6] = [
        &["render", "s.pbrt", "-o", "b.png", "-o", "./b.png"],
        &["render", "s.pbrt", "-o", "b.png", "--stats", "b.png"],
        &["render", "s.pbrt", "-o", "b.png", "--checkpoint", "b.png"],
        &["render", "s.pbrt", "-o", "a.png"],
        &["render", "s.pbrt", "-o", "b.png", "--stats", "s.pbrt"],
        &["compare", "a.png", "a.png", "--diff", "./a.png"],
    ];
    for args in all {
        refused(dir.path(), args);
    }
    let part = [
        "render",
        "s.pbrt",
        "--resolution",
        "4x4",
        "--integrator",
        "mlt",
        "--mutations",
        "1",
    ];
    let mut c = metrolux();
    c.current_dir(dir.path())
        .args(part)
        .args(["--shard", "1/1", "-o", "part"]);
    c.assert().code(0);
    let whole = fs::read(dir.path().join("part")).expect("there");
    refused(
        dir.path(),
        &["merge", "part", "-o", "b.png", "--stats", "part"],
    );
    // A checkpoint is not written over, whatever it is of.
    let merge = ["merge", "part", "--checkpoint", "a.png"];
    metrolux()
        .current_dir(dir.path())
        .args(merge)
        .assert()
        .code(2);
    assert!(fs::read(dir.path().join("part")).expect("there") == whole);
    assert!(fs::read(dir.path().join("a.png")).expect("there") == before);
    assert_eq!(
        fs::read_to_string(dir.path().join("s.pbrt")).expect("there"),
        sky
    );
    assert!(!dir.path().join("b.png").exists());
}

/// The signal comes while the plan, the pilot and the test image are made, before the first round.
#[test]
fn a_render_that_was_stopped_before_its_first_round_leaves_the_image_before() {
    let dir = folder();
    let before = picture(dir.path(), "a.png");
    let long = ["-o", "a.png", "--two-stage", "--resolution", "900x900"];
    let shown = ["--rounds", "1", "--progress", "plain"];
    let mut c = Process::new(env!("CARGO_BIN_EXE_metrolux"));
    c.current_dir(dir.path()).arg("render").arg(scene());
    c.args(long).args(shown).stderr(Stdio::piped());
    let mut child = c.spawn().expect("the program starts");
    let mut lines = BufReader::new(child.stderr.take().expect("piped")).lines();
    let mut line = || lines.next().expect("a line").expect("UTF-8");
    // By then it listens.
    while !line().contains("building") {}
    signal(&child, "-TERM");
    let told: Vec<String> = lines.map(|l| l.expect("UTF-8")).collect();
    let code = child.wait().expect("it ends").code();
    assert_eq!(code, Some(143), "{told:?}");
    let yet = |l: &String| l.contains("there is no image yet");
    assert!(told.iter().any(yet), "{told:?}");
    assert!(fs::read(dir.path().join("a.png")).expect("there") == before);
}

/// File names are bytes.
#[cfg(unix)]
#[test]
fn names_need_not_be_text() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let dir = folder();
    let name = |bytes: &'static [u8]| dir.path().join(OsStr::from_bytes(bytes));
    let (image, kept, stats) = (name(b"\xff.exr"), name(b"\xfe.run"), name(b"\xfd.json"));
    let mut c = render(dir.path(), &["--log", "json=log.jsonl", "-o"]);
    c.arg(&image)
        .arg("--checkpoint")
        .arg(&kept)
        .arg("--stats")
        .arg(&stats);
    c.assert().code(0);
    assert!(!bits(&image).is_empty() && kept.is_file() && stats.is_file());
    let log = fs::read_to_string(dir.path().join("log.jsonl")).expect("there");
    for event in ["start", "checkpoint", "written", "done"] {
        assert!(
            log.contains(&format!("\"event\":\"{event}\"")),
            "{event}: {log}"
        );
    }
}
