//! `--record-rays`: a render's rays, all of them, in a file that stands for itself; `bench-accel`, which times such rays.

use assert_cmd::Command;
use metrolux::accel::record::{self, Kind};
use metrolux::accel::{Accel, Embree, EmbreeOptions};
use metrolux::scene::load::{LoadOptions, load_scene};
use std::path::Path;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/cornell.pbrt");

fn render(folder: &Path, more: &[&str]) -> std::process::Output {
    let mut command = Command::cargo_bin("metrolux").expect("built with the tests");
    command
        .args(["render", SCENE, "--quiet", "--resolution", "16x16"])
        .args(["--threads", "2", "-o", "image.exr", "--stats", "stats.json"])
        .args(["--record-rays", "rays.bin"])
        .args(more)
        .current_dir(folder);
    command.output().expect("the program starts")
}

/// Closest and visibility rays that the render counted and that it recorded.
fn counts(more: &[&str]) -> [[u64; 2]; 2] {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let out = render(folder.path(), more);
    assert!(out.status.success(), "{out:?}");
    let stats = std::fs::read(folder.path().join("stats.json")).expect("stats were asked for");
    let stats: serde_json::Value = serde_json::from_slice(&stats).expect("JSON");
    let counted = ["rays_closest", "rays_visibility"].map(|k| stats[k].as_u64().expect(k));
    let file = std::fs::File::open(folder.path().join("rays.bin")).expect("rays were asked for");
    let (geometry, rays) = record::read(std::io::BufReader::new(file)).expect("own format");
    let kinds: Vec<u8> = rays.iter().map(|(_, k)| *k as u8).collect();
    let number = |kind| rays.iter().filter(|(_, k)| *k == kind).count() as u64;
    let recorded = [Kind::Closest, Kind::Any].map(number);

    // The file's geometry answers them: in a closed box with a camera outside, most rays hit something.
    let embree = Embree::new(&geometry, EmbreeOptions::default()).expect("builds");
    let only: Vec<_> = rays.iter().map(|(r, _)| *r).collect();
    let hits = only
        .iter()
        .zip(&kinds)
        .filter(|(r, k)| **k == 0 && embree.nearest(r).is_some())
        .count() as u64;
    assert!(
        2 * hits > recorded[0],
        "{hits} hits of {} rays",
        recorded[0]
    );
    [counted, recorded]
}

#[test]
fn every_ray_of_a_path_traced_image_is_recorded() {
    let [counted, recorded] = counts(&["--integrator", "pt", "--spp", "8"]);
    assert_eq!(counted, recorded);
    assert!(counted.iter().all(|n| *n > 1000), "{counted:?}");
}

#[test]
fn every_ray_of_a_metropolis_image_is_recorded() {
    let [counted, recorded] = counts(&["--integrator", "mlt", "--rounds", "2"]);
    // Seeding, the replay of its 256 seeds, chains, direct pass: nothing is left out.
    assert_eq!(counted, recorded);
    assert!(counted.iter().all(|n| *n > 10_000), "{counted:?}");
}

#[test]
fn only_embrees_rays_are_recorded_and_the_help_does_not_offer_it() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let out = render(folder.path(), &["--accel", "obvhs"]);
    assert_eq!(out.status.code(), Some(2), "{out:?}");
    assert!(!folder.path().join("rays.bin").exists());
    let help = Command::cargo_bin("metrolux")
        .expect("built with the tests")
        .args(["render", "--help"])
        .output()
        .expect("the program starts");
    let text = String::from_utf8_lossy(&help.stdout);
    assert!(
        text.contains("--stats") && !text.contains("record"),
        "{text}"
    );
}

/// Runs bench-accel and parses what it prints.
fn bench(folder: &Path, more: &[&str]) -> serde_json::Value {
    let out = Command::cargo_bin("metrolux")
        .expect("built with the tests")
        .args(["bench-accel", "--quiet", "--json", "--turns", "2"])
        .args(["--least", "0.1", "--count", "4096", "--threads", "1,2"])
        .args([
            "--contenders",
            "embree-high,embree-low-compact,obvhs-cwbvh-fast-splits,obvhs-bvh2-medium",
        ])
        .args(more)
        .current_dir(folder)
        .output()
        .expect("the program starts");
    assert!(out.status.success(), "{out:?}");
    serde_json::from_slice(&out.stdout).expect("JSON")
}

