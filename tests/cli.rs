//! The command as a user meets it: exit codes, what goes to stdout and stderr, files.

use assert_cmd::Command;
use assert_cmd::assert::Assert;
use metrolux::output::{Image, read_image};
use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn stdout(a: &Assert) -> String {
    String::from_utf8(a.get_output().stdout.clone()).expect("UTF-8")
}

fn stderr(a: &Assert) -> String {
    String::from_utf8(a.get_output().stderr.clone()).expect("UTF-8")
}

fn metrolux() -> Command {
    Command::new(env!("CARGO_BIN_EXE_metrolux"))
}

/// A folder for a test's files.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).expect("written");
        path
    }
}

fn cornell() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell/cornell.pbrt")
}

/// A render of a few pixels; the caller adds what is asked about.
fn small_render(scene: &Path, output: &Path) -> Command {
    let mut c = metrolux();
    c.arg("render").arg(scene).arg("-o").arg(output);
    c.args(["--resolution", "8x6", "--max-depth", "3"]);
    c
}

#[test]
fn a_render_writes_both_files_and_nothing_to_stdout() {
    let dir = Folder::new();
    let (exr, png) = (dir.path("a.exr"), dir.path("a.png"));
    let mut c = small_render(&cornell(), &exr);
    let done = c
        .arg("-o")
        .arg(&png)
        .args(["--rounds", "1"])
        .assert()
        .code(0);
    assert_eq!(stdout(&done), "");
    for file in [&exr, &png] {
        let Image { width, height, rgb } = read_image(file).expect("an image");
        assert_eq!((width, height), (8, 6), "{}", file.display());
        assert!(rgb.iter().flatten().any(|v| *v > 0.0));
        assert!(rgb.iter().flatten().all(|v| v.is_finite()));
    }
    // Nothing but the two: temporary files are gone.
    assert_eq!(fs::read_dir(dir.0.path()).expect("a folder").count(), 2);
}

#[test]
fn a_pipe_gets_no_progress_bar_and_quiet_gets_nothing() {
    let dir = Folder::new();
    let out = dir.path("a.exr");
    let mut c = small_render(&cornell(), &out);
    let text = stderr(&c.args(["--rounds", "20"]).assert().code(0));
    for sign in ["\r", "\u{1b}", "to go"] {
        assert!(!text.contains(sign), "{text:?}");
    }
    assert!(text.contains("mutations"), "the closing line: {text:?}");
    let mut c = small_render(&cornell(), &out);
    let done = c.args(["--rounds", "1", "--quiet"]).assert().code(0);
    assert_eq!(stderr(&done), "");
}

/// A pipe that nobody reads from.
fn closed() -> std::io::PipeWriter {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer
}

/// The command with its own choice of where stdout and stderr go.
fn plain(args: &[&OsStr]) -> std::process::Command {
    let mut c = std::process::Command::new(env!("CARGO_BIN_EXE_metrolux"));
    c.args(args);
    c
}

/// `metrolux … | head -0`: what is printed has no reader any more.
#[test]
fn a_reader_that_has_seen_enough_is_no_fault() {
    let dir = Folder::new();
    let out = dir.path("a.exr");
    small_render(&cornell(), &out).assert().code(0);
    let (scene, image) = (cornell(), out.as_path());
    let commands: [&[&OsStr]; 4] = [
        &["plan".as_ref(), scene.as_ref()],
        &["compare".as_ref(), image.as_ref(), image.as_ref()],
        &["completions".as_ref(), "bash".as_ref()],
        &["man".as_ref()],
    ];
    for args in commands {
        let done = plain(args).stdout(closed()).output().expect("it ran");
        let told = String::from_utf8_lossy(&done.stderr);
        assert_eq!(
            (done.status.code(), told.as_ref()),
            (Some(0), ""),
            "{args:?}"
        );
    }
    // Messages that nobody reads cost nothing but themselves.
    let none = dir.path("none.pbrt");
    let to = dir.path("study");
    let tell: [(&[&OsStr], i32); 2] = [
        (&["plan".as_ref(), none.as_ref()], 2),
        (
            &[
                "study".as_ref(),
                scene.as_ref(),
                "-o".as_ref(),
                to.as_ref(),
                "--dry-run".as_ref(),
                "--budget=10m".as_ref(),
                "--axis=depth".as_ref(),
                "--".as_ref(),
                "--resolution=8x8".as_ref(),
                "--max-depth=3".as_ref(),
            ],
            0,
        ),
    ];
    for (args, code) in tell {
        let done = plain(args).stderr(closed()).output().expect("it ran");
        assert_eq!(done.status.code(), Some(code), "{args:?}");
    }
}

