//! Textures as small expression trees over constants and images.

use super::spectrum::{Curve, Lanes, Rgb2Spec, Spectrum};
use crate::real::{Convert, Real, Vec2};

/// A decoded image, linear light, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Row-major.
    pub texels: Texels,
}

/// The texels of an image.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// As the file has them, a third of the memory of floats; the fourth byte is spare.
    Bytes {
        /// Red, green, blue.
        data: Vec<[u8; 4]>,
        /// Linear light of each value.
        linear: Box<[f32; 256]>,
    },
    /// Linear sRGB.
    Floats(Vec<[f32; 3]>),
}

impl Image {
    /// Linear sRGB of texel `i`, row-major.
    #[inline]
    pub fn texel(&self, i: usize) -> [f32; 3] {
        match &self.texels {
            Texels::Bytes { data, linear } => {
                let [r, g, b, _] = data[i];
                [r, g, b].map(|v| linear[v as usize])
            }
            Texels::Floats(rgb) => rgb[i],
        }
    }

    /// Linear sRGB of all texels, row-major.
    pub fn rgb(&self) -> impl Iterator<Item = [f32; 3]> {
        (0..self.width as usize * self.height as usize).map(|i| self.texel(i))
    }
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
    pub scale: glam::Vec2,
    /// Offset.
    pub offset: glam::Vec2,
}

impl UvMapping {
    /// Maps surface coordinates to texture coordinates.
    #[inline]
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        uv * self.scale.real() + self.offset.real()
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
    pub fn rgb(&self, uv: Vec2, images: &[Image]) -> [Real; 3] {
        let im = &images[self.image as usize];
        let st = self.mapping.apply(uv);
        // pbrt: t runs upwards, rows run downwards.
        let (s, t) = (st.x, 1.0 - st.y);
        let (w, h) = (im.width as i32, im.height as i32);
        let mut out = [0.0; 3];
        if self.point {
            if let (Some(x), Some(y)) = (nearest(s, w, self.wrap), nearest(t, h, self.wrap)) {
                out = im.texel(y * im.width as usize + x).real();
            }
        } else {
            let (xs, fx) = between(s, w, self.wrap);
            let (ys, fy) = between(t, h, self.wrap);
            for (y, wy) in [(ys[0], 1.0 - fy), (ys[1], fy)] {
                for (x, wx) in [(xs[0], 1.0 - fx), (xs[1], fx)] {
                    if let (Some(x), Some(y)) = (x, y) {
                        let texel = im.texel(y * im.width as usize + x).real();
                        for c in 0..3 {
                            out[c] += wx * wy * texel[c];
                        }
                    }
                }
            }
        }
        out.map(|v| {
            let v = v * self.scale.real();
            if self.invert { (1.0 - v).max(0.0) } else { v }
        })
    }
}

/// The texel of n that the coordinate `s` lies nearest to; `None` in the black.
#[inline]
fn nearest(s: Real, n: i32, wrap: Wrap) -> Option<usize> {
    wrapped((inside(s, wrap) * n as Real - 0.5).round() as i32, n, wrap)
}

/// The two texels of n that the coordinate `s` lies between, and how far it is from the first.
#[inline]
fn between(s: Real, n: i32, wrap: Wrap) -> ([Option<usize>; 2], Real) {
    let x = inside(s, wrap) * n as Real - 0.5;
    let first = x.floor();
    let i = first as i32;
    (
        [wrapped(i, n, wrap), wrapped(i.saturating_add(1), n, wrap)],
        x - first,
    )
}

/// The coordinate brought into 0..=1 where it repeats, so that an index is off by one period at most.
#[inline]
fn inside(s: Real, wrap: Wrap) -> Real {
    match wrap {
        Wrap::Repeat => s - s.floor(),
        Wrap::Clamp | Wrap::Black => s,
    }
}

#[inline]
fn wrapped(i: i32, n: i32, wrap: Wrap) -> Option<usize> {
    let i = match wrap {
        Wrap::Repeat if i < 0 => i + n,
        Wrap::Repeat if i >= n => i - n,
        Wrap::Clamp => i.clamp(0, n - 1),
        _ => i,
    };
    (0 <= i && i < n).then_some(i as usize)
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
        match self {
            Self::Constant(_) => true,
            Self::Scale(a, b) => a.is_uniform() && b.is_uniform(),
            Self::Image(_) | Self::Checkerboard(..) => false,
        }
    }

    /// Value at `uv`.
    pub fn eval(&self, uv: Vec2, images: &[Image]) -> Real {
        match self {
            Self::Constant(v) => v.real(),
            Self::Image(m) => m.rgb(uv, images).iter().sum::<Real>() / 3.0,
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
        match self {
            Self::Constant(_) => true,
            Self::Scale(a, b) => a.is_uniform() && b.is_uniform(),
            Self::Image(_) | Self::Checkerboard(..) => false,
        }
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
                Rgb2Spec::get().fetch(rgb.single()).eval(lanes)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A 4 × 2 image whose red says the column and whose green says the row.
    fn at(uv: [Real; 2], wrap: Wrap, point: bool) -> [Real; 3] {
        let rgb = (0..8).map(|i| [(i % 4) as f32, (i / 4) as f32, 1.0]);
        let image = Image {
            width: 4,
            height: 2,
            texels: Texels::Floats(rgb.collect()),
        };
        let map = ImageMap {
            image: 0,
            mapping: UvMapping {
                scale: glam::Vec2::ONE,
                offset: glam::Vec2::ZERO,
            },
            wrap,
            point,
            invert: false,
            scale: 1.0,
        };
        map.rgb(Vec2::from(uv), &[image])
    }

    #[test]
    fn texels_lie_at_the_centres_of_their_cells_and_the_first_row_on_top() {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Black] {
            for point in [true, false] {
                for (x, y) in [(0, 0), (3, 0), (1, 1), (2, 1)] {
                    let uv = [(x as Real + 0.5) / 4.0, 1.0 - (y as Real + 0.5) / 2.0];
                    assert_eq!(at(uv, wrap, point), [x as Real, y as Real, 1.0]);
                }
            }
        }
        assert_eq!(at([0.5, 0.75], Wrap::Repeat, false), [1.5, 0.0, 1.0]);
        assert_eq!(at([0.375, 0.5], Wrap::Repeat, false), [1.0, 0.5, 1.0]);
    }

    #[test]
    fn outside_the_square_images_repeat_clamp_or_end() {
        for shift in [-3.0, -1.0, 1.0, 7.0] {
            for u in [0.0, 0.125, 0.3, 0.99] {
                let (inside, outside) = ([u, 0.75], [u + shift, 0.75 + shift]);
                let (a, b) = (
                    at(inside, Wrap::Repeat, false),
                    at(outside, Wrap::Repeat, false),
                );
                assert!((a[0] - b[0]).abs() < 1e-5 && a[1] == b[1], "{u} {shift}");
            }
        }
        // Half way between the last column and the first.
        assert_eq!(at([0.0, 0.75], Wrap::Repeat, false), [1.5, 0.0, 1.0]);
        assert_eq!(at([0.0, 0.75], Wrap::Clamp, false), [0.0, 0.0, 1.0]);
        assert_eq!(at([9.0, -5.0], Wrap::Clamp, true), [3.0, 1.0, 1.0]);
        assert_eq!(at([1.0, 0.75], Wrap::Black, false), [1.5, 0.0, 0.5]);
        for point in [true, false] {
            assert_eq!(at([1.5, 0.5], Wrap::Black, point), [0.0; 3]);
        }
    }
}