#[test]
fn bench_accel_times_every_contender_on_the_same_rays() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let more = ["-o", "page", "--save-rays", "rays", SCENE];
    let report = bench(folder.path(), &more);
    let speeds = report["speeds"].as_array().expect("rows");
    let sets = [
        "primary-closest",
        "bounce-closest",
        "shadow-any",
        "mlt-closest",
        "mlt-any",
    ];
    assert_eq!(speeds.len(), sets.len() * 4 * 2);
    for (i, row) in speeds.iter().enumerate() {
        assert_eq!(row["set"], sets[i / 8]);
        // Every contender finds as many hits on as many threads, and some.
        assert_eq!(row["hits"], speeds[i / 8 * 8]["hits"], "{row}");
        assert!(row["hits"].as_u64().expect("a number") > 100, "{row}");
        let rate = row["rays_per_second"]["median"].as_f64().expect("a number");
        assert!(rate > 1e3 && row["ratio"]["low"].as_f64().expect("a number") > 0.0);
        let first = i % 4 == 0;
        assert_eq!(row["ratio"]["median"].as_f64() == Some(1.0), first, "{row}");
    }
    let builds = report["builds"].as_array().expect("rows");
    assert_eq!(builds.len(), 4 * 2);
    assert!(builds.iter().all(|b| b["bytes"].as_u64() > Some(1000)));
    // A build takes what stays of it, and the pages around.
    assert!(
        builds.iter().all(|b| b["peak_bytes"].as_u64() > Some(1000)),
        "{builds:?}"
    );
    let machine = &report["machine"];
    assert!(
        machine["embree"].as_str().is_some_and(|v| v.contains('.')),
        "{machine}"
    );

    let file =
        |name: &str| std::fs::read_to_string(folder.path().join("page").join(name)).expect(name);
    assert_eq!(file("bench-accel.csv").lines().count(), 1 + 40 + 8);
    assert!(file("bench-accel.html").matches("<svg").count() == sets.len() + 1);
    // What was saved is what was timed.
    let again = bench(folder.path(), &["--rays", "rays/cornell-mlt-any.rays"]);
    let hills = bench(folder.path(), &["--terrain", "1000"]);
    assert_eq!(hills["builds"][0]["primitives"], 1058);
    let row = &again["speeds"][0];
    assert_eq!(row["set"], "recorded-any");
    assert_eq!(row["hits"], speeds[4 * 8]["hits"]);
    assert_eq!(row["rays"], speeds[4 * 8]["rays"]);
}

#[test]
fn rays_of_a_scene_are_checked_and_one_can_be_asked_again() {
    let run = |args: &[&str]| {
        let mut command = Command::cargo_bin("metrolux").expect("built with the tests");
        let out = command.arg("check-rays").args(args).output();
        let out = out.expect("the program starts");
        let text = String::from_utf8_lossy(&out.stdout).into_owned();
        (
            out.status.code(),
            text,
            String::from_utf8_lossy(&out.stderr).into_owned(),
        )
    };
    let (code, text, _) = run(&[SCENE, "--count", "20000", "--json"]);
    assert_eq!(code, Some(0), "{text}");
    let found: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert!(found["rays_closest"].as_u64() > Some(40_000), "{found}");
    assert!(found["rays_visibility"].as_u64() > Some(15_000), "{found}");
    assert_eq!(found["missed"], serde_json::json!([0, 0]));
    let (code, text, _) = run(&[SCENE, "--ray", "any,0,0,-1e3,0,0,1,inf"]);
    assert_eq!(code, Some(0));
    assert!(text.starts_with("1 rays asked of Embree"), "{text}");
    let (code, text, _) = run(&["--terrain", "2000", "--count", "5000"]);
    assert!(code == Some(0) && text.starts_with("10000 rays"), "{text}");
    for bad in [
        "any,0,0,0,0,0,0,inf",
        "any,1,2,3",
        "all,0,0,0,0,0,1,1",
        "closest,a,0,0,0,0,1,1",
    ] {
        let (code, _, text) = run(&[SCENE, "--ray", bad]);
        assert_eq!(code, Some(2));
        assert!(text.contains("expected closest|any"), "{text}");
    }
}

