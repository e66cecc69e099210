//! PNG out with the sRGB tone curve; the low-dynamic-range formats and Radiance HDR in.

use super::{Image, ImageError, atomic::write_atomic, from_srgb, to_srgb};
use image::codecs::png::PngEncoder;
use image::{DynamicImage, ExtendedColorType, ImageEncoder, ImageReader};
use std::path::Path;

/// Writes an 8-bit sRGB PNG of the image brightened by `exposure` stops (factor 2^exposure). No tone mapping: clipped.
pub fn write_png(path: &Path, image: &Image, exposure: f32) -> Result<(), ImageError> {
    let gain = exposure.exp2();
    let bytes: Vec<u8> = image
        .rgb
        .iter()
        .flatten()
        .map(|v| (to_srgb(v * gain) * 255.0).round() as u8)
        .collect();
    write_atomic(path, &png_bytes(image.width, image.height, &bytes))
}

/// Encodes 8-bit RGB as it stands.
pub fn png_bytes(width: usize, height: usize, rgb: &[u8]) -> Vec<u8> {
    assert_eq!(rgb.len(), width * height * 3);
    let mut out = Vec::new();
    PngEncoder::new(&mut out)
        .write_image(rgb, width as u32, height as u32, ExtendedColorType::Rgb8)
        .expect("encoding into memory with a matching size");
    out
}

/// Reads any format the build has a decoder for as linear sRGB.
pub(super) fn read(path: &Path) -> Result<Image, ImageError> {
    let unreadable = |source| ImageError::NotReadable {
        path: path.into(),
        source,
    };
    let bad = |e: image::ImageError| ImageError::Bad {
        path: path.into(),
        reason: e.to_string(),
    };
    let open = || {
        ImageReader::open(path)
            .and_then(ImageReader::with_guessed_format)
            .map_err(unreadable)
    };
    let (w, h) = open()?.into_dimensions().map_err(bad)?;
    ImageError::check_size(path, w as u64, h as u64)?;
    let mut reader = open()?;
    let mut limits = image::Limits::default();
    // Sixteen bytes a pixel is the widest format of the decoders; they need as much again while they work.
    limits.max_alloc = Some((w as u64 * h as u64 * 32).max(1 << 20));
    reader.limits(limits);
    let decoded = reader.decode().map_err(bad)?;
    let rgb = match decoded {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            decoded.to_rgb32f().pixels().map(|p| p.0).collect()
        }
        DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_)
        | DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_) => decoded
            .to_rgb16()
            .pixels()
            .map(|p| p.0.map(|v| from_srgb(v as f32 / 65535.0)))
            .collect(),
        _ => {
            let table: [f32; 256] = std::array::from_fn(|i| from_srgb(i as f32 / 255.0));
            decoded
                .to_rgb8()
                .pixels()
                .map(|p| p.0.map(|v| table[v as usize]))
                .collect()
        }
    };
    Ok(Image {
        width: w as usize,
        height: h as usize,
        rgb,
    })
}

#[cfg(test)]
mod tests {
    use super::super::read_image;
    use super::*;

    #[test]
    fn png_round_trip_and_exposure() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        let image = Image {
            width: 256,
            height: 1,
            rgb: (0..256).map(|i| [from_srgb(i as f32 / 255.0); 3]).collect(),
        };
        write_png(&path, &image, 0.0).unwrap();
        let back = read_image(&path).unwrap();
        for (a, b) in image.rgb.iter().zip(&back.rgb) {
            assert_eq!(a, b);
        }
        write_png(&path, &image, -1.0).unwrap();
        let half = read_image(&path).unwrap();
        // Half a step of 255 is at most 0.5/255·d(linear)/d(sRGB), and that slope is at most 2.3.
        assert!((half.rgb[255][0] - 0.5).abs() < 0.005);
    }

    #[test]
    fn broken_files_are_errors() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        assert_eq!(read_image(&path).unwrap_err().exit_code(), 2);
        std::fs::write(&path, b"not a png").unwrap();
        assert!(matches!(read_image(&path), Err(ImageError::Bad { .. })));
        let whole = png_bytes(4, 4, &[7; 48]);
        std::fs::write(&path, &whole[..whole.len() - 20]).unwrap();
        assert!(read_image(&path).is_err());
        // A claim of 60000² pixels in the header chunk, with its CRC made right.
        let mut huge = whole;
        huge[16..20].copy_from_slice(&60_000u32.to_be_bytes());
        huge[20..24].copy_from_slice(&60_000u32.to_be_bytes());
        let crc = crc32(&huge[12..29]);
        huge[29..33].copy_from_slice(&crc.to_be_bytes());
        std::fs::write(&path, &huge).unwrap();
        assert!(matches!(
            read_image(&path),
            Err(ImageError::TooLarge { .. })
        ));
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0u32, |c, b| {
            (0..8).fold(c ^ *b as u32, |c, _| {
                (c >> 1) ^ (0xEDB8_8320 & (c & 1).wrapping_neg())
            })
        })
    }
}
