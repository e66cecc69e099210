//! What is left where a file system has no room: whole files, and a message.

use super::batch;
use super::kill::{bits, folder, metrolux, render, start, text, untouched, wait_for};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};

/// A small file system, until it is dropped.
struct Small {
    at: PathBuf,
}

impl Small {
    /// Mounts one at `dir`/small; `None` where that is not allowed.
    fn mount(dir: &Path, size: &str) -> Option<Self> {
        let at = dir.join("small");
        fs::create_dir(&at).expect("a folder");
        let mut c = Process::new("mount");
        c.args(["-t", "tmpfs", "-o", &format!("size={size}"), "none"]);
        let mounted = c.arg(&at).stderr(Stdio::null()).status();
        if mounted.is_ok_and(|s| s.success()) {
            return Some(Self { at });
        }
        println!("skipped: a tmpfs cannot be mounted here");
        None
    }

    /// Takes all the room that is left.
    fn fill(&self) {
        let filled = fs::write(self.at.join("filler"), vec![1; 8 << 20]);
        assert!(filled.is_err(), "no full disk");
    }

    fn empty(&self) {
        fs::remove_file(self.at.join("filler")).expect("there");
    }
}

impl Drop for Small {
    fn drop(&mut self) {
        let _ = Process::new("umount").arg(&self.at).status();
    }
}

/// A file system of 900 KB is full before the second checkpoint: the render goes on and says so, the first one stays whole,
/// and only the last one, which is asked for, is an error.
#[test]
fn a_full_disk_loses_no_checkpoint() {
    let dir = folder();
    let Some(small) = Small::mount(dir.path(), "900k") else {
        return;
    };
    let whole = untouched(dir.path());
    let file = small.at.join("a.run").to_string_lossy().into_owned();
    let kept = ["-o", "a.exr", "--checkpoint", &file, "--every", "1ms"];
    let child = start(dir.path(), &kept);
    wait_for(Path::new(&file));
    small.fill();
    let (code, said) = text(child);
    assert_eq!(code, Some(4), "{said}");
    assert!(
        said.contains("warning") && said.contains("the render goes on"),
        "{said}"
    );
    assert!(
        bits(&dir.path().join("a.exr")) == whole,
        "the image is made"
    );
    small.empty();
    let resumed = [&kept[..], &["--resume=require"]].concat();
    render(dir.path(), &resumed).assert().code(0);
    assert!(bits(&dir.path().join("a.exr")) == whole);
}

/// A render whose image has no room is an error; the image before it stays, and once there is room the checkpoint makes it.
#[test]
fn a_full_disk_leaves_the_image_before() {
    let dir = folder();
    let Some(small) = Small::mount(dir.path(), "900k") else {
        return;
    };
    let whole = untouched(dir.path());
    let image = small.at.join("a.exr");
    let name = image.to_string_lossy().into_owned();
    render(dir.path(), &["-o", &name, "--seed", "2"])
        .assert()
        .code(0);
    let before = bits(&image);
    small.fill();
    let kept = ["-o", &name, "--checkpoint", "a.run", "--resume"];
    render(dir.path(), &kept).assert().code(4);
    assert!(bits(&image) == before && before != whole);
    small.empty();
    render(dir.path(), &kept).assert().code(0);
    assert!(bits(&image) == whole);
}

/// The list, its folder and its images are on a file system that is full before the second checkpoint. The batch ends with
/// the code for outputs; each image that is there is whole, and with room the same command makes all of them.
#[test]
fn a_batch_on_a_full_disk_loses_nothing() {
    let dir = folder();
    let Some(small) = Small::mount(dir.path(), "2m") else {
        return;
    };
    let rounds = 160;
    batch::list(dir.path(), rounds);
    let whole = batch::by_hand(dir.path(), rounds);
    let list = batch::list(&small.at, rounds);
    let child = batch::start(&list, &["--every", "1ms", "--keep-going"]);
    batch::wait_for(&list, "checkpoint", 1);
    small.fill();
    let (code, said) = text(child);
    assert_eq!(code, Some(4), "{said}");
    for (name, whole) in batch::NAMES.iter().zip(&whole) {
        let image = small.at.join(format!("out/{name}.exr"));
        assert!(!image.exists() || bits(&image) == *whole, "{name}");
    }
    small.empty();
    let mut c = metrolux();
    c.arg("batch").arg(&list).assert().code(0);
    assert!(batch::images(&small.at) == whole);
}
