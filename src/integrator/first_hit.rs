//! What camera rays hit first: albedo, normal and depth of each pixel, for compositing. The same pixels come of it whatever
//! the seed and the number of threads.

use super::camera_pass::BELOW_ONE;
use crate::accel::Accel;
use crate::chain::stage;
use crate::film::{Crop, Filter};
use crate::path::{Kind, Palette, Tally, Vertex, World, scatter, scatter_terms, trace};
use crate::real::{Convert, Real, Vec3};
use crate::sampling::{Net, Pair, Points, Rng, Single};
use crate::scatter::{Bsdf, Transport};
use crate::scene::spectrum::{Lanes, Spectrum, rgb_illuminant, xyz_to_rgb64};
use glam::Vec2;
use rayon::prelude::*;
use std::sync::Mutex;

/// Camera samples of a pixel. At four lanes their wavelengths are 64 evenly spread ones.
const SAMPLES: u64 = 16;

/// Pixels of the crop, row by row.
pub struct FirstHit {
    /// Part of the light of a uniform white surrounding that the surface sends to the camera, linear sRGB; glass has 1, the
    /// background 0.
    pub albedo: Vec<[f32; 3]>,
    /// Mean of the unit shading normals in world space, on the camera's side; 0 where there is no surface.
    pub normal: Vec<[f32; 3]>,
    /// Distance along the camera's axis in scene units, the mean over what is hit; infinite where nothing is.
    pub depth: Vec<f32>,
}

/// Weighted sums over a pixel's samples, in their order.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// All weights, and those of samples that hit something.
    weight: f64,
    hit: f64,
    /// RGB of white light by the surfaces' albedo, and of white light itself: of one set of wavelengths, so that grey
    /// surfaces come out grey.
    shaded: [f64; 3],
    white: [f64; 3],
    normal: [f64; 3],
    depth: f64,
}

/// Traces a camera ray for each sample.
pub fn first_hit<const N: usize, A: Accel>(world: &World<A>, tally: &mut Tally) -> FirstHit {
    let crop = Crop::from(world.scene.camera.crop);
    let filter = Filter::new(&world.scene.settings.filter);
    let illuminant = rgb_illuminant([1.0; 3]);
    let total = Mutex::new(Tally::default());
    let rows: Vec<Vec<Sums>> = (0..crop.pixels() / crop.width())
        .into_par_iter()
        .map(|row| {
            let y = crop.y0 + row as u32;
            let net = Net::new(&mut Rng::new(0, stage::LAYERS, y, u32::MAX));
            let mut tally = Tally::default();
            let mut palette = Palette::<N>::new(Lanes::new(0.0));
            let pixel = |col: usize| {
                let x = crop.x0 + col as u32;
                let mut rng = Rng::new(0, stage::LAYERS, y, x);
                rng.set_step(0);
                let points = Points::new(&net, &mut rng);
                let mut sums = Sums::default();
                for i in 0..SAMPLES {
                    rng.set_step(i + 1);
                    let (offset, weight) = filter.sample(points.pair(Pair::Raster, i));
                    let u = points.single(Single::Wavelength, i) as f32;
                    let lanes = world.lanes::<N>(u.min(BELOW_ONE).real());
                    palette.tune(&lanes);
                    let raster = (Vec2::new(x as f32 + 0.5, y as f32 + 0.5) + offset).real();
                    let lens = world.lens.sample_vertex(points.square(Pair::Lens, i));
                    let w = world.lens.direction(lens.p, raster);
                    let hit = trace(world, &lens, w, &palette, &mut tally);
                    sums.weight += weight as f64;
                    if let Some(v) = hit.filter(|v| v.kind == Kind::Surface) {
                        let albedo = albedo(&v, -w, &mut rng);
                        let white = illuminant.eval(&lanes);
                        sums.add(world, &v, w, weight as f64, (albedo, white, &lanes));
                    }
                }
                sums
            };
            let row = (0..crop.width()).map(pixel).collect();
            *total.lock().expect("no thread panicked") += tally;
            row
        })
        .collect();
    *tally += *total.lock().expect("no thread panicked");
    let all = || rows.iter().flatten();
    FirstHit {
        albedo: all().map(Sums::albedo).collect(),
        normal: all().map(Sums::normal).collect(),
        depth: all().map(Sums::depth).collect(),
    }
}

/// One estimate of the part of light from everywhere that is sent to the camera, which lies in direction `w_e`.
fn albedo<const N: usize>(v: &Vertex<N>, w_e: Vec3, rng: &mut Rng) -> Spectrum<N> {
    match v.bsdf {
        Bsdf::Black => Spectrum::ZERO,
        // Loses nothing; radiance is only compressed inside.
        Bsdf::Dielectric(_) | Bsdf::RoughDielectric(_) | Bsdf::ThinDielectric(_) => Spectrum::ONE,
        _ => {
            let Some((next, mode)) = scatter(v, w_e, Transport::FromEye, rng) else {
                return Spectrum::ZERO;
            };
            let t = scatter_terms(v, mode, next, w_e);
            if t.pdf_e <= 0.0 {
                return Spectrum::ZERO;
            }
            t.fs * (v.cos(next) / t.pdf_e) as Real
        }
    }
}

impl Sums {
    fn add<const N: usize, A: Accel>(
        &mut self,
        world: &World<A>,
        v: &Vertex<N>,
        w: Vec3,
        weight: f64,
        (albedo, white, lanes): (Spectrum<N>, Spectrum<N>, &Lanes<N>),
    ) {
        self.hit += weight;
        // Without colour the one wavelength stands for all.
        let rgb = |s: Spectrum<N>, shade: Spectrum<N>| match world.grey {
            Some(_) => [shade.mean() as f64; 3],
            None => xyz_to_rgb64(lanes.xyz.map(|w| (s * shade).dot(w) as f64)),
        };
        let (shaded, plain) = (rgb(white, albedo), rgb(white, Spectrum::ONE));
        let normal = if v.ns.dot(w) > 0.0 { -v.ns } else { v.ns };
        for c in 0..3 {
            self.shaded[c] += weight * shaded[c];
            self.white[c] += weight * plain[c];
            self.normal[c] += weight * normal[c] as f64;
        }
        let camera = &world.scene.camera;
        self.depth += weight * (v.p - camera.position.real()).dot(camera.axes.z_axis.real()) as f64;
    }

    fn albedo(&self) -> [f32; 3] {
        let part = self.hit / self.weight;
        let of = |c: usize| (part * self.shaded[c] / self.white[c]) as f32;
        let there = self.weight > 0.0 && self.hit > 0.0;
        std::array::from_fn(|c| {
            if there && self.white[c] > 0.0 {
                of(c)
            } else {
                0.0
            }
        })
    }

    fn normal(&self) -> [f32; 3] {
        let there = self.weight > 0.0;
        self.normal
            .map(|n| if there { (n / self.weight) as f32 } else { 0.0 })
    }

    fn depth(&self) -> f32 {
        if self.hit > 0.0 {
            (self.depth / self.hit) as f32
        } else {
            f32::INFINITY
        }
    }
}
