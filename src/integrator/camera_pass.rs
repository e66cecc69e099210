//! Samples that belong to a pixel: each pixel has its own random streams and sums, so threads never share one.

use super::CameraSums;
use super::pixel_sums::PixelSums;
use crate::accel::Accel;
use crate::film::{Bins, Crop, Filter, Malformed, Shards};
use crate::path::{LightPoint, Site, Tally, World};
use crate::real::Convert;
use crate::sampling::{Net, Pair, Points, Rng, Single};
use crate::scene::spectrum::{Grey, Lanes, Spectrum, Target};
use glam::Vec2;
use rayon::prelude::*;

/// One camera sample's random start.
pub struct CameraSample<'a, const N: usize> {
    /// Raster point.
    pub raster: crate::real::Vec2,
    /// Filter weight (negative in a negative lobe).
    pub weight: f32,
    /// Wavelengths.
    pub lanes: Lanes<N>,
    /// Pixel of the image.
    pub pixel: [u32; 2],
    sample: u64,
    sequence: &'a Sequence<'a>,
}

/// The points of a pixel that its samples take.
struct Sequence<'a> {
    filter: &'a Filter,
    centre: Vec2,
    points: Points<'a>,
}

impl Sequence<'_> {
    /// Raster point number `i` and its filter weight.
    #[inline]
    fn point(&self, i: u64) -> (crate::real::Vec2, f32) {
        let (offset, weight) = self.filter.sample(self.points.pair(Pair::Raster, i));
        ((self.centre + offset).real(), weight)
    }
}

impl<const N: usize> CameraSample<'_, N> {
    /// One of `n` raster points of a sample that takes so many, and its filter weight. Those of all samples of the pixel
    /// are one sequence, which fills the pixel as evenly as one point a sample does.
    #[inline]
    pub fn part(&self, j: u32, n: u32) -> (crate::real::Vec2, f32) {
        self.sequence
            .point(self.sample * u64::from(n) + u64::from(j))
    }

    /// Its point on the lens, in the unit square.
    #[inline]
    pub fn lens(&self) -> crate::real::Vec2 {
        self.sequence.points.square(Pair::Lens, self.sample)
    }

    /// What chooses its point on a light.
    #[inline]
    pub fn light(&self) -> LightPoint {
        let points = &self.sequence.points;
        LightPoint {
            choice: points.single(Single::Choice, self.sample),
            at: points.square(Pair::Light, self.sample),
        }
    }

    /// Where it belongs in the run.
    pub fn site(&self, direct: bool) -> Site {
        Site::Pixel {
            direct,
            pixel: self.pixel,
            sample: self.sample,
        }
    }
}

/// What one camera sample gathers.
pub struct Gathered<'a> {
    /// XYZ, to be weighed by the sample's filter weight.
    pub xyz: [f64; 3],
    /// XYZ that is weighed already.
    weighed: [f64; 3],
    weight: f64,
    /// The pixel's bins.
    bins: Option<(Bins, &'a mut [f64])>,
}

impl Gathered<'_> {
    /// Adds radiance at the wavelengths of `lanes`; non-finite values are counted and dropped.
    #[inline]
    pub fn add<const N: usize>(&mut self, s: Spectrum<N>, lanes: &Lanes<N>, tally: &mut Tally) {
        let xyz = lanes.xyz.map(|w| s.dot(w) as f64);
        if tally.check(xyz[0] + xyz[1] + xyz[2]) {
            for (sum, v) in self.xyz.iter_mut().zip(xyz) {
                *sum += v;
            }
            self.add_to_bins(s, lanes, 1.0);
        }
    }

    /// Adds radiance that was found at another raster point of the pixel, with a weight of its own instead of the sample's.
    #[inline]
    pub fn add_weighed<const N: usize>(
        &mut self,
        s: Spectrum<N>,
        lanes: &Lanes<N>,
        weight: f64,
        tally: &mut Tally,
    ) {
        let xyz = lanes.xyz.map(|w| s.dot(w) as f64);
        if tally.check(xyz[0] + xyz[1] + xyz[2]) {
            for (sum, v) in self.weighed.iter_mut().zip(xyz) {
                *sum += v * weight;
            }
            self.fill(s, lanes, weight);
        }
    }

    /// Adds `s · k` to the bins alone, if there are any.
    #[inline]
    pub fn add_to_bins<const N: usize>(&mut self, s: Spectrum<N>, lanes: &Lanes<N>, k: f64) {
        self.fill(s, lanes, k * self.weight);
    }

    #[inline]
    fn fill<const N: usize>(&mut self, s: Spectrum<N>, lanes: &Lanes<N>, weight: f64) {
        if let Some((bins, sums)) = &mut self.bins {
            let scale = weight / bins.width();
            for (lambda, v) in lanes.lambda.single().into_iter().zip((s * lanes.nm()).0) {
                sums[bins.index(lambda)] += v as f64 * scale;
            }
        }
    }
}

