//! What camera samples have added up so far, pixel by pixel.

use super::dither::{samples_at, threshold};
use super::pixel_sums::PixelSums;
use crate::film::{Bins, Crop, Malformed, Reader, Shards, Writer};
use crate::sampling::Rng;
use std::io;

/// Pixels that are written at a time.
const TOGETHER: usize = 1024;

/// Sums of camera samples over the crop.
pub struct CameraSums {
    pub(super) crop: Crop,
    /// Of each pixel.
    pub(super) sums: Vec<PixelSums>,
    pub(super) spectra: Option<(Bins, Vec<f64>)>,
    /// Samples a pixel so far, in the mean: a pixel has ⌊samples + its threshold⌋.
    pub samples: f64,
    /// Random shifts of all pixels' thresholds, so that each is uniform: for the number of samples, for the parts of
    /// the work.
    shift: [u32; 2],
    /// Whose pixels are here. A pixel belongs to one part with all of its samples, which are added in their order.
    pub shards: Shards,
}

impl CameraSums {
    /// No samples yet. `rng` chooses who is ahead where the samples are no whole number.
    pub(super) fn new(crop: Crop, bins: Option<Bins>, mut rng: Rng) -> Self {
        let n = crop.pixels();
        Self {
            crop,
            sums: vec![PixelSums::default(); n],
            spectra: bins.map(|b| (b, vec![0.0; n * b.count])),
            samples: 0.0,
            shift: [rng.next_u32(), rng.next_u32()],
            shards: Shards::default(),
        }
    }

    /// Samples that pixel (x, y) of the image has when there are `mean` a pixel.
    #[inline]
    pub(super) fn due(&self, mean: f64, x: u32, y: u32) -> u64 {
        due(&self.shards, self.shift, mean, x, y)
    }

    /// As [`Self::due`], apart from the sums.
    pub(super) fn schedule(&self) -> impl Fn(f64, u32, u32) -> u64 + Sync + use<> {
        let (shards, shift) = (self.shards.clone(), self.shift);
        move |mean, x, y| due(&shards, shift, mean, x, y)
    }

    /// Mean XYZ of each pixel, row-major over the crop.
    pub fn image(&self) -> Vec<[f64; 3]> {
        let pixels = self.sums.iter().enumerate();
        pixels
            .map(|(i, s)| s.xyz.map(|v| v * self.scale(i)))
            .collect()
    }

    /// Mean radiance per nm, `[pixel · bins + bin]`, if bins are filled.
    pub fn spectrum(&self) -> Option<Vec<f64>> {
        let (bins, sums) = self.spectra.as_ref()?;
        let values = sums.iter().enumerate();
        Some(
            values
                .map(|(i, v)| v * self.scale(i / bins.count))
                .collect(),
        )
    }

    /// 1 over the samples of a pixel. Below one a pixel, the sampled ones stand for those that are not: 1 over the part
    /// of them, so that the mean over seeds is right everywhere. So do those that are here for those of missing parts.
    fn scale(&self, pixel: usize) -> f64 {
        let here = self.shards.portion();
        if self.samples >= 1.0 {
            match self.count(pixel) {
                0 => 0.0,
                n => 1.0 / n as f64 / here,
            }
        } else if self.samples > 0.0 {
            1.0 / self.samples / here
        } else {
            0.0
        }
    }

    /// Samples of a pixel.
    pub(super) fn count(&self, pixel: usize) -> u64 {
        let [x, y] = self.place(pixel);
        self.due(self.samples, x, y)
    }

    fn place(&self, pixel: usize) -> [u32; 2] {
        let width = self.crop.width();
        let (x, y) = (pixel % width, pixel / width);
        [self.crop.x0 + x as u32, self.crop.y0 + y as u32]
    }

    /// The pixel is of a part that is here.
    pub(super) fn has(&self, pixel: usize) -> bool {
        let [x, y] = self.place(pixel);
        has(&self.shards, self.shift, x, y)
    }

