//! `--record-rays`: a render's rays, all of them, in a file that stands for itself.

use assert_cmd::Command;
use metrolux::accel::record::{self, Kind};
use metrolux::accel::{Accel, Embree, EmbreeOptions};
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
