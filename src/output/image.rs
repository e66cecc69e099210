//! A linear RGB image in memory, and the sRGB tone curve.

use crate::scene::spectrum::xyz_to_rgb64;

/// Linear sRGB pixels, row-major, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width · height` pixels.
    pub rgb: Vec<[f32; 3]>,
}

/// Where an image's pixels lie in the full image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column and row.
    pub origin: [i32; 2],
    /// Full size in pixels.
    pub full: [usize; 2],
}

impl Window {
    /// All of an image of this size.
    pub fn whole(width: usize, height: usize) -> Self {
        Self {
            origin: [0, 0],
            full: [width, height],
        }
    }
}

impl Image {
    /// From tristimulus values, as a film gives them.
    pub fn from_xyz(width: usize, height: usize, xyz: &[[f64; 3]]) -> Self {
        assert_eq!(xyz.len(), width * height);
        Self {
            width,
            height,
            rgb: xyz
                .iter()
                .map(|v| xyz_to_rgb64(*v).map(|v| v as f32))
                .collect(),
        }
    }

    /// The rectangle at (x, y) of the given size, if it lies inside.
    pub fn cut(&self, x: usize, y: usize, width: usize, height: usize) -> Option<Self> {
        if x.checked_add(width)? > self.width || y.checked_add(height)? > self.height {
            return None;
        }
        Some(Self {
            width,
            height,
            rgb: (y..y + height)
                .flat_map(|r| &self.rgb[r * self.width + x..][..width])
                .copied()
                .collect(),
        })
    }
}

/// Linear 0..=1 → sRGB 0..=1 (IEC 61966-2-1). Outside values and NaN are clamped.
pub fn to_srgb(v: f32) -> f32 {
    let v = if v > 0.0 { v.min(1.0) } else { 0.0 };
    if v <= 0.0031308 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    }
}

/// sRGB 0..=1 → linear.
pub fn from_srgb(v: f32) -> f32 {
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tone_curve_inverts_and_clamps() {
        for i in 0..=255 {
            let s = i as f32 / 255.0;
            assert!((to_srgb(from_srgb(s)) - s).abs() < 1e-6);
        }
        assert_eq!([to_srgb(f32::NAN), to_srgb(-1.0)], [0.0, 0.0]);
        assert!((to_srgb(7.0) - 1.0).abs() < 1e-6);
        // 18 % grey is 46.1 % in sRGB (117.6 of 255).
        assert!((to_srgb(0.18) * 255.0 - 117.65).abs() < 0.05);
    }

    #[test]
    fn cutting_takes_the_right_pixels() {
        let image = Image {
            width: 3,
            height: 2,
            rgb: (0..6).map(|i| [i as f32; 3]).collect(),
        };
        let c = image.cut(1, 1, 2, 1).unwrap();
        assert_eq!(c.rgb, vec![[4.0; 3], [5.0; 3]]);
        assert!(image.cut(2, 0, 2, 1).is_none() && image.cut(usize::MAX, 0, 2, 1).is_none());
    }
}