    /// Whole samples that all pixels have, together.
    pub(super) fn whole_samples(&self) -> f64 {
        let pixels = (0..self.sums.len()).filter(|i| self.has(*i)).count();
        (self.samples as u64).max(1) as f64 * pixels as f64
    }

    /// Writes the sums.
    pub(super) fn save(&self, w: &mut Writer) -> io::Result<()> {
        self.crop.save(w)?;
        w.u32(self.spectra.as_ref().map_or(0, |s| s.0.count as u32))?;
        w.f64(self.samples)?;
        self.shift.into_iter().try_for_each(|v| w.u32(v))?;
        self.shards.save(w)?;
        let mut bytes = Vec::with_capacity(TOGETHER * PixelSums::BYTES);
        for some in self.sums.chunks(TOGETHER) {
            bytes.clear();
            some.iter().for_each(|s| s.append(&mut bytes));
            w.bytes(&bytes)?;
        }
        let spectra = self.spectra.as_ref();
        spectra.map_or(Ok(()), |(_, sums)| w.floats(sums))
    }

    /// What [`Self::save`] wrote.
    pub(super) fn read(r: &mut Reader) -> Result<Self, Malformed> {
        let crop = Crop::read(r)?;
        let bins = r.u32()? as usize;
        let bins = (bins > 0).then(|| Bins::new(bins));
        let samples = r.f64()?;
        if !(0.0..=MOST_SAMPLES).contains(&samples) {
            return Err(Malformed(format!("claims {samples} samples a pixel")));
        }
        let shift = [r.u32()?, r.u32()?];
        let shards = Shards::read(r)?;
        r.holds(crop.pixels(), PixelSums::BYTES)?;
        let all = r.bytes(crop.pixels() * PixelSums::BYTES)?.as_chunks();
        let sums = all.0.iter().map(PixelSums::of_bytes).collect();
        let spectra = bins
            .map(|b| r.floats(crop.pixels() * b.count).map(|sums| (b, sums)))
            .transpose()?;
        Ok(Self {
            crop,
            sums,
            spectra,
            samples,
            shift,
            shards,
        })
    }

    /// Of the same image as `other`, as far as it goes.
    pub(super) fn matches(&self, other: &Self) -> bool {
        let bins = |s: &Self| s.spectra.as_ref().map(|b| b.0);
        self.crop == other.crop && self.shift == other.shift && bins(self) == bins(other)
    }

    /// Takes in another part's pixels.
    ///
    /// # Errors
    /// Sums of another run, or pixels that are here already.
    pub(super) fn merge(&mut self, other: Self) -> Result<(), Malformed> {
        if !self.matches(&other) {
            return Err(Malformed::new("is of another render"));
        }
        if self.samples.to_bits() != other.samples.to_bits() {
            return Err(Malformed(format!(
                "has {} samples a pixel, the others {}",
                other.samples, self.samples
            )));
        }
        let theirs: Vec<usize> = (0..self.sums.len()).filter(|i| other.has(*i)).collect();
        self.shards.merge(&other.shards)?;
        let bins = self.spectra.as_ref().map_or(0, |s| s.0.count);
        for i in theirs {
            self.sums[i] = other.sums[i];
            if let (Some((_, mine)), Some((_, theirs))) = (&mut self.spectra, &other.spectra) {
                let part = i * bins..(i + 1) * bins;
                mine[part.clone()].copy_from_slice(&theirs[part]);
            }
        }
        Ok(())
    }
}

/// Most samples a pixel that are read of a file; beyond, a number of them would not be exact.
const MOST_SAMPLES: f64 = (1u64 << 52) as f64;

fn has(shards: &Shards, shift: [u32; 2], x: u32, y: u32) -> bool {
    shards.has_threshold(threshold(shift[1], x, y))
}

#[inline]
fn due(shards: &Shards, shift: [u32; 2], mean: f64, x: u32, y: u32) -> u64 {
    if has(shards, shift, x, y) {
        samples_at(mean, shift[0], x, y)
    } else {
        0
    }
}
