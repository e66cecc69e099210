//! Pictures inside the page: small ones of whole images, exact ones of the part that differs most.

use super::super::flip::srgb_bytes;
use super::super::metrics::{blocks, false_colour, luminance, signed_difference};
use crate::output::{Image, png_bytes};
use base64::prelude::{BASE64_STANDARD, Engine};
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;

/// Widest picture of a whole image, px.
const WIDEST: usize = 320;

/// Side of the part that is shown pixel by pixel, as a part of the image's shorter side, and at most in pixels.
const PART: usize = 5;
const MOST: usize = 64;

/// Picture of an image brightened by `gain`, averaged down if it is wide. Small and slightly lossy.
pub fn whole(image: &Image, gain: f32) -> String {
    let small = reduced(image);
    jpeg(small.width, small.height, &srgb_bytes(&small, gain))
}

/// Where an image is brighter (red) and darker (blue) than the reference, both averaged down alike.
pub fn difference(image: &Image, reference: &Image) -> String {
    let (a, b) = (reduced(image), reduced(reference));
    let pixels = a.rgb.iter().zip(&b.rgb);
    let bytes: Vec<u8> = pixels
        .flat_map(|(x, r)| false_colour(signed_difference(*x, *r)))
        .collect();
    jpeg(a.width, a.height, &bytes)
}

/// A square part, every pixel as it is.
pub fn part(image: &Image, [x, y, size]: [usize; 3], gain: f32) -> String {
    let cut = image.cut(x, y, size, size).expect("a part of the image");
    uri("png", &png_bytes(size, size, &srgb_bytes(&cut, gain)))
}

fn reduced(image: &Image) -> Image {
    let longer = image.width.max(image.height);
    blocks(image, longer.div_ceil(WIDEST))
}

fn jpeg(width: usize, height: usize, rgb: &[u8]) -> String {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 88)
        .encode(rgb, width as u32, height as u32, ExtendedColorType::Rgb8)
        .expect("encoding into memory with a matching size");
    uri("jpeg", &bytes)
}

fn uri(kind: &str, bytes: &[u8]) -> String {
    format!("data:image/{kind};base64,{}", BASE64_STANDARD.encode(bytes))
}

/// Corner and side of the square in which the images' errors differ most from each other: the spread of the settings' mean
/// squared errors there, over the squared brightness around it.
pub fn most_different(images: &[&Image], reference: &Image) -> [usize; 3] {
    let (w, h) = (reference.width, reference.height);
    let size = (w.min(h) / PART).clamp(1, MOST).max(w.min(h).min(8));
    let all: Vec<f64> = reference.rgb.iter().map(|p| luminance(*p)).collect();
    let mean = all.iter().filter(|v| v.is_finite()).sum::<f64>() / all.len() as f64;
    let step = (size / 2).max(1);
    let mut best = ([0, 0, size], f64::NEG_INFINITY);
    for y in (0..=h - size).step_by(step) {
        for x in (0..=w - size).step_by(step) {
            let pixels = || (0..size * size).map(|i| (y + i / size) * w + x + i % size);
            let n = (size * size) as f64;
            let bright = pixels().map(|i| all[i]).sum::<f64>() / n;
            // The darkest parts are noise to the eye too: a fifth of the image's mean is added to what is divided by.
            let unit = (bright + 0.2 * mean).powi(2);
            let error = |im: &&Image| {
                // One pixel alone is not a region.
                let of = |i: usize| (luminance(im.rgb[i]) - all[i]).powi(2).min(4.0 * unit);
                pixels().map(of).sum::<f64>() / n / unit
            };
            let errors: Vec<f64> = images.iter().map(error).filter(|e| e.is_finite()).collect();
            let (low, high) = errors
                .iter()
                .fold((f64::INFINITY, 0.0f64), |(a, b), e| (a.min(*e), b.max(*e)));
            if high - low > best.1 {
                best = ([x, y, size], high - low);
            }
        }
    }
    best.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_is_where_one_image_errs_and_the_other_does_not() {
        let flat = Image {
            width: 100,
            height: 60,
            rgb: vec![[1.0; 3]; 6000],
        };
        let mut off = flat.clone();
        for y in 40..52 {
            for x in 70..82 {
                off.rgb[y * 100 + x] = [1.5; 3];
            }
        }
        let [x, y, size] = most_different(&[&flat, &off], &flat);
        assert_eq!(size, 12);
        assert!(x.abs_diff(70) <= 6 && y.abs_diff(40) <= 6, "{x} {y}");
        assert!(part(&off, [x, y, size], 1.0).starts_with("data:image/png;base64,iVBOR"));
        assert!(whole(&off, 1.0).starts_with("data:image/jpeg;base64,/9j/"));
        let tiny = Image {
            width: 3,
            height: 2,
            rgb: vec![[0.0; 3]; 6],
        };
        assert_eq!(most_different(&[&tiny], &tiny)[2], 2);
    }
}
