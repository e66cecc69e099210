//! The command, stopped, killed, out of room, shared out.

use assert_cmd::Command;
use metrolux::integrator::State;
use metrolux::output::{RunFile, read_image};
use metrolux::sampling::Rng;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Process, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A render of about a second: the arguments that all of one test's commands share.
const WORK: [&str; 8] = [
    "--resolution",
    "48x36",
    "--max-depth",
    "6",
    "--threads",
    "1",
    "--rounds",
    "160",
];

/// Makes `a.exr` and keeps `a.run`.
const KEPT: [&str; 4] = ["-o", "a.exr", "--checkpoint", "a.run"];

/// The same as often as `every`, from where a run before it stopped.
fn going_on(every: &str) -> Vec<&str> {
    [&KEPT[..], &["--every", every, "--resume"]].concat()
}

pub fn scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-glass/cornell-glass.pbrt")
}

pub fn metrolux() -> Command {
    Command::new(env!("CARGO_BIN_EXE_metrolux"))
}

pub fn render(dir: &Path, more: &[&str]) -> Command {
    let mut c = metrolux();
    c.current_dir(dir).arg("render").arg(scene()).args(WORK);
    c.args(more);
    c
}

pub fn start(dir: &Path, more: &[&str]) -> Child {
    let mut c = Process::new(env!("CARGO_BIN_EXE_metrolux"));
    c.current_dir(dir).arg("render").arg(scene()).args(WORK);
    c.args(more).stderr(Stdio::piped());
    c.spawn().expect("the program starts")
}

pub fn signal(child: &Child, name: &str) {
    let done = Process::new("kill")
        .args([name, &child.id().to_string()])
        .status();
    assert!(done.expect("kill runs").success());
}

/// Pixels and error, bit for bit.
pub fn bits(file: &Path) -> Vec<u32> {
    let image = read_image(file).expect("an image");
    image.rgb.iter().flatten().map(|v| v.to_bits()).collect()
}

pub fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder")
}

/// The image of a render that nobody touched.
pub fn untouched(dir: &Path) -> Vec<u32> {
    render(dir, &["-o", "whole.exr"]).assert().code(0);
    bits(&dir.join("whole.exr"))
}

pub fn text(child: Child) -> (Option<i32>, String) {
    let out = child.wait_with_output().expect("it ends");
    (
        out.status.code(),
        String::from_utf8_lossy(&out.stderr).into_owned(),
    )
}

/// Until the process catches signals, or has ended.
fn wait_until_catching(child: &Child) {
    let start = Instant::now();
    loop {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id()));
        let caught = status.unwrap_or_default();
        let mask = caught.lines().find_map(|l| l.strip_prefix("SigCgt:"));
        let mask = mask.and_then(|m| u64::from_str_radix(m.trim(), 16).ok());
        // HUP is signal 1 and the last to be caught.
        if mask.is_none_or(|m| m & 1 == 1) {
            return;
        }
        assert!(start.elapsed() < Duration::from_secs(60), "signals kill it");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Until the checkpoint stands, so that signals are caught and there is something to stop.
