//! Batches: what they render, skip, go on with and never lose.

use super::kill::{bits, cut_files, folder, metrolux, signal};
use super::voice::{find, lines, names};
use assert_cmd::Command;
use metrolux::sampling::Rng;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Process, Stdio};
use std::time::{Duration, Instant};

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}/{name}.pbrt"))
}

/// A list with five jobs of a moment, on copies of two scenes.
pub fn list(dir: &Path, rounds: u32) -> PathBuf {
    for name in ["cornell", "cornell-glass"] {
        fs::create_dir_all(dir.join("scenes")).expect("a folder");
        fs::copy(scene(name), dir.join(format!("scenes/{name}.pbrt"))).expect("copied");
    }
    let file = dir.join("five.toml");
    let text = format!(
        r#"
        [defaults]
        resolution = "16x12"
        max-depth = 4
        rounds = {rounds}
        output = ["out/${{name}}.exr", "out/${{name}}.png"]

        [[job]]
        scene = "scenes/cornell*.pbrt"

        [[job]]
        name = "turn.${{frame:4}}"
        scene = "scenes/cornell.pbrt"
        for.frame = "1-9:4"
        vary.angle = {{ 1 = 0, 9 = 10 }}
        set.view = "Scale -1 1 1 LookAt 278 273 -800 278 273 0 0 1 0 Rotate ${{angle}} 0 1 0"
        integrator = "pt"
        "#
    );
    fs::write(&file, text).expect("written");
    file
}

pub const NAMES: [&str; 5] = [
    "cornell",
    "cornell-glass",
    "turn.0001",
    "turn.0005",
    "turn.0009",
];

pub fn batch(list: &Path, more: &[&str]) -> Command {
    let mut c = metrolux();
    c.arg("batch").arg(list).args(more);
    c
}

fn out(done: &assert_cmd::assert::Assert) -> String {
    String::from_utf8_lossy(&done.get_output().stdout).into_owned()
}

fn err(done: &assert_cmd::assert::Assert) -> String {
    String::from_utf8_lossy(&done.get_output().stderr).into_owned()
}

/// What the log says of how each job came out, one after the other.
fn ends(log: &Path) -> Vec<(String, String)> {
    let text = fs::read(log).expect("a log");
    let word = |v: &Value| v.as_str().unwrap_or("failed").to_owned();
    let jobs = lines(&text).into_iter().filter(|e| e["event"] == "job");
    jobs.map(|e| (word(&e["job"]), word(&e["how"]))).collect()
}

/// The images of the five jobs by five commands.
pub fn by_hand(dir: &Path, rounds: u32) -> Vec<Vec<u32>> {
    let each = NAMES.iter().enumerate().map(|(i, name)| {
        let file = dir.join("by_hand.exr");
        let mut c = metrolux();
        let scene = if i < 2 { name } else { &"cornell" };
        c.arg("render")
            .arg(dir.join(format!("scenes/{scene}.pbrt")));
        c.args(["--resolution", "16x12", "--max-depth", "4", "--quiet"]);
        c.args(["--rounds", &rounds.to_string(), "--threads", "1", "-o"])
            .arg(&file);
        if i >= 2 {
            let angle = [0, 5, 10][i - 2];
            let view =
                format!("Scale -1 1 1 LookAt 278 273 -800 278 273 0 0 1 0 Rotate {angle} 0 1 0");
            c.args(["--integrator", "pt", "--set", &format!("view={view}")]);
        }
        c.assert().code(0);
        bits(&file)
    });
    each.collect()
}

pub fn images(dir: &Path) -> Vec<Vec<u32>> {
    let each = NAMES.iter();
    each.map(|n| bits(&dir.join(format!("out/{n}.exr"))))
        .collect()
}