/// Camera samples of the pixels of the crop, and what they have added up.
pub struct CameraPass {
    /// One for each row: to make its columns takes longer than a sample.
    nets: Vec<Net>,
    filter: Filter,
    stage: u32,
    seed: u64,
    target: Target,
    grey: Option<Grey>,
    /// The sums.
    pub sums: CameraSums,
}

/// The largest number below 1.
pub(super) const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

impl CameraPass {
    /// No samples yet.
    pub fn new<A: Accel>(world: &World<A>, bins: Option<Bins>, stage: u32, seed: u64) -> Self {
        let crop = Crop::from(world.scene.camera.crop);
        let rng = Rng::new(seed, stage, u32::MAX, u32::MAX);
        let rows = (crop.pixels() / crop.width()) as u32;
        let net = |row| Net::new(&mut Rng::new(seed, stage, crop.y0 + row, u32::MAX));
        Self {
            nets: (0..rows).map(net).collect(),
            filter: Filter::new(&world.scene.settings.filter),
            stage,
            seed,
            target: world.target,
            grey: world.grey,
            sums: CameraSums::new(crop, bins, rng),
        }
    }

    /// Only the pixels of some parts of the work; before the first sample.
    pub fn with_shards(mut self, shards: Shards) -> Self {
        assert!(self.sums.samples == 0.0, "samples have been taken");
        self.sums.shards = shards;
        self
    }

    /// Goes on from sums that were saved.
    ///
    /// # Errors
    /// Sums of another image.
    pub fn resume(&mut self, sums: CameraSums) -> Result<(), Malformed> {
        if !self.sums.matches(&sums) {
            return Err(Malformed::new("is of another image or other settings"));
        }
        self.sums = sums;
        Ok(())
    }

