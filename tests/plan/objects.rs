//! Which objects are instanced, what that costs in memory, and what is told of it.

use super::scene;
use metrolux::plan::objects::{FLAT, instanced};
use metrolux::plan::{Effect, Options, Plan, Verdict};
use metrolux::scene::{Geometry, Instance, Scene};
use std::fmt::Write;
use std::path::Path;

/// A grid of `n` quads a side as a mesh, in `places` places.
fn crowd(n: usize, places: usize) -> String {
    let mut points = String::new();
    for i in 0..=n {
        for j in 0..=n {
            let (x, y) = (i as f64 / n as f64, j as f64 / n as f64);
            let _ = write!(
                points,
                "{x} {y} {} ",
                0.1 * (9.0 * x).sin() * (7.0 * y).cos()
            );
        }
    }
    let mut indices = String::new();
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j;
            let (b, c, d) = (a + 1, a + n + 1, a + n + 2);
            let _ = write!(indices, "{a} {c} {d} {a} {d} {b} ");
        }
    }
    let mut text = format!(
        "Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16\n\
         LookAt 5 5 30  5 5 0  0 1 0 Camera \"perspective\"\nWorldBegin\n\
         LightSource \"distant\" \"point3 from\" [ 0 0 2 ]\nMaterial \"diffuse\"\n\
         ObjectBegin \"leaf\"\nShape \"trianglemesh\" \"integer indices\" [ {indices} ] \"point3 P\" [ {points} ]\nObjectEnd\n"
    );
    for i in 0..places {
        let (x, y) = (i % 10, i / 10 % 10);
        let _ = writeln!(
            text,
            "AttributeBegin Translate {x} {y} {} Rotate {} 1 2 3 ObjectInstance \"leaf\" AttributeEnd",
            i / 100,
            7 * i
        );
    }
    text
}

fn options(effects: &str) -> Options {
    let mut options = Options::default();
    match effects {
        "force" => options.force.push(Effect::Instances),
        "without" => options.without.push(Effect::Instances),
        _ => {}
    }
    options
}

fn made(text: &str, effects: &str) -> (Scene, Plan) {
    let mut s = scene(text);
    let plan = Plan::make(&mut s, &options(effects));
    (s, plan)
}

#[test]
fn what_grows_least_is_put_into_the_world_first() {
    // Objects of 1, 2 … primitives in so many places.
    let geometry = |uses: &[usize]| {
        let mut g = Geometry::default();
        for (o, n) in uses.iter().enumerate() {
            g.objects.push(Geometry {
                triangles: vec![[0, 1, 2]; o + 1],
                ..Geometry::default()
            });
            let i = Instance::new(o as u32, &Default::default(), 1.0, 1.0);
            g.instances
                .extend(std::iter::repeat_n(i.expect("fits"), *n));
        }
        g
    };
    let chosen = |uses: &[usize], flat| instanced(&geometry(uses), flat);
    // One place takes nothing more than the object itself.
    assert_eq!(chosen(&[1, 1], 0), [false, false]);
    assert_eq!(chosen(&[2, 2], 0), [true, true]);
    // 9 and 2 more.
    assert_eq!(chosen(&[10, 2], 1), [true, true]);
    assert_eq!(chosen(&[10, 2], 2), [true, false]);
    assert_eq!(chosen(&[10, 2], 10), [true, false]);
    assert_eq!(chosen(&[10, 2], 11), [false, false]);
    assert_eq!(chosen(&[0], 0), [false]);
}