#[test]
fn a_batch_makes_what_single_renders_make_and_only_once() {
    let dir = folder();
    let dir = dir.path();
    let list = list(dir, 8);
    let plan = batch(&list, &["--dry-run"]).assert().code(0);
    assert!(
        out(&plan).contains("5 of 5 jobs to do, about "),
        "{}",
        out(&plan)
    );
    assert!(!dir.join("five.batch").exists() && !dir.join("out").exists());
    let done = batch(&list, &["--jobs", "2"]).assert().code(0);
    assert!(out(&done).contains("5 jobs: 5 rendered"), "{}", out(&done));
    assert!(
        err(&done).ends_with("five.batch/index.html\n"),
        "{}",
        err(&done)
    );
    assert!(images(dir) == by_hand(dir, 8));
    // From another folder, by another name of the file, nothing is done again.
    let log = dir.join("five.batch/log.jsonl");
    let kept: Vec<_> = NAMES
        .map(|n| {
            fs::metadata(dir.join(format!("out/{n}.exr")))
                .and_then(|m| m.modified())
                .ok()
        })
        .into();
    let mut c = metrolux();
    c.current_dir(dir.join("out"))
        .args(["batch", "../five.toml"]);
    let done = c.assert().code(0);
    assert!(out(&done).contains("5 jobs: 5 unchanged"), "{}", out(&done));
    let now: Vec<_> = NAMES
        .map(|n| {
            fs::metadata(dir.join(format!("out/{n}.exr")))
                .and_then(|m| m.modified())
                .ok()
        })
        .into();
    assert_eq!(kept, now);
    // A comment in a scene is no change of it; a missing image, a cut one and another option are.
    let glass = dir.join("scenes/cornell-glass.pbrt");
    let text = fs::read_to_string(&glass).expect("a scene");
    fs::write(&glass, format!("# Looked at.\n{text}")).expect("written");
    fs::remove_file(dir.join("out/turn.0001.png")).expect("there");
    let image = dir.join("out/turn.0009.exr");
    let bytes = fs::read(&image).expect("there");
    fs::write(&image, &bytes[..bytes.len() / 2]).expect("written");
    let plan = batch(&list, &["--dry-run"]).assert().code(0);
    assert!(out(&plan).contains("2 of 5 jobs to do"), "{}", out(&plan));
    let before = ends(&log).len();
    batch(&list, &["--quiet"])
        .assert()
        .code(0)
        .stdout("")
        .stderr("");
    let again: Vec<_> = ends(&log).split_off(before);
    let rendered = |all: &[(String, String)]| -> Vec<String> {
        let found = all.iter().filter(|e| e.1 == "rendered");
        found.map(|e| e.0.clone()).collect()
    };
    assert_eq!(rendered(&again), ["turn.0001", "turn.0009"], "{again:?}");
    assert!(images(dir) == by_hand(dir, 8));
    let text = fs::read_to_string(&list).expect("there");
    let text = text.replace("integrator = \"pt\"", "integrator = \"pt\"\nseed = 7");
    fs::write(&list, text).expect("written");
    let before = ends(&log).len();
    batch(&list, &[]).assert().code(0);
    let again = ends(&log).split_off(before);
    assert_eq!(rendered(&again), NAMES[2..], "{again:?}");
    // The page has all of them, and needs nothing else.
    let page = fs::read_to_string(dir.join("five.batch/index.html")).expect("a page");
    assert_eq!(page.matches("src=\"data:image/jpeg;base64,").count(), 5);
    assert!(
        NAMES
            .iter()
            .all(|n| page.contains(&format!("<h2>{n}</h2>")))
    );
    assert!(!page.contains("http") && !page.contains("<script"));
}

#[test]
fn a_failed_job_stops_the_batch_unless_it_is_to_go_on() {
    let dir = folder();
    let dir = dir.path();
    let list = list(dir, 4);
    batch(&list, &[]).assert().code(0);
    let old = images(dir);
    let glass = dir.join("scenes/cornell-glass.pbrt");
    let good = fs::read_to_string(&glass).expect("a scene");
    fs::write(&glass, good.replace("\"dielectric\"", "\"fog\"")).expect("written");
    let text = fs::read_to_string(&list).expect("there");
    fs::write(
        &list,
        text.replace("integrator = \"pt\"", "integrator = \"pt\"\nseed = 7"),
    )
    .expect("written");
    let done = batch(&list, &["--retry", "3"]).assert().code(2);
    let said = err(&done);
    assert!(
        said.contains("error: cornell-glass: ") && said.contains("cornell-glass.pbrt:"),
        "{said}"
    );
    // What is wrong with a scene does not pass, so it was not tried again.
    assert!(!said.contains("trying again"), "{said}");
    let table = out(&done);
    assert!(
        table.contains("5 jobs: 1 unchanged, 1 failed, 3 not begun"),
        "{table}"
    );
    let done = batch(&list, &["--keep-going"]).assert().code(2);
    let table = out(&done);
    assert!(
        table.contains("5 jobs: 3 rendered, 1 unchanged, 1 failed"),
        "{table}"
    );
    // The image of the scene that cannot be read any more is still there.
    assert!(bits(&dir.join("out/cornell-glass.exr")) == old[1]);
    let page = fs::read_to_string(dir.join("five.batch/index.html")).expect("a page");
    assert!(page.contains("4 of 5 images, 1 failed") && page.contains("an earlier one"));
    // An output that cannot be written may pass.
    fs::write(&glass, good).expect("written");
    fs::remove_dir_all(dir.join("out")).expect("there");
    fs::write(dir.join("out"), "").expect("written");
    let done = batch(&list, &["--retry", "1", "--keep-going"])
        .assert()
        .code(4);
    assert_eq!(
        err(&done).matches("trying again, 1 of 1").count(),
        5,
        "{}",
        err(&done)
    );
}