pub fn wait_for(file: &Path) {
    let start = Instant::now();
    while !file.exists() {
        assert!(
            start.elapsed() < Duration::from_secs(60),
            "no {}",
            file.display()
        );
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_signal_stops_a_render_and_resume_ends_it() {
    let dir = folder();
    let dir = dir.path();
    let whole = untouched(dir);
    let kept = going_on("10ms");
    for name in ["-TERM", "-INT"] {
        let child = start(dir, &kept);
        wait_until_catching(&child);
        signal(&child, name);
        let (code, said) = text(child);
        assert_eq!(code, Some(75), "{said}");
        assert!(said.contains("--resume goes on from a.run"), "{said}");
        assert!(!dir.join("a.exr").exists(), "an image that is not done");
    }
    // HUP writes what there is and goes on.
    let child = start(dir, &kept);
    wait_until_catching(&child);
    signal(&child, "-HUP");
    let (code, said) = text(child);
    assert_eq!(code, Some(0), "{said}");
    assert!(bits(&dir.join("a.exr")) == whole);
    // Another number of threads, and nothing left to do.
    fs::remove_file(dir.join("a.exr")).expect("there");
    render(dir, &kept).arg("--quiet").assert().code(0);
    assert!(bits(&dir.join("a.exr")) == whole);
}

#[test]
fn without_a_checkpoint_a_signal_leaves_the_image_so_far() {
    let dir = folder();
    let dir = dir.path();
    // Long enough to be met on the way by any machine.
    let child = start(dir, &["-o", "a.exr", "--mutations", "1e5"]);
    // `--rounds` and `--mutations` do not go together.
    assert_eq!(text(child).0, Some(2));
    let mut c = Process::new(env!("CARGO_BIN_EXE_metrolux"));
    c.current_dir(dir).arg("render").arg(scene());
    c.args(["--resolution", "16x12", "--time-limit", "1m", "-o", "a.exr"]);
    let child = c.stderr(Stdio::piped()).spawn().expect("it starts");
    wait_until_catching(&child);
    // Before there is an image it writes none when it is asked for it.
    while !dir.join("a.exr").exists() {
        signal(&child, "-HUP");
        std::thread::sleep(Duration::from_millis(20));
    }
    fs::remove_file(dir.join("a.exr")).expect("there");
    signal(&child, "-TERM");
    let (code, said) = text(child);
    assert_eq!(code, Some(143), "{said}");
    assert!(said.contains("the image so far was written"), "{said}");
    assert_eq!(bits(&dir.join("a.exr")).len(), 16 * 12 * 3);
}

#[test]
fn checkpoints_of_other_renders_are_refused_with_what_differs() {
    let dir = folder();
    let dir = dir.path();
    let required = [&KEPT[..], &["--resume=require"]].concat();
    let refused = |more: &[&str], all: &[&str], says: &[&str]| {
        let done = render(dir, all).args(more).assert().code(2);
        let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        for s in says {
            assert!(said.contains(s), "{s}: {said}");
        }
    };
    refused(&[], &required, &["a.run is not there"]);
    render(dir, &KEPT).assert().code(0);
    refused(&[], &KEPT, &["a.run is there already", "--resume"]);
    let seed = ["a.run: is of another render: seed is 1 there and 7 here"];
    refused(&["--seed", "7"], &required, &seed);
    let several = [
        "max depth is 6 there and 5 here",
        "direct is \"separate\" there",
    ];
    let mut other = vec!["--direct", "chain"];
    other.extend(["-o", "b.exr"]);
    let mut c = metrolux();
    c.current_dir(dir).arg("render").arg(scene());
    c.args([
        "--resolution",
        "48x36",
        "--max-depth",
        "5",
        "--rounds",
        "160",
    ]);
    let done = c.args(&required).args(other).assert().code(2);
    let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(several.iter().all(|s| said.contains(s)), "{said}");
    // Damage, one way and the other.
    let bytes = fs::read(dir.join("a.run")).expect("there");
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 16;
    fs::write(dir.join("a.run"), flipped).expect("written");
    refused(&[], &required, &["a.run: is damaged", "checksum"]);
    fs::write(dir.join("a.run"), &bytes[..bytes.len() - 5]).expect("written");
    refused(&[], &required, &["a.run: is cut short"]);
    fs::write(dir.join("a.run"), "P6 1 1").expect("written");
    refused(&[], &required, &["a.run: is no checkpoint"]);
    // A folder that cannot be written to: before the render, not after it.
    let mut c = render(dir, &["-o", "a.exr", "--checkpoint", "/proc/none/a.run"]);
    c.assert().code(4);
}

/// Rounds that a checkpoint holds; it must be whole.
fn rounds(file: &Path) -> u64 {
    if !file.exists() {
        return 0;
    }
    let run = RunFile::read(file).expect("a whole checkpoint");
    State::read(&mut run.run()).expect("a state").rounds()
}

/// Temporary files in a folder: left by a kill between the making of one and its new name.
pub fn cut_files(dir: &Path) -> usize {
    let all = fs::read_dir(dir).into_iter().flatten().flatten();
    all.filter(|f| f.path().extension().is_some_and(|e| e == "part"))
        .count()
}

/// Kills a render `kills` times at random moments: one time in four anywhere from its start on, else some time after it has
/// written a checkpoint of its own. The checkpoint is whole each time and never falls back, and each render that comes to
/// its end has the image of one that nobody touched.
fn killed(kills: u32) {
    let dir = folder();
    let dir = dir.path();
    let whole = untouched(dir);
    let kept = going_on("1ms");
    let (file, image) = (dir.join("a.run"), dir.join("a.exr"));
    let written = || fs::metadata(&file).and_then(|m| m.modified()).ok();
    let mut rng = Rng::new(9, 9, 9, 9);
    let (mut done, mut ends, mut seen, mut between) = (0, 0, 0, 0);
    while done < kills {
        let before = written();
        let mut child = start(dir, &kept);
        let mut runs = || child.try_wait().expect("it runs or has ended").is_none();
        if rng.next_f64() < 0.25 {
            std::thread::sleep(Duration::from_secs_f64(0.2 * rng.next_f64()));
        } else {
            while runs() && written() == before {
                std::thread::sleep(Duration::from_millis(1));
            }
            std::thread::sleep(Duration::from_secs_f64(0.1 * rng.next_f64()));
        }
        if runs() {
            child.kill().expect("it can be killed");
            done += 1;
        }
        let (code, said) = text(child);
        assert!(code.is_none() || code == Some(0), "{code:?}: {said}");
        between += u32::from(cut_files(dir) > 0);
        let now = rounds(&file);
        assert!(now >= seen, "{now} rounds after {seen}");
        seen = now;
        if code == Some(0) {
            assert!(bits(&image) == whole, "after {done} kills");
            fs::remove_file(&image).expect("there");
            fs::remove_file(&file).expect("there");
            (ends, seen) = (ends + 1, 0);
        }
    }
    render(dir, &kept).assert().code(0);
    assert!(bits(&image) == whole, "after {done} kills");
    // The temporary file that the last kill may have left is gone.
    assert!(!dir.join(".a.run.part").exists());
    assert!(
        done < 100 || between > 0,
        "no kill came between temporary file and rename"
    );
    println!(
        "{done} kills, {between} of them between temporary file and rename, {} whole renders",
        ends + 1
    );
}

#[test]
fn a_dozen_kills_leave_no_trace() {
    killed(12);
}

#[test]
#[ignore = "minutes; make test-long"]
fn two_hundred_kills_leave_no_trace() {
    killed(200);
}

#[test]
fn parts_of_a_render_are_merged_by_the_command() {
    let dir = folder();
    let dir = dir.path();
    let whole = untouched(dir);
    for k in ["1", "2", "3"] {
        let name = format!("part.{k}");
        let shard = format!("{k}/3");
        render(dir, &["--shard", &shard, "-o", &name])
            .assert()
            .code(0);
    }
    let merge = |parts: &[&str], code: i32, says: &str| {
        let mut c = metrolux();
        c.current_dir(dir).arg("merge").args(parts);
        let done = c.args(["-o", "m.exr"]).assert().code(code);
        let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(said.contains(says), "{says}: {said}");
    };
    merge(
        &["part.3", "part.1", "part.2", "--checkpoint", "m.run"],
        0,
        "3 parts",
    );
    assert!(bits(&dir.join("m.exr")) == whole);
    merge(
        &["part.1", "part.2", "part.1"],
        2,
        "part.1: holds part 1/3, which is there",
    );
    merge(&["part.1", "part.3"], 2, "parts 2 of 3 are missing");
    merge(
        &["part.1", "part.3", "--allow-missing"],
        0,
        "parts 2 of 3 are missing",
    );
    assert!(bits(&dir.join("m.exr")) != whole);
    let bytes = fs::read(dir.join("part.2")).expect("there");
    fs::write(dir.join("short"), &bytes[..bytes.len() / 2]).expect("written");
    merge(&["part.1", "short", "part.3"], 2, "short: is cut short");
    let mut flipped = bytes;
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    fs::write(dir.join("flip"), flipped).expect("written");
    merge(&["part.1", "flip", "part.3"], 2, "flip: is damaged");
    render(dir, &["--shard", "2/3", "-o", "other", "--seed", "5"])
        .assert()
        .code(0);
    merge(
        &["part.1", "other", "part.3"],
        2,
        "other: is of another render: seed is 5",
    );
    // A part is no image, and a time limit does not cut work in the same way everywhere.
    render(dir, &["--shard", "1/3", "-o", "a.exr"])
        .assert()
        .code(2);
    render(dir, &["--shard", "0/3", "-o", "part"])
        .assert()
        .code(2);
    render(dir, &["--shard", "1/3", "-o", "p", "--target-error", "0.1"])
        .assert()
        .code(2);
    // More work for the merged render, from its parts or from its checkpoint.
    let longer = |from: &[&str], out: &str| {
        let mut c = metrolux();
        c.current_dir(dir).arg("render").arg(scene());
        c.args(&WORK[..6])
            .args(["--rounds", "170", "-o", out])
            .args(from);
        c.assert().code(0);
        bits(&dir.join(out))
    };
    let new = longer(&[], "n.exr");
    assert!(new != whole);
    assert!(longer(&["--extend", "m.run"], "e.exr") == new);
    assert!(longer(&["--extend", "part.2", "part.1", "part.3"], "e.exr") == new);
}
