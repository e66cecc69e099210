//! EXR in: channels R, G, B of the first flat layer, any lossless or lossy compression the crate knows.

use super::{Image, ImageError, Window};
use exr::meta::MetaData;
use exr::prelude::{self as ex, ReadChannels, ReadLayers};
use std::fs::File;
use std::io::{BufReader, Seek};
use std::path::Path;

/// Most bytes the samples of all channels of a layer may take: 8 GiB, a spectral image of 2²⁵ pixels and 60 bins.
const MOST_BYTES: u64 = 1 << 33;

/// Reads linear RGB and the place of the pixels. Sizes are checked in the header before pixels are allocated.
pub(super) fn read(path: &Path) -> Result<(Image, Window), ImageError> {
    let unreadable = |source| ImageError::NotReadable {
        path: path.into(),
        source,
    };
    let bad = |e: ex::Error| match e {
        ex::Error::Io(source) => unreadable(source),
        other => ImageError::Bad {
            path: path.into(),
            reason: format!("not a readable EXR file: {other}"),
        },
    };
    let mut file = BufReader::new(File::open(path).map_err(unreadable)?);
    let meta = MetaData::read_from_buffered(&mut file, false).map_err(bad)?;
    let header = meta.headers.first().ok_or_else(|| ImageError::Bad {
        path: path.into(),
        reason: "the EXR file has no layer".into(),
    })?;
    for h in &meta.headers {
        let (w, ht) = (h.layer_size.x() as u64, h.layer_size.y() as u64);
        ImageError::check_size(path, w, ht)?;
        if (w * ht).saturating_mul(h.channels.bytes_per_pixel as u64) > MOST_BYTES {
            return Err(ImageError::Bad {
                path: path.into(),
                reason: format!("more than {MOST_BYTES} bytes of samples"),
            });
        }
    }
    let display = header.shared_attributes.display_window;
    file.rewind().map_err(unreadable)?;
    let image = ex::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| Pixels {
                width: size.x(),
                rgb: vec![[0.0f32; 3]; size.area()],
            },
            |p: &mut Pixels, at, (r, g, b): (f32, f32, f32)| {
                p.rgb[at.y() * p.width + at.x()] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(file)
        .map_err(bad)?;
    let layer = image.layer_data;
    let at = layer.attributes.layer_position - display.position;
    Ok((
        Image {
            width: layer.size.x(),
            height: layer.size.y(),
            rgb: layer.channel_data.pixels.rgb,
        },
        Window {
            origin: [at.x(), at.y()],
            full: [display.size.x(), display.size.y()],
        },
    ))
}

struct Pixels {
    width: usize,
    rgb: Vec<[f32; 3]>,
}