#[test]
fn few_copies_are_flattened_and_many_are_not() {
    // 2 · 8² triangles, 1000 times: far below the bound. 2 · 40², 1000 times: above.
    let (s, plan) = made(&crowd(8, 1000), "");
    assert!(!plan.on(Effect::Instances) && s.geometry.instances.is_empty());
    assert_eq!(s.geometry.triangles.len(), 128_000);
    let text = crowd(40, 1000);
    let (s, plan) = made(&text, "");
    let found = plan.finding(Effect::Instances);
    assert_eq!(found.verdict, Verdict::CalledFor);
    assert!(s.geometry.flat_count() > FLAT);
    assert_eq!(
        (s.geometry.triangles.len(), s.geometry.instances.len()),
        (0, 1000)
    );
    let line = text
        .lines()
        .position(|l| l.starts_with("ObjectBegin"))
        .expect("there")
        + 1;
    assert_eq!(
        found.causes[0].to_string(),
        format!("object \"leaf\" of 3200 primitives stands in 1000 places (<text>:{line}:1)")
    );
    // Both ways it can be had otherwise.
    let (s, plan) = made(&text, "without");
    assert_eq!(plan.finding(Effect::Instances).verdict, Verdict::LeftOut);
    assert_eq!(
        (s.geometry.triangles.len(), s.geometry.objects.len()),
        (3_200_000, 0)
    );
    let (s, plan) = made(&crowd(8, 1000), "force");
    assert_eq!(plan.finding(Effect::Instances).verdict, Verdict::Forced);
    assert_eq!(
        (s.geometry.triangles.len(), s.geometry.instances.len()),
        (0, 1000)
    );
}

fn run(folder: &Path, args: &[&str]) -> serde_json::Value {
    let mut command = assert_cmd::Command::cargo_bin("metrolux").expect("built with the tests");
    let out = command
        .args(args)
        .current_dir(folder)
        .output()
        .expect("it starts");
    assert!(out.status.success(), "{args:?}: {out:?}");
    let stats = folder.join("stats.json");
    let text = match args[0] {
        "plan" => out.stdout,
        _ => std::fs::read(stats).expect("stats were asked for"),
    };
    serde_json::from_slice(&text).expect("JSON")
}

/// A thousand places of an object take the memory of one and of a thousand transforms; the plan says so, and so it is.
#[test]
fn memory_is_that_of_one_object_and_its_places() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("crowd.pbrt");
    std::fs::write(&file, crowd(40, 1000)).expect("written");
    let plan = |more: &[&str]| {
        let args = [
            &["plan", "--json", "--integrator", "pt", "crowd.pbrt"],
            more,
        ]
        .concat();
        run(folder.path(), &args)
    };
    let bytes = |plan: &serde_json::Value, part: &str| {
        plan["memory_bytes"][part].as_u64().expect("a number") as f64
    };
    let two = plan(&[]);
    let one = plan(&["--without", "instances"]);
    assert_eq!(two["embree"]["instance_level"], true);
    assert_eq!(one["embree"]["instance_level"], false);
    // 3200 triangles at a hundred bytes and 1681 vertices at 12; a thousand places at 60 and Embree's part.
    assert!(bytes(&two, "geometry") < 500e3, "{two}");
    assert!(bytes(&two, "acceleration") < 2e6, "{two}");
    assert!(
        bytes(&one, "geometry") > 500.0 * bytes(&two, "geometry"),
        "{one}"
    );

    for accel in ["embree", "obvhs"] {
        let render = |effect: &str| {
            let args = [
                "render",
                "-q",
                "--integrator",
                "pt",
                "--spp",
                "1",
                "--accel",
                accel,
            ];
            let args = [&args[..], &["--stats", "stats.json", "-o", "a.exr"]].concat();
            run(
                folder.path(),
                &[&args[..], &[effect, "instances", "crowd.pbrt"]].concat(),
            )
        };
        let (two, one) = (render("--force"), render("--without"));
        let of = |stats: &serde_json::Value| stats["accel_bytes"].as_u64().expect("a number");
        println!(
            "{accel}: {} B instanced, {} B flattened",
            of(&two),
            of(&one)
        );
        // The plan's estimate of it holds for Embree: less than four times too high or too low.
        if accel == "embree" {
            let ratio = of(&two) as f64 / bytes(&plan(&[]), "acceleration");
            assert!((0.25..4.0).contains(&ratio), "{ratio}");
        }
        assert!(of(&two) < 2_000_000, "{accel}: {two}");
        assert!(of(&one) > 50 * of(&two), "{accel}: {one}");
        assert_eq!(two["instancing"]["instances"], 1000);
        assert_eq!(two["instancing"]["primitives_flattened"], 3_200_000);
        assert_eq!(two["triangles"], 3200);
        let peak = |stats: &serde_json::Value| stats["peak_memory_bytes"].as_u64().expect("bytes");
        println!(
            "{accel}: peak {} B instanced, {} B flattened",
            peak(&two),
            peak(&one)
        );
        assert!(2 * peak(&two) < peak(&one), "{accel}");
    }
}
