//! The PLY reader, through the scene that names the file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use metrolux::scene::load::{LoadOptions, load_scene};

fuzz_target!(|bytes: &[u8]| {
    let dir = tempfile::tempdir().expect("a folder");
    std::fs::write(dir.path().join("m.ply"), bytes).expect("written");
    let scene = dir.path().join("a.pbrt");
    std::fs::write(&scene, "WorldBegin\nShape \"plymesh\" \"string filename\" \"m.ply\"").expect("written");
    let _ = load_scene(&scene, &LoadOptions::default());
});
