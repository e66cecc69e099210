//! ꟻLIP, the difference a person sees between two pictures when flipping between them (Andersson et al. 2020), by NVIDIA's
//! own code. Lengths of the eye: the default 67 pixels a degree, a 4K screen of 0.7 m width at 0.7 m.

use crate::output::{Image, to_srgb};
use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8, FlipPool};

/// Mean ꟻLIP over the pixels, 0 (nothing seen) to 1, of two images of one size shown in sRGB after a common `gain`. `None` if
/// the sizes differ.
pub fn flip(image: &Image, reference: &Image, gain: f32) -> Option<f64> {
    if (image.width, image.height) != (reference.width, reference.height) {
        return None;
    }
    let shown = |im: &Image| {
        let bytes = srgb_bytes(im, gain);
        FlipImageRgb8::with_data(im.width as u32, im.height as u32, &bytes)
    };
    let map = nv_flip::flip(shown(reference), shown(image), DEFAULT_PIXELS_PER_DEGREE);
    Some(FlipPool::from_image(&map).mean() as f64)
}

/// 8-bit sRGB of the image times `gain`.
pub fn srgb_bytes(image: &Image, gain: f32) -> Vec<u8> {
    let channels = image.rgb.iter().flatten();
    channels
        .map(|v| (to_srgb(v * gain) * 255.0).round() as u8)
        .collect()
}

/// The factor that brings an image's brighter parts into view: its 95th percentile of luminance to 0.8. 1 for a black image.
pub fn auto_gain(reference: &Image) -> f32 {
    let mut y: Vec<f64> = reference
        .rgb
        .iter()
        .map(|p| super::metrics::luminance(*p))
        .filter(|y| y.is_finite() && *y > 0.0)
        .collect();
    if y.is_empty() {
        return 1.0;
    }
    y.sort_by(f64::total_cmp);
    (0.8 / y[(y.len() - 1) * 95 / 100]) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(v: f32) -> Image {
        Image {
            width: 16,
            height: 16,
            rgb: vec![[v; 3]; 256],
        }
    }

    fn flat(v: [f32; 3]) -> Image {
        Image {
            width: 16,
            height: 16,
            rgb: vec![v; 256],
        }
    }

    /// Flat images differ by ꟻLIP's colour term alone. The figures are of its definition (Andersson et al. 2020, section 4:
    /// Hunt-adjusted L*a*b*, HyAB, exponent 0.7, p_c = 0.4, p_t = 0.95) written down in numpy in double precision; the
    /// crate's constants and sums in single precision leave some 3e-4.
    #[test]
    fn figures_match_an_independent_computation() {
        for (x, r, expected) in [
            ([0.3; 3], [0.33; 3], 0.10243544001135617),
            ([0.3; 3], [0.8; 3], 0.6214075064387159),
            ([0.0; 3], [1.0; 3], 0.9673797614921328),
            ([0.2, 0.5, 0.1], [0.25, 0.45, 0.3], 0.5798609166655933),
        ] {
            let found = flip(&flat(x), &flat(r), 1.0).expect("same size");
            assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
        }
        assert_eq!(flip(&grey(0.3), &grey(0.3), 1.0), Some(0.0));
        assert_eq!(flip(&grey(0.1), &grey(0.2), 0.0), Some(0.0));
        let wide = Image {
            width: 2,
            height: 1,
            rgb: vec![[0.0; 3]; 2],
        };
        assert!(flip(&wide, &grey(0.0), 1.0).is_none());
    }

    #[test]
    fn the_gain_follows_the_brighter_parts() {
        let mut im = grey(2.0);
        im.rgb[0] = [1e6; 3];
        im.rgb[1] = [f32::NAN; 3];
        assert!((auto_gain(&im) - 0.4).abs() < 1e-6);
        assert_eq!(auto_gain(&grey(0.0)), 1.0);
    }
}
