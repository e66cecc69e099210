//! More camera rays where the edge of a lamp divides a pixel.
//!
//! A lamp may be hundreds of times as bright as the wall behind it. Where its edge divides a pixel, a few samples of direct
//! light may leave an error that is larger than all others of the image together, though what it takes to know better is cheap:
//! rays that end at what they meet. So each sample of such a pixel sees lamps by [`GAZES`] rays of its own instead of the one
//! that it follows. Which pixels these are is found before the first sample, from streams of nobody: any choice is right in
//! the mean.

use super::camera_pass::{CameraSample, Gathered};
use crate::accel::Accel;
use crate::film::{Crop, Filter};
use crate::path::{Emitters, Kind, Palette, Tally, Vertex, World, trace};
use crate::real::{Real, Vec2, Vec3};
use crate::sampling::Rng;
use crate::scene::Light;
use crate::scene::spectrum::Spectrum;
use rayon::prelude::*;

/// Rays that look for lamps in a sample of a pixel that an edge divides. Stratified, they leave 1/64 of the variance of
/// one.
const GAZES: u32 = 16;

/// The pixels of an image that the edges of lamps divide.
pub(super) struct Gazes {
    crop: Crop,
    /// Pixel by pixel; empty without any.
    divided: Vec<bool>,
}

impl Gazes {
    /// None anywhere.
    pub fn none(crop: Crop) -> Self {
        Self {
            crop,
            divided: Vec::new(),
        }
    }

    /// A ray through each corner of a pixel: the edge of a lamp divides the pixels whose filter reaches corners at which
    /// different light is seen. What is smaller than a pixel may be missed, and then has the error that it would have had.
    pub fn find<const N: usize, A: Accel>(world: &World<A>, tally: &mut Tally) -> Self {
        let scene = world.scene;
        let crop = Crop::from(scene.camera.crop);
        let area = |l: &Light| matches!(l, Light::Area { .. });
        if !scene.lights.iter().any(area) {
            return Self::none(crop);
        }
        let lens = world.lens.sample_vertex(Vec2::splat(0.5));
        // Corners beyond those of the pixel itself that its filter reaches.
        let more = Filter::new(&scene.settings.filter).radius();
        let [right, down] = more.map(|r| (r - 0.5).ceil().max(0.0) as usize);
        let (width, height) = (crop.width(), crop.pixels() / crop.width());
        let across = width + 1 + 2 * right;
        let rows: Vec<(Vec<Real>, Tally)> = (0..height + 1 + 2 * down)
            .into_par_iter()
            .map(|row| {
                let mut tally = Tally::default();
                let palette = Palette::<N>::new(world.lanes(0.5));
                let y = (crop.y0 as Real + row as Real) - down as Real;
                let seen = |col: usize| {
                    let x = (crop.x0 as Real + col as Real) - right as Real;
                    let w = world.lens.direction(lens.p, Vec2::new(x, y));
                    match seen(world, &palette, &lens, w, &mut tally) {
                        Some((Kind::Surface, radiance)) => radiance.mean(),
                        _ => 0.0,
                    }
                };
                ((0..across).map(seen).collect(), tally)
            })
            .collect();
        for (_, t) in &rows {
            *tally += *t;
        }
        let divided = (0..crop.pixels()).map(|i| {
            let (x, y) = (i % width, i / width);
            let near = rows[y..=y + 1 + 2 * down].iter();
            let mut near = near.flat_map(|(row, _)| &row[x..=x + 1 + 2 * right]);
            let first = near.next();
            near.any(|l| Some(l) != first)
        });
        Self {
            crop,
            divided: divided.collect(),
        }
    }

    /// The edge of a lamp divides this pixel of the image.
    #[inline]
    pub fn divided(&self, [x, y]: [u32; 2]) -> bool {
        let (col, row) = ((x - self.crop.x0) as usize, (y - self.crop.y0) as usize);
        let place = row * self.crop.width() + col;
        self.divided.get(place).is_some_and(|d| *d)
    }
}

/// Adds what a sample of a divided pixel sees directly: the mean of several rays. Faults of the light that they find go into
/// `faults`.
pub(super) fn gaze<const N: usize, A: Accel>(
    world: &World<A>,
    palette: &Palette<N>,
    (sample, sum): (&CameraSample<N>, &mut Gathered),
    rng: &mut Rng,
    tally: &mut Tally,
    faults: &mut Tally,
) {
    for j in 0..GAZES {
        let (raster, weight) = sample.part(j, GAZES);
        let lens = world.lens.sample_vertex(rng.next_vec2());
        let w = world.lens.direction(lens.p, raster);
        if let Some((_, radiance)) = seen(world, palette, &lens, w, tally) {
            let weight = f64::from(weight) / f64::from(GAZES);
            sum.add_weighed(radiance, &sample.lanes, weight, faults);
        }
    }
}

