//! Every image decoder, by the bytes a file of its kind begins with; what begins like none is a TGA file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use metrolux::scene::load::{LoadOptions, load_scene};

fuzz_target!(|bytes: &[u8]| {
    let ending = match bytes {
        [0x89, ..] => "png",
        [0xff, ..] => "jpg",
        [b'B', b'M', ..] => "bmp",
        [b'#', ..] => "hdr",
        [0x76, 0x2f, ..] => "exr",
        _ => "tga",
    };
    let dir = tempfile::tempdir().expect("a folder");
    std::fs::write(dir.path().join(format!("t.{ending}")), bytes).expect("written");
    let scene = dir.path().join("a.pbrt");
    let text = format!("WorldBegin\nTexture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"t.{ending}\"");
    std::fs::write(&scene, text).expect("written");
    let _ = load_scene(&scene, &LoadOptions::default());
});