#[test]
fn a_checked_render_is_the_same_picture_and_counts_its_rays() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let stats = |accel: &str| -> (Vec<u8>, serde_json::Value) {
        let out = Command::cargo_bin("metrolux")
            .expect("built with the tests")
            .args([
                "render",
                SCENE,
                "--quiet",
                "--resolution",
                "16x16",
                "--rounds",
                "1",
            ])
            .args(["--accel", accel, "-o", "i.png", "--stats", "s.json"])
            .current_dir(folder.path())
            .output()
            .expect("the program starts");
        assert!(out.status.success(), "{out:?}");
        let read = |name| std::fs::read(folder.path().join(name)).expect("written");
        (
            read("i.png"),
            serde_json::from_slice(&read("s.json")).expect("JSON"),
        )
    };
    let (plain, _) = stats("embree");
    let (checked, s) = stats("checked");
    assert_eq!(plain, checked);
    assert_eq!(s["checked"]["rays_closest"], s["rays_closest"]);
    assert_eq!(s["checked"]["rays_visibility"], s["rays_visibility"]);
    let zero = serde_json::json!([0, 0]);
    assert_eq!(
        (&s["checked"]["missed"], &s["checked"]["false_hits"]),
        (&zero, &zero)
    );
}

/// Six places of an object of triangles, a ball and a disk, and a floor.
const CROWD: &str = r#"
Film "rgb" "integer xresolution" 16 "integer yresolution" 16
Integrator "path" "integer maxdepth" 3
LookAt 0.4 -3.6 1.5  0 0 0.6  0 0 1
Camera "perspective" "float fov" 38
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
LightSource "point" "rgb I" [ 3 3 3 ] "point3 from" [ 0 -1 3 ]
Material "diffuse"
Shape "trianglemesh" "point3 P" [ -2 -2 0  2 -2 0  2 2 0  -2 2 0 ] "integer indices" [ 0 1 2 0 2 3 ]
ObjectBegin "toy"
Shape "loopsubdiv" "integer levels" 3 "point3 P" [ 0.3 0 0  -0.3 0 0  0 0.3 0  0 -0.3 0  0 0 0.3  0 0 -0.3 ]
    "integer indices" [ 0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5 ]
Shape "disk" "float radius" 0.4
Translate 0.4 0 0.1
Shape "sphere" "float radius" 0.15
ObjectEnd
Translate -1 0 0.4 ObjectInstance "toy"
Translate 1 0 0 Rotate 30 1 0 1 ObjectInstance "toy"
Translate 1 0 0 Scale 1 -1 1 ObjectInstance "toy"
Translate -2 1 0 Scale 1 1.5 0.7 ObjectInstance "toy"
Translate 1 0 0 ObjectInstance "toy"
Translate 1 0.2 0.3 Rotate 70 2 1 3 ObjectInstance "toy"
"#;