    /// Adds samples until there are `until` a pixel, in the mean. `f` gets a thread's state, the sample, its stream, and what to
    /// add radiance to.
    pub fn run<const N: usize, S: Send>(
        &mut self,
        until: f64,
        state: impl Fn() -> S + Sync,
        f: impl Fn(&mut S, &CameraSample<N>, &mut Rng, &mut Gathered) + Sync,
        done: impl Fn(S) + Sync,
    ) {
        let all = &mut self.sums;
        let (before, Crop { x0, y0, .. }) = (all.samples, all.crop);
        let due = all.schedule();
        let width = all.crop.width();
        let (filter, stage, seed) = (&self.filter, self.stage, self.seed);
        let nets = &self.nets;
        let (target, grey) = (self.target, self.grey);
        let (bins, spectra) = match &mut all.spectra {
            Some((bins, sums)) => (Some(*bins), sums.as_mut_slice()),
            None => (None, [].as_mut_slice()),
        };
        let count = bins.map_or(0, |b| b.count);
        let mut rest = spectra;
        let rows: Vec<(&mut [PixelSums], &mut [f64])> = all
            .sums
            .chunks_mut(width)
            .map(|sums| {
                let (row, other) = std::mem::take(&mut rest).split_at_mut(sums.len() * count);
                rest = other;
                (sums, row)
            })
            .collect();
        rows.into_par_iter()
            .enumerate()
            .for_each(|(row, (sums, spectra))| {
                let mut s = state();
                let y = y0 + row as u32;
                let net = &nets[row];
                for (col, sum) in sums.iter_mut().enumerate() {
                    let x = x0 + col as u32;
                    let (from, until) = (due(before, x, y), due(until, x, y));
                    if from >= until {
                        continue;
                    }
                    let mut rng = Rng::new(seed, stage, y, x);
                    // Step 0 holds the pixel's shift of its row's net.
                    rng.set_step(0);
                    let points = Points::new(net, &mut rng);
                    let sequence = Sequence {
                        filter,
                        centre: Vec2::new(x as f32 + 0.5, y as f32 + 0.5),
                        points,
                    };
                    for i in from..until {
                        rng.set_step(i + 1);
                        let (raster, weight) = sequence.point(i);
                        let lanes = match &grey {
                            None => {
                                let u = points.single(Single::Wavelength, i) as f32;
                                Lanes::with(u.min(BELOW_ONE).real(), target)
                            }
                            Some(grey) => grey.lanes(target),
                        };
                        let mut gathered = Gathered {
                            xyz: [0.0; 3],
                            weighed: [0.0; 3],
                            weight: weight as f64,
                            bins: bins.map(|b| (b, &mut spectra[col * count..][..count])),
                        };
                        f(
                            &mut s,
                            &CameraSample {
                                raster,
                                weight,
                                lanes,
                                pixel: [x, y],
                                sample: i,
                                sequence: &sequence,
                            },
                            &mut rng,
                            &mut gathered,
                        );
                        let (found, weighed) = (gathered.xyz, gathered.weighed);
                        let value = [0, 1, 2].map(|c| found[c] * weight as f64 + weighed[c]);
                        sum.add(i, value);
                    }
                }
                done(s);
            });
        self.sums.samples = until.max(before);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::accel::{Embree, EmbreeOptions};
    use crate::scene::load::{LoadOptions, load_str};

    /// Sums of a square image after each of these numbers of samples a pixel in the mean; a sample gives the luminance `f`.
    pub fn passed(
        side: u32,
        mean: &[f64],
        seed: u64,
        f: impl Fn(Vec2, &mut Rng) -> f64 + Sync,
    ) -> CameraSums {
        let text = format!(
            r#"
            Film "rgb" "integer xresolution" {side} "integer yresolution" {side}
            PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
            Camera "perspective"
            WorldBegin
            Shape "sphere""#
        );
        let scene =
            load_str(&text, std::path::Path::new(""), &LoadOptions::default()).expect("a scene");
        let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree builds");
        let world = World::new(&scene, &accel, 1);
        let mut pass = CameraPass::new(&world, None, 1000, seed);
        for &until in mean {
            pass.run::<1, ()>(
                until,
                || (),
                |_, s, rng, sum| sum.xyz[1] += f(s.raster.single(), rng),
                |_| (),
            );
        }
        pass.sums
    }

    /// A uniform white field, after some samples a pixel in the mean, and how many there were.
    fn white(mean: &[f64], seed: u64) -> (Vec<f64>, f64) {
        let taken = std::sync::atomic::AtomicU64::new(0);
        let sums = passed(16, mean, seed, |_, _| {
            taken.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            1.0
        });
        let image = sums.image().iter().map(|p| p[1]).collect();
        (image, taken.into_inner() as f64 / 256.0)
    }

    /// A pixel's mean is over its own samples; where a part of the pixels has one, they stand for all. Cutting the work
    /// changes nothing.
    #[test]
    fn a_part_of_a_sample_makes_the_image_too() {
        let (image, taken) = white(&[2.4], 1);
        assert!(image.iter().all(|v| (v - 1.0).abs() < 1e-12));
        assert!((taken - 2.4).abs() < 0.05, "{taken}");
        let seeds = 64;
        let mut sum = 0.0;
        for seed in 0..seeds {
            let (image, _) = white(&[0.4], seed);
            assert_eq!(image, white(&[0.1, 0.11, 0.4], seed).0);
            assert!(image.iter().all(|v| *v == 0.0 || *v == 2.5));
            sum += image.iter().sum::<f64>() / 256.0;
        }
        // Some lattice points of 256 too many or too few in each image, as often one as the other.
        assert!((sum / seeds as f64 - 1.0).abs() < 0.02);
    }
}