/// What shines where a ray ends, and its radiance towards the lens.
fn seen<const N: usize, A: Accel>(
    world: &World<A>,
    palette: &Palette<N>,
    lens: &Vertex<N>,
    w: Vec3,
    tally: &mut Tally,
) -> Option<(Kind, Spectrum<N>)> {
    let v = trace(world, lens, w, palette, tally).filter(Emitters::can_be_hit)?;
    Some((v.kind, world.emitters.radiance(world.scene, &v, -w)))
}

#[cfg(test)]
mod tests {
    use super::super::pt::add_samples;
    use super::super::{CameraPass, Paths};
    use super::*;
    use crate::accel::{Embree, EmbreeOptions};
    use crate::scene::Scene;
    use crate::scene::load::{LoadOptions, load_str};
    use statrs::distribution::{ContinuousCDF, StudentsT};

    const SIDE: usize = 8;
    const SEEDS: u64 = 64;
    const SAMPLES: f64 = 8.0;

    /// A lamp that reaches from 2.2 to 5.4 and from 1.8 to 4.9 of the raster.
    fn scene(filter: &str) -> Scene {
        let text = format!(
            r#"
            Film "rgb" "integer xresolution" {SIDE} "integer yresolution" {SIDE}
            PixelFilter {filter}
            Camera "perspective" "float fov" 90
            WorldBegin
            AreaLightSource "diffuse" "rgb L" [1 1 1] "bool twosided" true
            Shape "trianglemesh" "integer indices" [0 1 2 0 2 3]
                "point3 P" [-0.9 -0.45 2  0.7 -0.45 2  0.7 1.1 2  -0.9 1.1 2]"#
        );
        load_str(&text, std::path::Path::new(""), &LoadOptions::default()).expect("a scene")
    }

    /// The part of pixel `i` of a row that lies between `a` and `b`.
    fn covered(i: usize, [a, b]: [f64; 2]) -> f64 {
        let i = i as f64;
        ((i + 1.0).min(b) - i.max(a)).max(0.0)
    }

    fn coverage(i: usize) -> f64 {
        covered(i % SIDE, [2.2, 5.4]) * covered(i / SIDE, [1.8, 4.9])
    }

    /// Luminance of each pixel, its mean and variance over the seeds.
    fn rendered<A: Accel>(world: &World<A>, gazes: &Gazes) -> Vec<[f64; 2]> {
        let mut tally = Tally::default();
        let images: Vec<Vec<f64>> = (0..SEEDS)
            .map(|seed| {
                let mut pass = CameraPass::new(world, None, 1000, seed);
                let what = (Paths::Direct, gazes);
                add_samples::<4, A>(world, &mut pass, SAMPLES, what, &mut tally);
                pass.sums.image().iter().map(|p| p[1]).collect()
            })
            .collect();
        let n = SEEDS as f64;
        let of = |i: usize| {
            let mean = images.iter().map(|m| m[i]).sum::<f64>() / n;
            let squares = images.iter().map(|m| (m[i] - mean).powi(2));
            [mean, squares.sum::<f64>() / (n - 1.0)]
        };
        (0..SIDE * SIDE).map(of).collect()
    }

    /// Pixel by pixel the same within the noise of both, family-wise at 1 %. What is smaller than `rare` has no normal law.
    fn same(a: &[[f64; 2]], b: &[[f64; 2]], rare: f64) {
        let t = StudentsT::new(0.0, 1.0, (SEEDS - 1) as f64).expect("degrees of freedom");
        let level = 1.0 - 0.99f64.powf(1.0 / a.len() as f64);
        let limit = t.inverse_cdf(1.0 - level / 2.0);
        for (i, ([x, v], [y, w])) in a.iter().zip(b).enumerate() {
            let se = ((v + w) / SEEDS as f64).sqrt();
            assert!((x - y).abs() <= limit * se + rare, "{i}: {x} {y} ± {se}");
        }
    }