/// Rays of a scene with instances are recorded, checked and timed, with what they are asked of.
#[test]
fn rays_through_instances_are_recorded_checked_and_timed() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    std::fs::write(folder.path().join("crowd.pbrt"), CROWD).expect("written");
    let run = |args: &[&str]| {
        let mut command = Command::cargo_bin("metrolux").expect("built with the tests");
        let out = command.args(args).current_dir(folder.path()).output();
        let out = out.expect("the program starts");
        assert!(out.status.success(), "{args:?}: {out:?}");
        String::from_utf8_lossy(&out.stdout).into_owned()
    };
    let render = [
        "render",
        "crowd.pbrt",
        "-q",
        "--force",
        "instances",
        "--spp",
        "32",
        "-o",
        "a.exr",
    ];
    run(&[&render[..], &["--record-rays", "a.rays"]].concat());
    let file = std::fs::File::open(folder.path().join("a.rays")).expect("rays were asked for");
    let (geometry, rays) = record::read(std::io::BufReader::new(file)).expect("own format");
    let sizes = (
        geometry.objects.len(),
        geometry.instances.len(),
        geometry.prim_count(),
    );
    assert_eq!(sizes, (1, 6, 2));
    assert!(rays.len() > 5_000, "{}", rays.len());
    // The file's geometry gives the answers of the scene.
    let scene = load_scene(&folder.path().join("crowd.pbrt"), &LoadOptions::default());
    let scene = scene.unwrap_or_else(|e| panic!("{e}"));
    let build = |g| Embree::new(g, EmbreeOptions::default()).expect("builds");
    let mut through = 0;
    let (own, original) = (build(&geometry), build(&scene.geometry));
    for (ray, kind) in &rays {
        if *kind == Kind::Closest {
            let id = own.nearest(ray);
            assert_eq!(id, original.nearest(ray));
            through += id.is_some_and(|id| id.instance().is_some()) as u32;
        }
    }
    assert!(through > 500, "{through}");

    for what in ["a.rays", "crowd.pbrt"] {
        let found = run(&["check-rays", what, "--count", "20000", "--json"]);
        let found: serde_json::Value = serde_json::from_str(&found).expect("JSON");
        let zero = serde_json::json!([0, 0]);
        assert_eq!(
            (&found["missed"], &found["false_hits"]),
            (&zero, &zero),
            "{found}"
        );
    }

    let few = [
        "--flatten",
        "--contenders",
        "embree-high,obvhs-cwbvh-medium,obvhs-bvh2-fast",
    ];
    let quick = [
        "--turns",
        "2",
        "--least",
        "0.1",
        "--count",
        "4096",
        "--threads",
        "1",
        "--json",
    ];
    let save = ["bench-accel", "crowd.pbrt", "--quiet", "--save-rays", "."];
    let report: serde_json::Value =
        serde_json::from_str(&run(&[&save[..], &few, &quick].concat())).expect("JSON");
    let speeds = report["speeds"].as_array().expect("rows");
    let keys: Vec<&str> = speeds[..6]
        .iter()
        .filter_map(|r| r["contender"].as_str())
        .collect();
    let names = ["embree-high", "obvhs-cwbvh-medium", "obvhs-bvh2-fast"];
    let both = names.map(|n| [n.to_owned(), format!("{n}-flat")]);
    assert_eq!(keys, both.as_flattened());
    for rows in speeds.chunks(6) {
        // A silhouette may be met within the roundings by some and not by others.
        let hits = |r: &serde_json::Value| r["hits"].as_f64().expect("a number");
        for row in rows {
            assert!(
                (hits(row) - hits(&rows[0])).abs() <= 2.0,
                "{row} {}",
                rows[0]
            );
        }
    }
    let bytes = |i: usize| report["builds"][i]["bytes"].as_u64().expect("a number");
    assert!(bytes(0) < bytes(1) && bytes(2) < bytes(3), "{report}");
    run(&[
        "bench-accel",
        "--quiet",
        "--rays",
        "crowd-bounce-closest.rays",
        "--turns",
        "1",
        "--least",
        "0.1",
    ]);
}

#[test]
fn bench_accel_says_what_it_cannot_read() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    std::fs::write(folder.path().join("no.rays"), b"nothing of the kind").expect("written");
    for (args, expected) in [
        (&["--rays", "no.rays"][..], "not a metrolux ray file"),
        (&["--rays", "none.rays"][..], "none.rays"),
        (&["none.pbrt"][..], "none.pbrt"),
        (&["--contenders", "embree-best", SCENE][..], "embree-high"),
        (&[][..], "SCENES"),
    ] {
        let out = Command::cargo_bin("metrolux")
            .expect("built with the tests")
            .arg("bench-accel")
            .args(args)
            .current_dir(folder.path())
            .output()
            .expect("the program starts");
        let text = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{out:?}");
        assert!(text.contains(expected), "{text}");
    }
}

/// What follows the view in a scene of hills.
const UNDER_THE_SKY: &str = r#"
        Camera "perspective" "float fov" [45]
        Film "rgb" "integer xresolution" [320] "integer yresolution" [240]
        Integrator "path" "integer maxdepth" [4]
        WorldBegin
        LightSource "infinite" "rgb L" [0.4 0.45 0.6]
        LightSource "distant" "point3 from" [1 -1 1] "point3 to" [0 0 0] "rgb L" [2 2 1.8]
        Material "diffuse" "rgb reflectance" [0.5 0.4 0.3]
"#;

/// The stats of hills.pbrt in a folder, rendered with a backend.
fn render_hills(folder: &Path, accel: &str) -> serde_json::Value {
    let out = Command::cargo_bin("metrolux")
        .expect("built with the tests")
        .args(["render", "hills.pbrt", "--integrator", "mlt"])
        .args(["--mutations", "10", "--accel", accel])
        .args(["-o", "hills.png", "--stats", "stats.json"])
        .current_dir(folder)
        .output()
        .expect("the program starts");
    assert!(out.status.success(), "{out:?}");
    let stats = std::fs::read(folder.join("stats.json")).expect("written");
    serde_json::from_slice(&stats).expect("JSON")
}