#[test]
fn a_bad_scene_is_2_and_says_where() {
    let dir = Folder::new();
    let out = dir.path("a.exr");
    let bad = "Film \"rgb\"\nWorldBegin\n  Material \"marble\"\n";
    let scene = dir.write("bad.pbrt", bad);
    let text = stderr(&small_render(&scene, &out).assert().code(2));
    assert!(text.contains("bad.pbrt:3:3"), "{text}");
    assert!(
        text.contains("marble") && text.contains("diffuse"),
        "{text}"
    );
    assert!(!out.exists(), "no partial output");
    // The same as a warning.
    let light = "LightSource \"point\"\nShape \"sphere\"\n";
    let scene = dir.write(
        "odd.pbrt",
        &format!("Film \"rgb\" \"string sensor\" \"nikon\"\nWorldBegin\n{light}"),
    );
    assert!(stderr(&small_render(&scene, &out).assert().code(2)).contains("odd.pbrt:1:"));
    let mut c = small_render(&scene, &out);
    let text = stderr(&c.args(["--lenient", "--rounds", "1"]).assert().code(0));
    assert!(
        text.contains("warning") && text.contains("odd.pbrt:1:"),
        "{text}"
    );
    small_render(&dir.path("none.pbrt"), &out).assert().code(2);
}

#[test]
fn wrong_usage_is_2() {
    let dir = Folder::new();
    let out = dir.path("a.exr");
    for extra in [
        &["--no-such-option"][..],
        &["--integrator", "radiosity"],
        &["--mutations", "-1"],
        &["--mutations", "8", "--rounds", "2"],
        &["--mutations", "8", "--integrator", "pt"],
        &["--spp", "8"],
        &["--lanes", "3"],
        &["--time-limit", "soon"],
        &["--target-error", "0"],
        &["--target-error", "5%"],
        &["--region", "0,0,9,2"],
        &["--threads", "1000000"],
        &["--mutate", "lens=1"],
        &["--mutate", "bidirectional=0,lens=1"],
        &["--mutate", "bidirectional=1,manifold=1"],
        &["--mutate", "bidirectional=1", "--integrator", "pt"],
        &["-o", "picture.jpg"],
    ] {
        let mut c = small_render(&cornell(), &out);
        let done = c.args(extra).assert().code(2);
        assert!(!stderr(&done).is_empty(), "{extra:?}");
        assert!(!out.exists(), "{extra:?}");
    }
    metrolux().assert().code(2);
    metrolux().arg("paint").assert().code(2);
}

#[test]
fn an_unwritable_output_is_4_before_any_work() {
    let dir = Folder::new();
    // A file stands where a folder would have to be; root's rights do not help.
    dir.write("taken", "");
    let below = dir.path("taken/a.exr");
    let start = std::time::Instant::now();
    let mut c = small_render(&cornell(), &below);
    let done = c.args(["--time-limit", "10m"]).assert().code(4);
    assert!(stderr(&done).contains("taken/a.exr"));
    let mut c = small_render(&cornell(), &dir.path("a.exr"));
    c.args(["--time-limit", "10m", "--stats"]).arg(&below);
    c.assert().code(4);
    assert!(start.elapsed().as_secs() < 300, "found out at the end");
}

