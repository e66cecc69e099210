//! Files out (and back in for comparison): EXR with metadata and spectral bins, PNG; every write is atomic. Events for
//! programs that watch.

mod atomic;
mod error;
mod events;
mod exr_read;
mod exr_write;
mod image;
mod png;
mod run_file;
mod tev;

pub use self::atomic::{check_writable, write_atomic, write_streamed, write_unsynced};
pub use self::error::ImageError;
pub use self::events::Events;
pub use self::exr_write::{
    Channel, Layers, Metadata, SpectralBins, spectral_channel_name, write_exr,
};
pub use self::image::{Image, Window, from_srgb, to_srgb};
pub use self::png::{png_bytes, write_png};
pub use self::run_file::{RunFile, write_run};
pub use self::tev::{TEV_PORT, create_image, open_image, update_image};

use std::path::Path;

/// Most pixels an image read from a file may have: 2²⁷, a gigabyte and a half of linear RGB.
pub const MOST_PIXELS: u64 = 1 << 27;

/// Reads an image as linear sRGB: EXR (16- or 32-bit channels R, G, B) and HDR as they are, others through the sRGB curve.
pub fn read_image(path: &Path) -> Result<Image, ImageError> {
    read_windowed(path).map(|(image, _)| image)
}

/// As [`read_image`], and where the pixels lie in the full image (EXR's data and display window).
pub fn read_windowed(path: &Path) -> Result<(Image, Window), ImageError> {
    let is_exr = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    if is_exr {
        exr_read::read(path)
    } else {
        let image = png::read(path)?;
        let window = Window::whole(image.width, image.height);
        Ok((image, window))
    }
}
