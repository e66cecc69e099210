//! The pbrt reader: any text is a scene or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use metrolux::scene::load::{LoadOptions, load_str};
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    for lenient in [false, true] {
        let _ = load_str(&text, Path::new(""), &LoadOptions {
        lenient,
        ..LoadOptions::default()
    });
    }
});