    #[test]
    fn divided_pixels_are_found_and_known_better() {
        let scene = scene(r#""box" "float xradius" 0.5 "float yradius" 0.5"#);
        let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree builds");
        let world = World::new(&scene, &accel, 2);
        let gazes = Gazes::find::<4, _>(&world, &mut Tally::default());
        let divided = |i: usize| (1e-9..1.0 - 1e-9).contains(&coverage(i));
        for i in 0..SIDE * SIDE {
            let at = [(i % SIDE) as u32, (i / SIDE) as u32];
            assert_eq!(gazes.divided(at), divided(i), "{at:?}");
        }
        let with = rendered(&world, &gazes);
        let without = rendered(&world, &Gazes::none(gazes.crop));
        same(&with, &without, 1e-12);
        // Pixels that are all lamp tell what a lamp's luminance is, and how much of the variance is that of wavelengths.
        let all: Vec<[f64; 2]> = (0..SIDE * SIDE)
            .filter(|i| coverage(*i) > 1.0 - 1e-9)
            .map(|i| with[i])
            .collect();
        let [lamp, noise] =
            [0, 1].map(|k| all.iter().map(|p| p[k]).sum::<f64>() / all.len() as f64);
        let n = all.len() as f64;
        let truth: Vec<[f64; 2]> = (0..SIDE * SIDE)
            .map(|i| [lamp * coverage(i), noise / n * coverage(i).powi(2)])
            .collect();
        same(&with, &truth, 1e-12);
        let left = |image: &[[f64; 2]]| {
            let edges = (0..SIDE * SIDE).filter(|i| divided(*i));
            edges
                .map(|i| image[i][1] - noise * coverage(i).powi(2))
                .sum::<f64>()
        };
        // Rays that know nothing of each other would leave a sixteenth.
        let ratio = left(&without) / left(&with);
        println!("variance is {ratio} times smaller");
        assert!(ratio > f64::from(GAZES), "{ratio}");
    }

    /// A filter with negative lobes that reaches into other pixels: the same image, with the corners that it reaches.
    #[test]
    fn wide_filters_keep_their_image() {
        let scene = scene(r#""mitchell" "float xradius" 2 "float yradius" 2"#);
        let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree builds");
        let world = World::new(&scene, &accel, 2);
        let gazes = Gazes::find::<4, _>(&world, &mut Tally::default());
        for i in 0..SIDE * SIDE {
            let (x, y) = (i % SIDE, i / SIDE);
            let near = |i: usize, [a, b]: [f64; 2]| {
                let (lo, hi) = (i as f64 - 1.5, i as f64 + 2.5);
                [lo < a && a < hi || lo < b && b < hi, lo < b && a < hi]
            };
            let ([ex, cx], [ey, cy]) = (near(x, [2.2, 5.4]), near(y, [1.8, 4.9]));
            let passed = ex && cy || ey && cx;
            assert!(!passed || gazes.divided([x as u32, y as u32]), "{x} {y}");
        }
        // The filter's integral over the lamp, by the midpoint rule.
        let filter = Filter::new(&scene.settings.filter);
        let part = |i: usize, [a, b]: [f64; 2], value: &dyn Fn(f32) -> f32| {
            let n = 10_000;
            let at = |k: i32| a + (b - a) * (f64::from(k) + 0.5) / f64::from(n);
            let values = (0..n).map(|k| f64::from(value((at(k) - i as f64 - 0.5) as f32)));
            values.sum::<f64>() * (b - a) / f64::from(n)
        };
        let along = |d: f32| filter.evaluate(d, 0.0) / filter.evaluate(0.0, 0.0).sqrt();
        let with = rendered(&world, &gazes);
        // The lamp's luminance by least squares over all pixels.
        let parts: Vec<f64> = (0..SIDE * SIDE)
            .map(|i| part(i % SIDE, [2.2, 5.4], &along) * part(i / SIDE, [1.8, 4.9], &along))
            .collect();
        let weights: f64 = parts.iter().map(|p| p * p).sum();
        let lamp = parts.iter().zip(&with).map(|(p, v)| p * v[0]).sum::<f64>() / weights;
        let truth: Vec<[f64; 2]> = parts.iter().map(|p| [lamp * p, 0.0]).collect();
        // Ten rays of all.
        let rare = 10.0 / (SEEDS as f64 * SAMPLES * f64::from(GAZES));
        same(&with, &truth, lamp * rare);
        assert!(parts.iter().any(|p| lamp * p < -3.0 * lamp * rare));
    }

    /// Nothing is looked for where no lamp can be seen.
    #[test]
    fn without_area_lamps_there_are_none() {
        let text = r#"
            Camera "perspective"
            WorldBegin
            LightSource "point"
            Shape "sphere""#;
        let scene = load_str(text, std::path::Path::new(""), &LoadOptions::default());
        let scene = scene.expect("a scene");
        let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree builds");
        let mut tally = Tally::default();
        let gazes = Gazes::find::<4, _>(&World::new(&scene, &accel, 2), &mut tally);
        assert!(gazes.divided.is_empty() && !gazes.divided([0, 0]));
        assert_eq!(tally.rays_closest, 0);
    }
}
