//! Reads pbrt-v4 scene files. pbrt-v4 is the reference for what a parameter means; what cannot be rendered is an
//! error with its place, unless it cannot change the image.

mod directives;
mod error;
mod far;
mod finish;
mod hash;
mod image;
mod light;
mod lookup;
mod material;
mod mesh;
mod objects;
mod octahedral;
mod params;
mod place;
mod ply;
mod quadric;
mod render;
mod setting;
mod shape;
mod spectra;
mod state;
mod subdivision;
mod texture;
mod token;
mod transform;
mod view;
mod world;

pub use error::{Fault, Location, SceneError};
pub(in crate::scene) use quadric::quadric_mesh;
pub use setting::Setting;
pub(in crate::scene) use transform::uniform_scale;

use super::Scene;
use std::path::Path;

/// How to read a scene.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Warn about what is not supported and go on without it, instead of refusing the scene.
    pub lenient: bool,
    /// Changes to what the file says.
    pub settings: Vec<Setting>,
}

/// Reads a pbrt-v4 scene. File names in it are relative to the folder of `path`.
pub fn load_scene(path: &Path, options: &LoadOptions) -> Result<Scene, SceneError> {
    let base = path.parent().unwrap_or(Path::new(""));
    let mut loader = state::Loader::new(base, options);
    let name = path.display().to_string();
    let whole = Location {
        file: name.as_str().into(),
        line: 0,
        column: 0,
    };
    loader.library.files.seen.borrow_mut().push(path.into());
    loader.read_file(path, &name, &whole)?;
    loader.finish(&whole)
}

/// Reads a scene from memory, for tests. Files it names are relative to `base_dir`; places are in a file `<text>`.
pub fn load_str(text: &str, base_dir: &Path, options: &LoadOptions) -> Result<Scene, SceneError> {
    let mut loader = state::Loader::new(base_dir, options);
    loader.read_text(text, "<text>")?;
    loader.finish(&Location {
        file: "<text>".into(),
        line: 0,
        column: 0,
    })
}