#[test]
fn the_stats_have_what_was_promised() {
    let dir = Folder::new();
    let (out, stats) = (dir.path("a.exr"), dir.path("stats.json"));
    let read = |extra: &[&str]| -> Value {
        let mut c = small_render(&cornell(), &out);
        c.arg("--stats").arg(&stats).args(extra).assert().code(0);
        serde_json::from_slice(&fs::read(&stats).expect("stats")).expect("JSON")
    };
    let mlt = read(&["--rounds", "3", "--seed", "42"]);
    for (key, least) in [
        ("/wall_seconds", 1e-9),
        ("/cpu_seconds", 1e-9),
        ("/peak_memory_bytes", 1e6),
        ("/rays_closest", 1.0),
        ("/rays_visibility", 1.0),
        ("/mlt/mutations", 3.0 * 16.0 * 16.0 * 64.0),
        ("/mlt/rounds", 3.0),
        ("/mlt/b", 1e-9),
        ("/mlt/b_standard_error", 1e-12),
        ("/mlt/strategies/bidirectional/acceptance_rate", 1e-6),
        ("/mlt/strategies/lens/acceptance_rate", 1e-6),
        ("/mlt/strategies/wavelength/acceptance_rate", 1e-6),
        ("/seed", 42.0),
        ("/faults/nan", 0.0),
        ("/faults/negative", 0.0),
        ("/faults/infinite", 0.0),
        ("/faults/zero_density", 0.0),
    ] {
        let v = mlt.pointer(key).and_then(Value::as_f64);
        assert!(v.is_some_and(|v| v >= least), "{key}: {v:?} in {mlt:#}");
    }
    let embree = mlt["embree"].as_str().expect("a version");
    assert!(embree.contains('.'), "{embree}");
    assert_eq!(mlt["integrator"], "mlt");
    assert_eq!(mlt["mlt"]["target"], "mixed");
    assert!(mlt.get("spectral_bins").is_none());
    let luminance = read(&["--rounds", "1", "--target", "luminance"]);
    assert_eq!(luminance["mlt"]["target"], "luminance");
    let bins = read(&["--rounds", "1", "--spectral", "12"]);
    assert_eq!(bins["mlt"]["target"], "mixed");
    assert_eq!(bins["spectral_bins"], 12);

    let pt = read(&["--integrator", "pt", "--spp", "2", "--accel", "obvhs"]);
    assert_eq!(pt["samples_per_pixel"], 2);
    assert_eq!(pt["accel"], "obvhs");
    assert!(pt.get("mlt").is_none());
}

#[test]
fn shares_of_the_strategies_are_set_and_written_down() {
    let dir = Folder::new();
    let (out, stats) = (dir.path("a.exr"), dir.path("stats.json"));
    let shares = |scene: &Path, extra: &[&str]| -> [f64; 6] {
        let mut c = small_render(scene, &out);
        c.args(["--rounds", "1", "--stats"]).arg(&stats);
        c.args(extra).assert().code(0);
        let json: Value = serde_json::from_slice(&fs::read(&stats).expect("stats")).expect("JSON");
        [
            "bidirectional",
            "lens",
            "caustic",
            "multichain",
            "lenssubpath",
            "wavelength",
        ]
        .map(|name| {
            let s = &json["mlt"]["strategies"][name];
            let (share, proposed) = (s["share"].as_f64(), s["proposed"].as_u64());
            assert!(share > Some(0.0) || proposed == Some(0), "{name}: {s}");
            share.expect("a share")
        })
    };
    let given = "bidirectional=2,lens=1,caustic=1,wavelength=1";
    let found = shares(&cornell(), &["--mutate", given]);
    assert_eq!(found, [0.4, 0.2, 0.2, 0.0, 0.0, 0.2]);
    let bytes = fs::read(&out).expect("an image");
    let text = "bidirectional=0.4,lens=0.2,caustic=0.2,multichain=0,lenssubpath=0,wavelength=0.2";
    assert!(
        bytes.windows(text.len()).any(|w| w == text.as_bytes()),
        "the header holds the shares"
    );
    // No delta lobe calls for the strategies of specular chains.
    assert_eq!(shares(&cornell(), &[])[2..4], [0.0, 0.0]);
    let glass =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-glass/cornell-glass.pbrt");
    let found = shares(&glass, &[]);
    assert!(found.iter().all(|s| *s > 0.0), "{found:?}");
}

