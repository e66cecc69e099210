//! Jobs for engines: the text that is written, and that a shell reads it as it is meant.
//!
//! `make try-engines` tries them on the engines themselves.

use assert_cmd::Command;
use std::fs;
use std::path::Path;
use std::process::Command as Process;

const SCENE: &str = "Integrator \"mlt\"\nWorldBegin\nLightSource \"point\"\nShape \"sphere\"\n";

/// Writes a scene of this name into a folder and makes a job of it there.
fn job(dir: &Path, engine: &str, scene: &str, more: &[&str]) -> assert_cmd::assert::Assert {
    fs::write(dir.join(scene), SCENE).expect("written");
    let mut c = Command::new(env!("CARGO_BIN_EXE_metrolux"));
    c.current_dir(dir).args(["job", engine, scene]);
    c.args(more).assert()
}

/// What was printed, with the folder's name taken out.
fn text(done: &assert_cmd::assert::Assert, dir: &Path) -> String {
    let dir = dir.canonicalize().expect("there");
    let all = String::from_utf8(done.get_output().stdout.clone()).expect("UTF-8");
    all.replace(&*dir.to_string_lossy(), "/farm")
}

const PROGRAM: [&str; 2] = ["--metrolux", "/opt/metrolux/bin/metrolux"];

/// A job of three parts with options of its own and of render, and what was printed of it.
fn three_parts(engine: &str, scene: &str, more: &[&str]) -> String {
    let dir = tempfile::tempdir().expect("a folder");
    let own = [
        "--shards=3",
        "-o=a.exr",
        "-o=a.png",
        "--cpus=4",
        "--time=90m",
    ];
    let render = ["--", "--mutations", "2000", "--exposure=1"];
    let all = [&PROGRAM[..], more, &own, &render].concat();
    text(&job(dir.path(), engine, scene, &all).code(0), dir.path())
}

#[test]
fn a_script_for_slurm() {
    insta::assert_snapshot!(three_parts("slurm", "it's $HOME.pbrt", &[]));
}

#[test]
fn a_template_for_openjd() {
    let scene = "a \"b\" {{c}}.pbrt";
    insta::assert_snapshot!(three_parts("openjd", scene, &["--name=a"]));
}

