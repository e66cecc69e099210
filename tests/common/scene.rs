//! Scenes at test size.

use metrolux::accel::{Embree, EmbreeOptions};
use metrolux::scene::load::{LoadOptions, load_scene, load_str};
use metrolux::scene::{FilterKind, FilterSettings, Scene};
use std::path::Path;

/// A scene of `scenes/` at another resolution of the same shape, with a box filter of one pixel.
pub fn of_file(file: &str, width: u32, height: u32) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("scenes")
        .join(file);
    let mut scene = load_scene(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let c = &mut scene.camera;
    c.resolution = [width, height];
    c.crop = [0, 0, width, height];
    scene.settings.filter = unit_box();
    scene
}

/// A scene seen by `camera` (everything before `WorldBegin` but film and filter) at `size`² pixels.
pub fn of_text(size: u32, camera: &str, world: &str) -> Scene {
    let text = format!(
        "Film \"rgb\" \"integer xresolution\" {size} \"integer yresolution\" {size}\n\
         PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5\n\
         {camera}\nWorldBegin\n{world}"
    );
    load_str(&text, Path::new(""), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// The filter under which a pixel's value is the mean radiance over its area.
pub fn unit_box() -> FilterSettings {
    FilterSettings {
        kind: FilterKind::Box,
        radius: [0.5, 0.5],
    }
}

/// Embree over a scene.
pub fn embree(scene: &Scene) -> Embree<'_> {
    Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree builds")
}