#[test]
fn rounds_make_again_what_a_time_limit_made() {
    let dir = Folder::new();
    let (a, b, stats) = (dir.path("a.exr"), dir.path("b.exr"), dir.path("s.json"));
    let mut c = small_render(&cornell(), &a);
    c.args(["--time-limit", "200ms", "--stats"]).arg(&stats);
    c.args(["--threads", "2"]).assert().code(0);
    let json: Value = serde_json::from_slice(&fs::read(&stats).expect("stats")).expect("JSON");
    let rounds = json["mlt"]["rounds"].to_string();
    let mut c = small_render(&cornell(), &b);
    c.args(["--rounds", &rounds, "--threads", "1"])
        .assert()
        .code(0);
    let (a, b) = (
        read_image(&a).expect("an image"),
        read_image(&b).expect("an image"),
    );
    assert!(a.rgb == b.rgb, "after {rounds} rounds");
}

#[test]
fn compare_judges_and_prints() {
    let dir = Folder::new();
    let (a, b) = (dir.path("a.exr"), dir.path("b.exr"));
    for (out, seed) in [(&a, "1"), (&b, "2")] {
        let mut c = small_render(&cornell(), out);
        c.args(["--rounds", "1", "--seed", seed]).assert().code(0);
    }
    let compare = |more: &[&str]| {
        let mut c = metrolux();
        c.arg("compare").arg(&a).arg(&b).args(more).assert()
    };
    let done = compare(&["--json", "--max-relmse", "1000"]).code(0);
    let json: Value = serde_json::from_str(&stdout(&done)).expect("JSON");
    for key in ["mean_ratio", "rel_mse", "rmse", "l1", "l2", "l_inf", "mape"] {
        assert!(json.get(key).is_some(), "{key} in {json:#}");
    }
    compare(&["--max-relmse", "1e-9"]).code(1);
    let diff = dir.path("d.png");
    compare(&["--diff", diff.to_str().expect("UTF-8")]).code(0);
    assert_eq!(read_image(&diff).expect("an image").width, 8);
    metrolux()
        .arg("compare")
        .arg(&a)
        .arg(dir.path("none.exr"))
        .assert()
        .code(2);
}