/// A Slurm of two shell scripts: `sbatch` keeps its words, `scontrol` too, and the program is one that stops when told.
#[test]
fn the_script_does_what_it_says() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = &dir.path().join("it's a $HOME; \"job\"");
    fs::create_dir(dir).expect("made");
    let tool = |name: &str, text: &str| {
        let file = dir.join(name);
        fs::write(
            &file,
            format!("#!/bin/bash\ncd {}\n{text}", "\"$(dirname \"$0\")\""),
        )
        .expect("written");
        let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
        fs::set_permissions(&file, mode).expect("runnable");
        file.to_string_lossy().into_owned()
    };
    let said = "printf '%s|' \"${0##*/}\" \"$@\" >>said; echo >>said\n";
    tool("sbatch", &format!("{said}echo '42;cluster'"));
    tool("sleep", "");
    tool("scontrol", said);
    // Ends with the code that lies in a file; where there is none, when it is asked to.
    let program = tool(
        "program",
        &format!(
            "trap 'exit 75' TERM\n{said}[ -e code ] && exit $(cat code)\nwhile :; do /bin/sleep 0.02; done"
        ),
    );
    let more = [
        "--shards=2",
        "--metrolux",
        &program,
        "--dir=out put",
        "--",
        "--seed=5",
    ];
    let done = job(dir, "slurm", "a b.pbrt", &more).code(0);
    let script = dir.join("job.sh");
    fs::write(&script, &done.get_output().stdout).expect("written");
    let checked = Process::new("bash").arg("-n").arg(&script).status();
    assert!(checked.expect("bash runs").success());

    let path = format!(
        "{}:{}",
        dir.display(),
        std::env::var("PATH").expect("a path")
    );
    let bash = || {
        let mut c = Process::new("bash");
        c.arg(&script).env("PATH", &path);
        c
    };
    let said = || {
        let all = fs::read_to_string(dir.join("said")).unwrap_or_default();
        let _ = fs::remove_file(dir.join("said"));
        all.replace(&*dir.to_string_lossy(), "DIR")
    };
    // Handed in: the array, and the merge after it.
    let out = bash().arg("--partition=low").output().expect("bash runs");
    assert!(out.status.success(), "{out:?}");
    insta::assert_snapshot!("handed_in", said());
    assert!(dir.join("out put/job.sh").exists());

    // A part, by how its render ends.
    let part = |restarts: &str| {
        let mut c = bash();
        c.arg("part")
            .env("SLURM_ARRAY_TASK_ID", "2")
            .env("SLURM_ARRAY_JOB_ID", "42");
        c.env("SLURM_CPUS_ON_NODE", "3")
            .env("SLURM_RESTART_COUNT", restarts);
        c
    };
    let requeued = "scontrol|requeue|42_2|";
    for (code, restarts, again) in [
        (0, "0", false),
        (2, "0", false),
        (3, "0", false),
        (75, "900", true),
        (137, "4", true),
        (137, "5", false),
    ] {
        fs::write(dir.join("code"), code.to_string()).expect("written");
        let ended = part(restarts).status().expect("bash runs");
        assert_eq!(ended.code(), Some(code));
        let said = said();
        assert_eq!(said.contains(requeued), again, "{code}: {said}");
        if code == 0 {
            insta::assert_snapshot!("part", said);
        }
    }
    fs::remove_file(dir.join("code")).expect("there");
    // The warning comes to the shell alone, which passes it on and asks for another run.
    let mut child = part("0").spawn().expect("bash runs");
    let started = || {
        while !dir.join("said").exists() {
            std::thread::sleep(std::time::Duration::from_millis(5))
        }
    };
    let kill = |signal: &str, to: &str| {
        let status = Process::new("kill").args([signal, "--", to]).status();
        assert!(status.expect("kill runs").success());
    };
    started();
    kill("-USR1", &child.id().to_string());
    assert_eq!(child.wait().expect("it ends").code(), Some(75));
    assert!(said().contains(requeued));
    // The end comes to all processes of the job, and what follows is Slurm's affair.
    let group = std::os::unix::process::CommandExt::process_group;
    let mut c = part("0");
    group(&mut c, 0);
    let mut child = c.spawn().expect("bash runs");
    started();
    kill("-TERM", &format!("-{}", child.id()));
    assert_eq!(child.wait().expect("it ends").code(), Some(75));
    assert!(!said().contains(requeued));
    // The merge has all parts.
    fs::write(dir.join("code"), "0").expect("written");
    let ended = bash().arg("merge").status().expect("bash runs");
    assert!(ended.success());
    insta::assert_snapshot!("merge", said());
}

#[test]
fn what_a_job_cannot_be_is_told() {
    let dir = tempfile::tempdir().expect("a folder");
    let refused = |more: &[&str], says: &str| {
        let done = job(dir.path(), "openjd", "a.pbrt", more).code(2);
        let out = done.get_output();
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(
            said.contains(says) && out.stdout.is_empty(),
            "{says}: {said}"
        );
    };
    refused(&["--", "--threads=3"], "--cpus");
    refused(&["--", "-o", "b.exr"], "-o");
    refused(&["--", "--stats=a.json"], "stats.json");
    refused(&["--", "--time-limit=3s"], "cannot be used with");
    refused(&["--", "--target-error=0.1"], "cannot be used with");
    refused(&["--", "--checkpoint=a"], "--checkpoint");
    refused(&["--", "--spp=3"], "--spp is for");
    refused(&["--", "--progress=plain"], "--progress");
    refused(&["-o", "sub/a.exr"], "without a path");
    refused(&["-o", "a.jpg"], ".exr or .png");
    refused(&["--shards=0"], "from 1 to");
    refused(&["--name", "a\nb"], "control characters");
    refused(&["--name", "{{a}}"], "expression");
    refused(&["-o=a.png", "--", "--spectral=8"], "EXR");
}
