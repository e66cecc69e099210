//! Error metrics between an image x and a reference r, pixel by pixel. Pure functions.

use crate::output::Image;
use serde::Serialize;

/// ε of [`Comparison::rel_mse`] (squared radiance): the usual guard against dark references.
pub const REL_MSE_EPSILON: f64 = 0.01;

/// ε of [`Comparison::mape`] (radiance).
pub const MAPE_EPSILON: f64 = 0.01;

/// Luminance of linear sRGB (ITU-R BT.709).
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// What a comparison finds. Pixels where either image is not finite are left out of every figure and counted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Pixels (or blocks) compared.
    pub pixels: usize,
    /// Pixels left out because a channel of either image is not finite.
    pub non_finite: usize,
    /// Pixels whose reference luminance is not above 0: left out of l1, l2, l∞ only.
    pub black_reference: usize,
    /// Σx / Σr of each channel.
    pub mean_ratio: [f64; 3],
    /// Mean over pixels and channels of (x − r)² / (r² + ε), ε = [`REL_MSE_EPSILON`].
    pub rel_mse: f64,
    /// √ of the mean over pixels and channels of (x − r)².
    pub rmse: f64,
    /// Mean over pixels of |e|, where e = (x − r)/r in luminance: the relative error of Veach & Guibas 1997, §8.
    pub l1: f64,
    /// √ of the mean over pixels of e².
    pub l2: f64,
    /// Largest |e|.
    pub l_inf: f64,
    /// Mean over pixels and channels of |x − r| / (r + ε), ε = [`MAPE_EPSILON`]; negative r count as |r|.
    pub mape: f64,
    /// √ of the mean over pixels of (x − r)², over the mean of r, in luminance: what a render's own relative error
    /// (`film::ErrorSummary`) claims, and the error that `study` draws.
    pub rel_rms: f64,
    /// Mean of x − r over the mean of r, in luminance. One image cannot tell a bias from its own noise: see `decompose`.
    pub bias: f64,
}

/// Luminance of a pixel.
pub fn luminance(p: [f32; 3]) -> f64 {
    (0..3).map(|c| LUMINANCE[c] * p[c] as f64).sum()
}

/// Compares images of the same size; `None` if the sizes differ.
pub fn compare(image: &Image, reference: &Image) -> Option<Comparison> {
    if (image.width, image.height) != (reference.width, reference.height) {
        return None;
    }
    let mut sums = Sums::default();
    for (x, r) in image.rgb.iter().zip(&reference.rgb) {
        sums.add(*x, *r);
    }
    Some(sums.finish())
}

#[derive(Default)]
struct Sums {
    pixels: usize,
    non_finite: usize,
    black: usize,
    x: [f64; 3],
    r: [f64; 3],
    rel: f64,
    square: f64,
    percent: f64,
    e1: f64,
    e2: f64,
    e_max: f64,
    y_reference: f64,
    y_off: f64,
    y_square: f64,
}

impl Sums {
    fn add(&mut self, x: [f32; 3], r: [f32; 3]) {
        if !x.iter().chain(&r).all(|v| v.is_finite()) {
            self.non_finite += 1;
            return;
        }
        self.pixels += 1;
        for c in 0..3 {
            let (x, r) = (x[c] as f64, r[c] as f64);
            let d = x - r;
            self.x[c] += x;
            self.r[c] += r;
            self.square += d * d;
            self.rel += d * d / (r * r + REL_MSE_EPSILON);
            self.percent += d.abs() / (r.abs() + MAPE_EPSILON);
        }
        let y = luminance(r);
        let off = luminance(x) - y;
        self.y_reference += y;
        self.y_off += off;
        self.y_square += off * off;
        if y > 0.0 {
            let e = off / y;
            self.e1 += e.abs();
            self.e2 += e * e;
            self.e_max = self.e_max.max(e.abs());
        } else {
            self.black += 1;
        }
    }

    fn finish(self) -> Comparison {
        let n = self.pixels as f64;
        let lit = (self.pixels - self.black) as f64;
        Comparison {
            pixels: self.pixels,
            non_finite: self.non_finite,
            black_reference: self.black,
            mean_ratio: std::array::from_fn(|c| self.x[c] / self.r[c]),
            rel_mse: self.rel / (3.0 * n),
            rmse: (self.square / (3.0 * n)).sqrt(),
            l1: self.e1 / lit,
            l2: (self.e2 / lit).sqrt(),
            l_inf: self.e_max,
            mape: self.percent / (3.0 * n),
            rel_rms: (self.y_square * n).sqrt() / self.y_reference,
            bias: self.y_off / self.y_reference,
        }
    }
}