#[test]
fn help_names_every_option() {
    let help = stdout(&metrolux().args(["render", "--help"]).assert().code(0));
    for option in [
        "--output",
        "--integrator",
        "--accel",
        "--mutations",
        "--spp",
        "--time-limit",
        "--rounds",
        "--target-error",
        "--seed",
        "--threads",
        "--resolution",
        "--region",
        "--max-depth",
        "--lanes",
        "--direct",
        "--mutate",
        "--exposure",
        "--lenient",
        "--stats",
        "--quiet",
        "--accel-precision",
        "--set",
        "--layers",
        "--preview",
        "--log",
        "--progress",
    ] {
        assert!(
            help.contains(&format!("{option} ")) || help.contains(&format!("{option}\n")),
            "{option}"
        );
    }
    let help = stdout(&metrolux().args(["compare", "--help"]).assert().code(0));
    for option in ["--json", "--max-relmse", "--diff"] {
        assert!(help.contains(option), "{option}");
    }
    let help = stdout(&metrolux().arg("--help").assert().code(0));
    for word in ["render", "compare", "completions", "man", "Exit codes"] {
        assert!(help.contains(word), "{word}");
    }
    let version = stdout(&metrolux().arg("--version").assert().code(0));
    assert_eq!(
        version.trim(),
        format!("metrolux {}", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn completions_and_the_manual_are_made_of_the_same_options() {
    for (shell, sign) in [
        ("bash", "complete "),
        ("zsh", "#compdef metrolux"),
        ("fish", "complete -c metrolux"),
    ] {
        let text = stdout(&metrolux().args(["completions", shell]).assert().code(0));
        assert!(text.contains(sign) && text.contains("max-depth"), "{shell}");
    }
    let bash = stdout(&metrolux().args(["completions", "bash"]).assert().code(0));
    let page = stdout(&metrolux().arg("man").assert().code(0));
    assert!(page.contains(".TH metrolux"), "{page}");
    for command in ["render", "batch", "merge", "study"] {
        let here = bash.contains(&format!("metrolux,{command}"));
        assert!(here && page.contains(command), "{command}");
    }
    let page = stdout(&metrolux().args(["man", "job", "slurm"]).assert().code(0));
    assert!(page.contains(".TH metrolux-job-slurm"), "{page}");
    metrolux().args(["man", "rendre"]).assert().code(2);
    let dir = Folder::new();
    let folder = dir.path("man1");
    let mut c = metrolux();
    c.args(["man", "-o"]).arg(&folder).assert().code(0);
    for name in ["metrolux", "metrolux-render", "metrolux-job-openjd"] {
        let text = fs::read_to_string(folder.join(format!("{name}.1"))).expect("there");
        assert!(text.contains(".SH SYNOPSIS"), "{name}");
    }
    let render = fs::read_to_string(folder.join("metrolux-render.1")).expect("there");
    assert!(
        render.contains("mutations") && !render.contains("record"),
        "hidden ones stay so"
    );
}

/// No chains, no strategies.
#[test]
fn path_tracing_is_not_told_to_mutate() {
    for (integrator, chains) in [("mlt", true), ("bdpt", false), ("pt", false)] {
        let mut c = metrolux();
        c.arg("plan")
            .arg(cornell())
            .args(["--integrator", integrator]);
        let text = stdout(&c.assert().code(0));
        assert_eq!(text.contains("strategies"), chains, "{text}");
        assert!(text.contains("wavelengths    4 lanes"), "{text}");
    }
}

/// Without light there is no error relative to it: what would never end is refused, and the rest is black.
#[test]
fn a_scene_without_light_is_black_and_has_no_relative_error() {
    let dir = Folder::new();
    let dark = "LookAt 0 0 5 0 0 0 0 1 0\nCamera \"perspective\"\nWorldBegin\nShape \"sphere\"\n";
    let scene = dir.write("dark.pbrt", dark);
    let out = dir.path("a.exr");
    for integrator in ["mlt", "bdpt", "pt"] {
        let mut c = small_render(&scene, &out);
        c.args(["--integrator", integrator, "--target-error", "0.1"]);
        assert!(stderr(&c.assert().code(2)).contains("without light"));
        let mut c = small_render(&scene, &out);
        c.args(["--integrator", integrator, "--rounds", "1"]);
        c.assert().code(0);
        let image = read_image(&out).expect("an image");
        assert!(image.rgb.iter().flatten().all(|v| *v == 0.0));
    }
    let mut c = metrolux();
    c.arg("predict").arg(&scene).args(["--target-error", "0.1"]);
    assert!(stderr(&c.assert().code(2)).contains("without light"));
}

/// Two scenes in files of one name are two scenes.
#[test]
fn scenes_of_one_name_are_timed_apart() {
    let dir = Folder::new();
    let all = ["a", "b"].map(|folder| {
        fs::create_dir(dir.path(folder)).expect("a folder");
        let name = format!("{folder}/s.pbrt");
        let sphere = "LookAt 0 0 5 0 0 0 0 1 0\nCamera \"perspective\"\nWorldBegin\nLightSource \"point\" \
                      \"point3 from\" [ 0 3 3 ]\nShape \"sphere\"\n";
        dir.write(&name, sphere)
    });
    let rays = dir.path("rays");
    let mut c = metrolux();
    c.arg("bench-accel")
        .args(&all)
        .arg("--save-rays")
        .arg(&rays);
    c.args(["--count", "64", "--turns", "1", "--least", "0.01"]);
    c.args([
        "--threads",
        "1",
        "--contenders",
        "embree-high",
        "--json",
        "-q",
    ]);
    let told: Value = serde_json::from_str(&stdout(&c.assert().code(0))).expect("JSON");
    let names: Vec<&str> = told["builds"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|b| b["scene"].as_str().expect("a name"))
        .collect();
    assert_eq!(names, ["s", "s-2"]);
    let files = fs::read_dir(&rays).expect("a folder").count();
    let of = |name: &str| dir.path("rays").join(name).is_file();
    assert!(
        of("s-primary-closest.rays") && of("s-2-primary-closest.rays"),
        "{files}"
    );
}