#[test]
fn mistakes_in_the_list_are_told_before_any_work() {
    let dir = folder();
    let list = list(dir.path(), 4);
    let text = fs::read_to_string(&list).expect("there");
    fs::write(&list, text.replace("max-depth = 4", "max-depth = \"deep\"")).expect("written");
    let done = batch(&list, &[]).assert().code(2);
    assert!(
        err(&done).contains("five.toml:4:21: invalid value 'deep' for '--max-depth <D>'"),
        "{}",
        err(&done)
    );
    fs::remove_file(&list).expect("there");
    batch(&list, &[]).assert().code(2);
    assert!(!dir.path().join("five.batch").exists());
}

pub fn start(list: &Path, more: &[&str]) -> Child {
    let mut c = Process::new(env!("CARGO_BIN_EXE_metrolux"));
    c.arg("batch").arg(list).args(more);
    c.stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts")
}

/// A list with one job of minutes, whose stretches between two looks at signals get long.
fn long(dir: &Path) -> PathBuf {
    let list = dir.join("long.toml");
    let scene = scene("cornell").display().to_string();
    let text = format!("[[job]]\nscene = \"{scene}\"\noutput = \"a.exr\"\nmutations = 1e6\n");
    fs::write(&list, text).expect("written");
    list
}

/// Until the log has so many events of a kind.
pub fn wait_for(list: &Path, event: &str, count: usize) {
    let log = list.with_extension("batch").join("log.jsonl");
    let start = Instant::now();
    loop {
        let text = fs::read_to_string(&log).unwrap_or_default();
        if text.matches(&format!("\"event\":\"{event}\",")).count() >= count {
            return;
        }
        assert!(
            start.elapsed() < Duration::from_secs(120),
            "no {event}: {text}"
        );
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_signal_cuts_a_batch_and_a_second_one_ends_it_at_once() {
    let dir = folder();
    let dir = dir.path();
    let list = list(dir, 160);
    let child = start(&list, &[]);
    wait_for(&list, "progress", 1);
    signal(&child, "-TERM");
    let ended = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(75), "{said}");
    assert!(
        said.contains("stopped by a signal: the same command goes on"),
        "{said}"
    );
    let table = String::from_utf8_lossy(&ended.stdout);
    assert!(table.contains("1 cut"), "{table}");
    let done = batch(&list, &[]).assert().code(0);
    assert!(out(&done).contains(" 1 resumed"), "{}", out(&done));
    assert!(images(dir) == by_hand(dir, 160));
    let left = fs::read_dir(dir.join("five.batch/jobs"))
        .expect("a folder")
        .flatten();
    let left: Vec<_> = left
        .map(|f| f.file_name())
        .filter(|n| !n.to_string_lossy().ends_with(".json"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
    // After some seconds a look at signals comes every five seconds only; the second one does not wait for it.
    let list = long(dir);
    let child = start(&list, &[]);
    wait_for(&list, "progress", 3);
    signal(&child, "-TERM");
    std::thread::sleep(Duration::from_millis(100));
    signal(&child, "-TERM");
    let sent = Instant::now();
    let ended = child.wait_with_output().expect("it ends");
    assert_eq!(ended.status.code(), Some(143));
    assert!(
        sent.elapsed() < Duration::from_secs(2),
        "{:?}",
        sent.elapsed()
    );
}

/// Kills a batch `kills` times at random moments. Each image that is there is whole, and what the log says is done is not
/// done again; at the end all images are those of single renders.
fn killed(kills: u32) {
    let dir = folder();
    let dir = dir.path();
    let rounds = 60;
    let file = list(dir, rounds);
    let whole = by_hand(dir, rounds);
    let log = dir.join("five.batch/log.jsonl");
    let mut rng = Rng::new(8, 8, 8, 8);
    let (mut done, mut ends_seen, mut whole_batches) = (0, 0, 0);
    let (mut between, mut left) = (0, 0);
    let mut finished: Vec<String> = Vec::new();
    while done < kills {
        let begun = Instant::now();
        let mut child = start(
            &file,
            &[
                "--every",
                "1ms",
                "--jobs",
                if done % 2 == 0 { "1" } else { "2" },
            ],
        );
        let mut running = true;
        let until = Duration::from_secs_f64(rng.next_f64());
        while running && begun.elapsed() < until {
            std::thread::sleep(Duration::from_millis(1));
            running = child.try_wait().expect("it runs or has ended").is_none();
        }
        if running {
            child.kill().expect("it can be killed");
            done += 1;
        }
        let ended = child.wait_with_output().expect("it ends");
        let said = String::from_utf8_lossy(&ended.stderr).into_owned();
        assert!(
            matches!(ended.status.code(), None | Some(0)),
            "{:?}: {said}",
            ended.status
        );
        let now = ["five.batch", "five.batch/jobs", "out"].map(|d| cut_files(&dir.join(d)));
        let now = now.iter().sum::<usize>();
        between += u32::from(now > left);
        left = now;
        // A line that the kill cut off is the last of its run.
        let text = fs::read_to_string(&log).unwrap_or_default();
        let events: Vec<Value> = text
            .lines()
            .filter_map(|l| serde_json::from_str(l).ok())
            .collect();
        let new = &events[ends_seen..];
        ends_seen = events.len();
        for e in new.iter().filter(|e| e["event"] == "start") {
            let name = e["job"].as_str().expect("a name");
            assert!(
                !finished.iter().any(|f| f == name),
                "{name} was rendered again"
            );
        }
        let ended_now = new.iter().filter(|e| e["event"] == "job");
        finished.extend(ended_now.map(|e| e["job"].as_str().expect("a name").to_owned()));
        for (name, whole) in NAMES.iter().zip(&whole) {
            let image = dir.join(format!("out/{name}.exr"));
            assert!(
                !image.exists() || bits(&image) == *whole,
                "{name} after {done} kills"
            );
        }
        if ended.status.code() == Some(0) {
            assert!(images(dir) == whole, "after {done} kills");
            // Again from the start.
            fs::remove_dir_all(dir.join("five.batch")).expect("there");
            fs::remove_dir_all(dir.join("out")).expect("there");
            (ends_seen, finished, left) = (0, Vec::new(), 0);
            whole_batches += 1;
        }
    }
    batch(&file, &[]).assert().code(0);
    assert!(images(dir) == whole, "after {done} kills");
    assert!(
        done < 100 || between > 0,
        "no kill came between temporary file and rename"
    );
    println!(
        "{done} kills, {between} of them between temporary file and rename, {} whole batches",
        whole_batches + 1
    );
}

#[test]
fn a_few_kills_lose_nothing() {
    killed(6);
}

#[test]
#[ignore = "minutes; make test-long"]
fn two_hundred_kills_lose_nothing() {
    killed(200);
}

#[test]
fn one_batch_at_a_time_belongs_to_a_folder() {
    let dir = folder();
    let list = long(dir.path());
    let child = start(&list, &[]);
    wait_for(&list, "progress", 1);
    let log = || fs::read_to_string(dir.path().join("long.batch/log.jsonl")).expect("a log");
    let begun = |text: &str| text.matches("\"event\":\"batch\"").count();
    let done = batch(&list, &[]).assert().code(2);
    let said = err(&done);
    assert!(
        said.contains("long.batch: another metrolux batch is at work in this folder"),
        "{said}"
    );
    assert_eq!(begun(&log()), 1, "it wrote into the other's log");
    // To look does no harm.
    batch(&list, &["--dry-run"]).assert().code(0);
    // A batch that was killed keeps nobody out.
    signal(&child, "-KILL");
    child.wait_with_output().expect("it ends");
    let child = start(&list, &[]);
    wait_for(&list, "batch", 2);
    signal(&child, "-KILL");
    child.wait_with_output().expect("it ends");
}

#[test]
fn a_damaged_checkpoint_is_told_and_the_job_begins_anew() {
    let dir = folder();
    let dir = dir.path();
    let list = list(dir, 160);
    let child = start(&list, &["--every", "1ms"]);
    wait_for(&list, "checkpoint", 1);
    signal(&child, "-TERM");
    child.wait_with_output().expect("it ends");
    let jobs = fs::read_dir(dir.join("five.batch/jobs"))
        .expect("a folder")
        .flatten();
    let run = jobs
        .map(|f| f.path())
        .find(|f| f.extension().is_some_and(|e| e == "run"));
    let run = run.expect("a checkpoint");
    let mut bytes = fs::read(&run).expect("there");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&run, bytes).expect("written");
    let done = batch(&list, &["--log", "json"]).assert().code(0);
    let events = lines(&done.get_output().stderr);
    let message = find(&events, "message");
    let told = events
        .iter()
        .find(|e| e["level"] == "warning")
        .unwrap_or(message);
    let text = told["text"].as_str().expect("a text");
    assert!(
        text.contains("is damaged") && text.contains("begins anew"),
        "{told}"
    );
    assert!(names(&events).contains(&"batch"));
    assert!(images(dir) == by_hand(dir, 160));
}

fn resident(pid: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// `count` jobs of a few milliseconds: time around the renders, a job, and kilobytes that memory grew by from a third of
/// the jobs on.
fn many(count: usize) -> (f64, i64) {
    let dir = folder();
    let dir = dir.path();
    let list = dir.join("many.toml");
    let scene = scene("cornell").display().to_string();
    let text = format!(
        "[[job]]\nscene = \"{scene}\"\nname = \"${{seed:4}}\"\nfor.seed = \"1-{count}\"\nseed = \"${{seed}}\"\n\
         output = \"out/${{seed:4}}.exr\"\nresolution = \"32x32\"\nrounds = 1\nchains = 4\nseeds = 64\n\
         direct = \"separate\"\ntwo-stage = \"off\"\n"
    );
    fs::write(&list, text).expect("written");
    let log = dir.join("many.batch/log.jsonl");
    let begun = Instant::now();
    let mut child = start(&list, &["--quiet"]);
    let mut grown: Vec<(usize, u64)> = Vec::new();
    while child.try_wait().expect("it runs or has ended").is_none() {
        std::thread::sleep(Duration::from_millis(100));
        let ended = fs::read_to_string(&log)
            .unwrap_or_default()
            .matches("\"event\":\"job\"")
            .count();
        grown.extend(resident(child.id()).map(|kb| (ended, kb)));
    }
    let took = begun.elapsed().as_secs_f64();
    assert_eq!(
        child.wait_with_output().expect("it ended").status.code(),
        Some(0)
    );
    let events = lines(&fs::read(&log).expect("a log"));
    let jobs: Vec<&Value> = events.iter().filter(|e| e["event"] == "job").collect();
    assert_eq!(jobs.len(), count);
    let rendering: f64 = jobs.iter().filter_map(|e| e["seconds"].as_f64()).sum();
    let around = (took - rendering) / count as f64;
    let early = grown.iter().find(|g| g.0 >= count / 3).map_or(0, |g| g.1);
    // Before the page is written, which is another matter.
    let late = grown
        .iter()
        .rfind(|g| g.0 > count / 3 && g.0 < count)
        .map_or(early, |g| g.1);
    println!(
        "{count} jobs in {took:.1} s, {:.1} ms of rendering and {:.1} ms around it each; {early} kB, then {late} kB",
        1e3 * rendering / count as f64,
        1e3 * around
    );
    (around, late as i64 - early as i64)
}

#[test]
#[ignore = "minutes; make test-long"]
fn a_thousand_jobs_cost_little_and_leave_nothing_in_memory() {
    let (around, grown) = many(1000);
    assert!(around < 0.02, "{around} s around each render");
    // One kilobyte of each of the last 667 jobs would be seen.
    assert!(grown < 600, "{grown} kB");
}
