//! The plan: it turns on what a scene calls for, says why, and does not change the image.

mod decide;
mod effects;
mod images;
mod kinds;
mod lights;
mod objects;
mod reach;
mod scenes;
mod unseen;

use metrolux::scene::Scene;
use metrolux::scene::load::{LoadOptions, load_str};
use std::path::Path;

/// A scene of this text.
fn scene(text: &str) -> Scene {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    load_str(text, here, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}\n{text}"))
}