/// Means over blocks of `size × size` pixels; blocks at the right and lower border may hold fewer. A reference carries
/// noise of its own, which blocks average away: a bias stays. A pixel that is not finite spoils its block.
pub fn blocks(image: &Image, size: usize) -> Image {
    let size = size.max(1);
    let (width, height) = (image.width.div_ceil(size), image.height.div_ceil(size));
    let mut sums = vec![[0.0f64; 4]; width * height];
    for y in 0..image.height {
        for x in 0..image.width {
            let s = &mut sums[(y / size) * width + x / size];
            for (c, v) in image.rgb[y * image.width + x].into_iter().enumerate() {
                s[c] += v as f64;
            }
            s[3] += 1.0;
        }
    }
    Image {
        width,
        height,
        rgb: sums
            .iter()
            .map(|s| [s[0], s[1], s[2]].map(|v| (v / s[3]) as f32))
            .collect(),
    }
}

/// How x stands to r in luminance, −1..=1: (x − r)/(x + r), so twice and half the reference give ±1/3. 0 where both are
/// 0, NaN where either is not finite.
pub fn signed_difference(x: [f32; 3], r: [f32; 3]) -> f64 {
    let (x, r) = (luminance(x), luminance(r));
    if !(x.is_finite() && r.is_finite()) {
        return f64::NAN;
    }
    let sum = x.abs() + r.abs();
    if sum > 0.0 { (x - r) / sum } else { 0.0 }
}

/// False colour of a [`signed_difference`], sRGB bytes: white at 0, red where the image is brighter, blue where it is
/// darker, full at ±1/3 (a factor of two); green where it is not a number.
pub fn false_colour(d: f64) -> [u8; 3] {
    if d.is_nan() {
        return [0, 160, 0];
    }
    let t = (3.0 * d).clamp(-1.0, 1.0);
    let fade = (255.0 * (1.0 - t.abs())).round() as u8;
    if t >= 0.0 {
        [255, fade, fade]
    } else {
        [fade, fade, 255]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(rgb: &[[f32; 3]]) -> Image {
        Image {
            width: rgb.len(),
            height: 1,
            rgb: rgb.to_vec(),
        }
    }

    fn close(a: f64, b: f64) {
        // Inputs are f32 roundings of the decimals the figures were computed from.
        assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    }

    #[test]
    fn figures_match_an_independent_computation() {
        let x = image(&[
            [0.5, 1.0, 2.0],
            [0.0, 0.3, 0.1],
            [4.0, 1.5, 0.25],
            [1.0, 1.0, 1.0],
        ]);
        let r = image(&[
            [0.4, 1.25, 2.0],
            [0.1, 0.2, 0.1],
            [3.0, 1.5, 0.5],
            [0.0, 0.0, 0.0],
        ]);
        // Python, double precision, straight from the definitions.
        let c = compare(&x, &r).unwrap();
        assert_eq!((c.pixels, c.non_finite, c.black_reference), (4, 0, 1));
        close(c.mean_ratio[0], 1.5714285714285714);
        close(c.mean_ratio[1], 1.2881355932203389);
        close(c.mean_ratio[2], 1.2884615384615385);
        close(c.rel_mse, 25.095828463676686);
        close(c.rmse, 0.588430114796991);
        close(c.mape, 25.220834876230924);
        close(c.l1, 0.1815461740859087);
        close(c.l2, 0.1982718155792577);
        close(c.l_inf, 0.2930270522388058);
        close(c.rel_rms, 0.6786311826002355);
        close(c.bias, 0.3574594147418878);
    }

    #[test]
    fn equal_images_differ_by_nothing_and_bad_pixels_are_counted() {
        let mut x = image(&[[0.2, 0.4, 0.6], [1.0, 2.0, 3.0]]);
        let r = x.clone();
        let c = compare(&x, &r).unwrap();
        assert_eq!((c.mean_ratio, c.rel_mse, c.l_inf), ([1.0; 3], 0.0, 0.0));
        x.rgb[1][2] = f32::NAN;
        let c = compare(&x, &r).unwrap();
        assert_eq!((c.pixels, c.non_finite, c.rmse), (1, 1, 0.0));
        assert!(compare(&x, &image(&[[0.0; 3]])).is_none());
    }

    #[test]
    fn blocks_average_partial_borders_too() {
        let x = Image {
            width: 3,
            height: 3,
            rgb: (0..9).map(|i| [i as f32, 0.0, 1.0]).collect(),
        };
        let b = blocks(&x, 2);
        assert_eq!((b.width, b.height), (2, 2));
        assert_eq!(
            b.rgb,
            vec![
                [2.0, 0.0, 1.0],
                [3.5, 0.0, 1.0],
                [6.5, 0.0, 1.0],
                [8.0, 0.0, 1.0]
            ]
        );
        assert_eq!(blocks(&x, 1), x);
    }

    #[test]
    fn false_colours_saturate_at_a_factor_of_two() {
        assert_eq!(
            false_colour(signed_difference([2.0; 3], [1.0; 3])),
            [255, 0, 0]
        );
        assert_eq!(
            false_colour(signed_difference([0.5; 3], [1.0; 3])),
            [0, 0, 255]
        );
        assert_eq!(
            false_colour(signed_difference([0.0; 3], [0.0; 3])),
            [255; 3]
        );
        assert_eq!(
            false_colour(signed_difference([f32::NAN; 3], [1.0; 3])),
            [0, 160, 0]
        );
    }
}
