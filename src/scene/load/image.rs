//! Decoding of texture and environment images to linear RGB, each file once.

use super::error::{Location, Result, SceneError};
use crate::scene::texture::{Image, Texels};
use std::collections::HashMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Most texels an image may claim: 12 bytes each, so 0.8 GB at most for one image.
const MAX_TEXELS: u64 = 1 << 26;

/// Most texels a byte of a file may claim. Deflate packs 1032 bytes into one, of eight texels each with one bit a texel: 8256;
/// the other codecs pack less.
const TEXELS_PER_BYTE: u64 = 16_384;

/// How 8- and 16-bit values become linear light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    /// The sRGB curve.
    Srgb,
    /// As they are.
    Linear,
    /// A power.
    Gamma(f32),
}

impl Encoding {
    pub(super) fn parse(text: &str) -> Option<Self> {
        match text {
            "sRGB" => Some(Self::Srgb),
            "linear" => Some(Self::Linear),
            _ => {
                let g: f32 = text.strip_prefix("gamma ")?.trim().parse().ok()?;
                (g.is_finite() && g > 0.0).then_some(Self::Gamma(g))
            }
        }
    }

    fn to_linear(self, v: f32) -> f32 {
        match self {
            Self::Linear => v,
            Self::Gamma(g) => v.powf(g),
            // IEC 61966-2-1.
            Self::Srgb if v <= 0.04045 => v / 12.92,
            Self::Srgb => ((v + 0.055) / 1.055).powf(2.4),
        }
    }
}

/// The images of a scene, each decoded once.
#[derive(Default)]
pub(super) struct Images {
    pub(super) list: Vec<Image>,
    known: HashMap<(PathBuf, String), u32>,
}

impl Images {
    /// Index of the decoded image.
    pub(super) fn load(&mut self, path: &Path, encoding: Encoding, at: &Location) -> Result<u32> {
        let key = (path.to_path_buf(), format!("{encoding:?}"));
        if let Some(&i) = self.known.get(&key) {
            return Ok(i);
        }
        let image = decode(path, encoding).map_err(|e| {
            SceneError::file(at, format!("cannot read the image {}: {e}", path.display()))
        })?;
        self.list.push(image);
        let i = (self.list.len() - 1) as u32;
        self.known.insert(key, i);
        Ok(i)
    }
}

fn decode(path: &Path, encoding: Encoding) -> std::result::Result<Image, String> {
    let exr = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let image = if exr {
        decode_exr(path)?
    } else {
        decode_other(path, encoding)?
    };
    let wrong = image.rgb().flatten().find(|v| !v.is_finite());
    match wrong {
        Some(v) => Err(format!("a texel of value {v}")),
        None => Ok(image),
    }
}

fn bound(width: u64, height: u64, bytes: u64) -> std::result::Result<(), String> {
    let texels = width.saturating_mul(height);
    if width == 0 || height == 0 || texels > MAX_TEXELS {
        return Err(format!("{width} × {height} texels"));
    }
    if texels > bytes.saturating_mul(TEXELS_PER_BYTE) {
        return Err(format!("{width} × {height} texels in {bytes} bytes"));
    }
    Ok(())
}

fn length(path: &Path) -> std::result::Result<u64, String> {
    std::fs::metadata(path)
        .map(|m| m.len())
        .map_err(|e| e.to_string())
}

fn decode_other(path: &Path, encoding: Encoding) -> std::result::Result<Image, String> {
    let open = || -> std::result::Result<_, String> {
        let reader = image::ImageReader::open(path).map_err(|e| e.to_string())?;
        // TGA has no magic number; `open` has gone by the file name, the content overrules it.
        reader.with_guessed_format().map_err(|e| e.to_string())
    };
    let (width, height) = open()?.into_dimensions().map_err(|e| e.to_string())?;
    bound(width.into(), height.into(), length(path)?)?;
    let mut reader = open()?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(32 * MAX_TEXELS);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| e.to_string())?;
    let float = matches!(
        picture,
        image::DynamicImage::ImageRgb32F(_) | image::DynamicImage::ImageRgba32F(_)
    );
    let deep = picture.color().bytes_per_pixel() > picture.color().channel_count();
    let texels = if float {
        Texels::Floats(picture.into_rgb32f().pixels().map(|p| p.0).collect())
    } else if deep {
        let full = f32::from(u16::MAX);
        let linear = |v: u16| encoding.to_linear(f32::from(v) / full);
        let rgb = picture.into_rgb16();
        Texels::Floats(rgb.pixels().map(|p| p.0.map(linear)).collect())
    } else {
        let linear = std::array::from_fn(|v| encoding.to_linear(v as f32 / 255.0));
        let with_spare = |p: &image::Rgb<u8>| [p.0[0], p.0[1], p.0[2], 0];
        Texels::Bytes {
            data: picture.into_rgb8().pixels().map(with_spare).collect(),
            linear: Box::new(linear),
        }
    };
    Ok(Image {
        width,
        height,
        texels,
    })
}

fn decode_exr(path: &Path) -> std::result::Result<Image, String> {
    use exr::prelude as e;
    let file = File::open(path).map_err(|e| e.to_string())?;
    let bytes = length(path)?;
    let meta = exr::meta::MetaData::read_from_buffered(BufReader::new(file), false)
        .map_err(|e| e.to_string())?;
    for header in &meta.headers {
        bound(
            header.layer_size.width() as u64,
            header.layer_size.height() as u64,
            bytes,
        )?;
        if let Some(c) = header.shared_attributes.chromaticities {
            // Rec. 709 primaries: what RGB means in this renderer.
            let want = [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290)];
            let got = [c.red, c.green, c.blue, c.white];
            let far = |(g, w): (e::Vec2<f32>, (f32, f32))| {
                (g.x() - w.0).abs() > 2e-3 || (g.y() - w.1).abs() > 2e-3
            };
            if got.into_iter().zip(want).any(far) {
                return Err("primaries other than those of sRGB".into());
            }
        }
    }
    let first = meta.headers.first();
    if first.is_some_and(|h| h.channels.list.len() == 1) {
        return decode_grey_exr(path);
    }
    let image = e::read_first_rgba_layer_from_file(
        path,
        |size, _| {
            (
                size.width(),
                vec![[0.0f32; 3]; size.width() * size.height()],
            )
        },
        |(width, rgb): &mut (usize, Vec<[f32; 3]>), at, (r, g, b, _): (f32, f32, f32, f32)| {
            rgb[at.y() * *width + at.x()] = [r, g, b];
        },
    )
    .map_err(|e| e.to_string())?;
    let size = image.layer_data.size;
    Ok(Image {
        width: size.width() as u32,
        height: size.height() as u32,
        texels: Texels::Floats(image.layer_data.channel_data.pixels.1),
    })
}

/// A file with one channel, whatever its name: it is grey, as in pbrt-v4.
fn decode_grey_exr(path: &Path) -> std::result::Result<Image, String> {
    use exr::prelude::{ReadChannels, ReadLayers};
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|e| e.to_string())?;
    let layer = image.layer_data;
    let grey = layer.channel_data.list.first();
    let grey = grey.ok_or("no channel")?.sample_data.values_as_f32();
    let texels: Vec<[f32; 3]> = grey.map(|v| [v; 3]).collect();
    if texels.len() != layer.size.area() {
        return Err("a channel that has not a value for each texel".into());
    }
    Ok(Image {
        width: layer.size.width() as u32,
        height: layer.size.height() as u32,
        texels: Texels::Floats(texels),
    })
}