/// A mesh of ten million triangles through the whole program.
#[test]
#[ignore = "minutes; make test-long"]
fn ten_million_triangles_load_build_and_render_within_8_gib() {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let g = metrolux::study::bench_accel::terrain::terrain(10_000_000);
    let (vertices, faces) = (g.positions.len() - 1, g.triangles.len());
    let mut ply = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    for p in &g.positions[..vertices] {
        ply.extend(p.to_array().iter().flat_map(|v| v.to_le_bytes()));
    }
    for t in &g.triangles {
        ply.push(3);
        ply.extend(t.iter().flat_map(|v| v.to_le_bytes()));
    }
    drop(g);
    std::fs::write(folder.path().join("hills.ply"), &ply).expect("written");
    drop(ply);
    let look = "LookAt 0.5 -0.6 1.3  0.5 0.5 0.5  0 0 1";
    let scene = format!("{look}{UNDER_THE_SKY}Shape \"plymesh\" \"string filename\" \"hills.ply\"");
    std::fs::write(folder.path().join("hills.pbrt"), scene).expect("written");
    for accel in ["embree", "obvhs"] {
        let stats = render_hills(folder.path(), accel);
        let number = |key: &str| stats[key].as_f64().expect(key);
        println!(
            "{accel}: {} triangles, load {:.1} s, build {:.1} s, render {:.1} s, peak {:.2} GiB",
            stats["triangles"],
            number("load_seconds"),
            number("build_seconds"),
            number("wall_seconds"),
            number("peak_memory_bytes") / 2f64.powi(30)
        );
        assert!(number("triangles") >= 1e7);
        assert!(
            number("peak_memory_bytes") <= 8.0 * 2f64.powi(30),
            "{stats:#}"
        );
    }
}

/// A million places of an object of a thousand triangles: a thousand million triangles through the whole program, in a
/// gibibyte, a thousand bytes a place. Copies would take sixty times that.
#[test]
#[ignore = "minutes; make test-long"]
fn a_million_instances_load_build_and_render() {
    use std::fmt::Write;
    let folder = tempfile::tempdir().expect("a folder");
    let g = metrolux::study::bench_accel::terrain::terrain(1000);
    let look = "LookAt 500 -300 400  500 500 0  0 0 1";
    let object = r#"ObjectBegin "hill" Shape "trianglemesh" "point3 P" ["#;
    let mut scene = format!("{look}{UNDER_THE_SKY}{object}");
    for p in &g.positions[..g.positions.len() - 1] {
        let _ = write!(scene, "{} {} {} ", p.x, p.y, p.z);
    }
    scene += "] \"integer indices\" [";
    for [a, b, c] in &g.triangles {
        let _ = write!(scene, "{a} {b} {c} ");
    }
    scene += "]\nObjectEnd\n";
    for i in 0..1_000_000 {
        let (x, y) = (i % 1000, i / 1000);
        // Turned by quarters and raised a little, each.
        let turn = 90 * (i * 7 % 4);
        let _ = writeln!(
            scene,
            "AttributeBegin Translate {x} {y} {} Rotate {turn} 0 0 1 ObjectInstance \"hill\" AttributeEnd",
            (i * 31 % 17) as f64 / 10.0
        );
    }
    std::fs::write(folder.path().join("hills.pbrt"), scene).expect("written");
    for accel in ["embree", "obvhs"] {
        let stats = render_hills(folder.path(), accel);
        let number = |v: &serde_json::Value| v.as_f64().expect("a number");
        let instancing = &stats["instancing"];
        println!(
            "{accel}: {} instances, {} primitives flattened, load {:.1} s, build {:.1} s, render {:.1} s, acceleration {:.0} \
             MB, peak {:.2} GiB",
            instancing["instances"],
            instancing["primitives_flattened"],
            number(&stats["load_seconds"]),
            number(&stats["build_seconds"]),
            number(&stats["wall_seconds"]),
            number(&stats["accel_bytes"]) * 1e-6,
            number(&stats["peak_memory_bytes"]) / 2f64.powi(30)
        );
        assert!(number(&instancing["primitives_flattened"]) >= 1e9);
        assert!(
            number(&stats["peak_memory_bytes"]) <= 2f64.powi(30),
            "{stats:#}"
        );
    }
}
