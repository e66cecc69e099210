//! The reader of pbrt-v4 scenes, from the outside.

mod camera;
mod damage;
mod errors;
mod lights;
mod materials;
mod objects;
mod peak;
mod ply;
mod public_scenes;
mod shapes;

use metrolux::scene::Scene;
use metrolux::scene::load::{LoadOptions, SceneError, load_str};
use std::path::Path;

/// Reads a scene from its text, strictly.
fn load(text: &str) -> Result<Scene, SceneError> {
    load_str(text, Path::new(""), &LoadOptions::default())
}

/// A scene whose world block is `body`.
fn world(body: &str) -> Scene {
    load(&format!("WorldBegin\n{body}")).unwrap_or_else(|e| panic!("{e}"))
}

/// A triangle in the plane z = 0 whose cross product points to +z.
const TRIANGLE: &str = r#"Shape "trianglemesh" "point3 P" [0 0 0  1 0 0  0 1 0]"#;
