//! Textures as small expression trees over constants and images.

use super::spectrum::{Curve, Lanes, Rgb2Spec, Spectrum};
use glam::Vec2;

/// A decoded image, linear light, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Linear sRGB, row-major.
    pub rgb: Vec<[f32; 3]>,
}

/// What happens outside the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Tile.
    Repeat,
    /// Clamp to the border.
    Clamp,
    /// Zero outside.
    Black,
}

/// `(u, v) → (su·u + du, sv·v + dv)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvMapping {
    /// Scale.
    pub scale: Vec2,
    /// Offset.
    pub offset: Vec2,
}

impl UvMapping {
    /// Maps surface coordinates to texture coordinates.
    #[inline]
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        uv * self.scale + self.offset
    }
}

/// An image lookup.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageMap {
    /// Index into `Scene::images`.
    pub image: u32,
    /// Coordinates.
    pub mapping: UvMapping,
    /// Outside the unit square.
    pub wrap: Wrap,
    /// Nearest texel instead of bilinear.
    pub point: bool,
    /// 1 − value.
    pub invert: bool,
    /// Factor on the value.
    pub scale: f32,
}

impl ImageMap {
    /// Filtered linear RGB at `uv`.
    pub fn rgb(&self, uv: Vec2, images: &[Image]) -> [f32; 3] {
        let im = &images[self.image as usize];
        let st = self.mapping.apply(uv);
        // pbrt: t runs upwards, rows run downwards.
        let (x, y) = (
            st.x * im.width as f32 - 0.5,
            (1.0 - st.y) * im.height as f32 - 0.5,
        );
        let mut out = [0.0; 3];
        if self.point {
            out = texel(im, x.round() as i64, y.round() as i64, self.wrap);
        } else {
            let (x0, y0) = (x.floor(), y.floor());
            let (fx, fy) = (x - x0, y - y0);
            for (dx, dy, w) in [
                (0, 0, (1.0 - fx) * (1.0 - fy)),
                (1, 0, fx * (1.0 - fy)),
                (0, 1, (1.0 - fx) * fy),
                (1, 1, fx * fy),
            ] {
                let t = texel(im, x0 as i64 + dx, y0 as i64 + dy, self.wrap);
                for c in 0..3 {
                    out[c] += w * t[c];
                }
            }
        }
        out.map(|v| {
            let v = v * self.scale;
            if self.invert { (1.0 - v).max(0.0) } else { v }
        })
    }
}

fn texel(im: &Image, x: i64, y: i64, wrap: Wrap) -> [f32; 3] {
    let (w, h) = (im.width as i64, im.height as i64);
    let (x, y) = match wrap {
        Wrap::Repeat => (x.rem_euclid(w), y.rem_euclid(h)),
        Wrap::Clamp => (x.clamp(0, w - 1), y.clamp(0, h - 1)),
        Wrap::Black if x < 0 || y < 0 || x >= w || y >= h => return [0.0; 3],
        Wrap::Black => (x, y),
    };
    im.rgb[(y * w + x) as usize]
}

/// A number that may vary over the surface.
#[derive(Clone, Debug, PartialEq)]
pub enum FloatTexture {
    /// The same everywhere.
    Constant(f32),
    /// From an image (mean of the channels).
    Image(ImageMap),
    /// Product of two.
    Scale(Box<FloatTexture>, Box<FloatTexture>),
    /// Two textures in a checkerboard over `floor(u) + floor(v)`.
    Checkerboard(UvMapping, Box<FloatTexture>, Box<FloatTexture>),
}

impl FloatTexture {
    /// The same everywhere.
    pub fn is_uniform(&self) -> bool {
        matches!(self, Self::Constant(_))
    }

    /// Value at `uv`.
    pub fn eval(&self, uv: Vec2, images: &[Image]) -> f32 {
        match self {
            Self::Constant(v) => *v,
            Self::Image(m) => m.rgb(uv, images).iter().sum::<f32>() / 3.0,
            Self::Scale(a, b) => a.eval(uv, images) * b.eval(uv, images),
            Self::Checkerboard(m, a, b) => {
                (if checker(m.apply(uv)) { a } else { b }).eval(uv, images)
            }
        }
    }
}

/// A reflectance that may vary over the surface.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectrumTexture {
    /// The same everywhere.
    Constant(Curve),
    /// From an image; RGB is upsampled to a bounded reflectance.
    Image(ImageMap),
    /// Spectrum times number.
    Scale(Box<SpectrumTexture>, Box<FloatTexture>),
    /// Two textures in a checkerboard over `floor(u) + floor(v)`.
    Checkerboard(UvMapping, Box<SpectrumTexture>, Box<SpectrumTexture>),
}

impl SpectrumTexture {
    /// The same everywhere.
    pub fn is_uniform(&self) -> bool {
        matches!(self, Self::Constant(_))
    }

    /// Value at `uv` for the wavelengths of `lanes`.
    pub fn eval<const N: usize>(
        &self,
        uv: Vec2,
        lanes: &Lanes<N>,
        images: &[Image],
    ) -> Spectrum<N> {
        match self {
            Self::Constant(c) => c.eval(lanes),
            Self::Image(m) => {
                let rgb = m.rgb(uv, images).map(|v| v.clamp(0.0, 1.0));
                Rgb2Spec::get().fetch(rgb).eval(lanes)
            }
            Self::Scale(a, b) => a.eval(uv, lanes, images) * b.eval(uv, images),
            Self::Checkerboard(m, a, b) => {
                (if checker(m.apply(uv)) { a } else { b }).eval(uv, lanes, images)
            }
        }
    }
}

/// True on the cells of the first colour (pbrt-v4: even sums of cell indices).
fn checker(st: Vec2) -> bool {
    (st.x.floor() as i64 + st.y.floor() as i64).rem_euclid(2) == 0
}
