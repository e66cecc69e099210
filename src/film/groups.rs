//! Exact sums of luminance of each independent group of chains, for the error of every pixel.
//!
//! G groups estimate the image independently, each with its own seeding, so a pixel's variance is that between their
//! sums and holds the error of b. A thread's [`SplatBuffer`] serves one group at a time; at a change of group it hands
//! over what its Y has grown by. Integers, so it does not matter when that happens or which thread does it.

use super::{Crop, Malformed, Reader, SplatBuffer, Writer};
use std::io;
use std::sync::{Mutex, PoisonError};

/// Units of a sum: those of [`SplatBuffer`], 2⁻³².
const ONE: f64 = 4_294_967_296.0;

/// Y of every pixel and group.
#[derive(Debug)]
pub struct GroupFilm {
    crop: Crop,
    groups: Vec<Mutex<Sums>>,
}

/// One group's sums. 8 bytes a pixel hold them in all but the longest runs of the brightest pixels; then 16 do.
#[derive(Debug)]
enum Sums {
    Narrow(Vec<i64>),
    Wide(Vec<i128>),
}

impl Sums {
    fn add(&mut self, pixel: usize, grown: i64) {
        match self {
            Self::Narrow(v) => match v[pixel].checked_add(grown) {
                Some(sum) => v[pixel] = sum,
                None => {
                    *self = Self::Wide(v.iter().map(|&v| v as i128).collect());
                    self.add(pixel, grown);
                }
            },
            Self::Wide(v) => v[pixel] += grown as i128,
        }
    }

    fn get(&self, pixel: usize) -> i128 {
        match self {
            Self::Narrow(v) => v[pixel] as i128,
            Self::Wide(v) => v[pixel],
        }
    }

    fn all(&self) -> impl Iterator<Item = i128> + Clone {
        let (narrow, wide): (&[i64], &[i128]) = match self {
            Self::Narrow(v) => (v, &[]),
            Self::Wide(v) => (&[], v),
        };
        let narrow = narrow.iter().map(|&v| v as i128);
        narrow.chain(wide.iter().copied())
    }

    fn of(all: impl Iterator<Item = i128> + Clone) -> Self {
        let narrow: Result<Vec<i64>, _> = all.clone().map(i64::try_from).collect();
        narrow.map_or_else(|_| Self::Wide(all.collect()), Self::Narrow)
    }
}

impl GroupFilm {
    /// Black in every group.
    pub fn new(crop: Crop, groups: usize) -> Self {
        let black = || Mutex::new(Sums::Narrow(vec![0; crop.pixels()]));
        Self {
            crop,
            groups: (0..groups).map(|_| black()).collect(),
        }
    }

    /// Number of groups.
    pub fn groups(&self) -> usize {
        self.groups.len()
    }

    /// Adds what a buffer's Y has grown by since its last call here. Everything in it must be the group's; call it
    /// before the buffer goes to another group or into a film.
    pub fn settle(&self, group: usize, buffer: &mut SplatBuffer) {
        assert_eq!(
            self.crop,
            buffer.crop(),
            "buffer and film cover the same pixels"
        );
        let mut sums = self.groups[group]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        buffer.settle(|i, grown| sums.add(i, grown));
    }

    /// Writes the sums.
    pub fn save(&self, w: &mut Writer) -> io::Result<()> {
        for g in &self.groups {
            let sums = g.lock().unwrap_or_else(PoisonError::into_inner);
            w.integers(sums.all())?;
        }
        Ok(())
    }

    /// Sums that [`Self::save`] wrote.
    pub fn read(r: &mut Reader, crop: Crop, groups: usize) -> Result<Self, Malformed> {
        let group = |r: &mut Reader| -> Result<_, Malformed> {
            let all: Vec<i128> = r.integers(crop.pixels())?.collect();
            Ok(Mutex::new(Sums::of(all.into_iter())))
        };
        Ok(Self {
            crop,
            groups: (0..groups).map(|_| group(r)).collect::<Result<_, _>>()?,
        })
    }

    /// Adds the sums of other chains of the same groups.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!((self.crop, self.groups()), (other.crop, other.groups()));
        for (a, b) in self.groups.iter_mut().zip(&other.groups) {
            let a = a.get_mut().unwrap_or_else(PoisonError::into_inner);
            let b = b.lock().unwrap_or_else(PoisonError::into_inner);
            let both = a.all().zip(b.all());
            *a = Sums::of(both.map(|(a, b)| a.wrapping_add(b)));
        }
    }

    /// As [`Self::variance`], where group g has `counts[g]` of the chains that the image is the mean over, and a chain's
    /// estimate is its sum times `scale`. Groups of fewer chains count for less.
    pub fn variance_of_some(&mut self, counts: &[u32], scale: f64) -> Vec<f64> {
        let all = counts.iter().sum::<u32>() as f64;
        let present = counts.iter().filter(|c| **c > 0).count() as f64;
        if present < 2.0 {
            return vec![f64::INFINITY; self.crop.pixels()];
        }
        let sums = self.groups.iter_mut().zip(counts).filter(|(_, c)| **c > 0);
        let sums: Vec<(&Sums, f64)> = sums
            .map(|(s, c)| {
                let s = &*s.get_mut().unwrap_or_else(PoisonError::into_inner);
                (s, *c as f64)
            })
            .collect();
        let k = scale / ONE / all;
        (0..self.crop.pixels())
            .map(|i| {
                // Each group's part of the image, and its part of the mean.
                let parts = sums.iter().map(|(s, c)| (s.get(i) as f64 * k, c / all));
                let mean: f64 = parts.clone().map(|p| p.0).sum();
                let squares: f64 = parts.map(|(part, w)| (part - w * mean).powi(2)).sum();
                squares * present / (present - 1.0)
            })
            .collect()
    }

    /// Variance of the mean over the groups, of each pixel: Σ(S_g − S̄)²/(G − 1)/G with G − 1 degrees of freedom, where
    /// a group's estimate is its sum times `scale`. Infinite for a single group, which says nothing of its error.
    pub fn variance(&mut self, scale: f64) -> Vec<f64> {
        let g = self.groups.len();
        if g < 2 {
            return vec![f64::INFINITY; self.crop.pixels()];
        }
        let sums: Vec<&Sums> = self
            .groups
            .iter_mut()
            .map(|s| &*s.get_mut().unwrap_or_else(PoisonError::into_inner))
            .collect();
        // Deviations are formed as integers, G times too large: nothing cancels.
        let k = scale / ONE / g as f64;
        (0..self.crop.pixels())
            .map(|i| {
                let total = sums.iter().fold(0i128, |t, s| t.wrapping_add(s.get(i)));
                let squares: f64 = sums
                    .iter()
                    .map(|s| s.get(i).wrapping_mul(g as i128).wrapping_sub(total))
                    .map(|d| (d as f64 * k).powi(2))
                    .sum();
                squares / ((g - 1) * g) as f64
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Film, Filter};
    use super::*;
    use crate::scene::{FilterKind, FilterSettings};
    use glam::Vec2;

    fn buffer() -> SplatBuffer {
        let kind = FilterKind::Gaussian { sigma: 0.7 };
        let radius = [1.5; 2];
        SplatBuffer::new(
            Crop::from([0, 0, 5, 4]),
            Filter::new(&FilterSettings { kind, radius }),
        )
    }

    fn splat(b: &mut SplatBuffer, i: u32) {
        let p = Vec2::new((i % 43) as f32 * 0.11, (i % 31) as f32 * 0.12);
        b.splat(p, [0.0, 1.0 / (1.0 + i as f32), 0.5], 0.3).unwrap();
    }

    /// Splat i belongs to group i mod 3. However buffers change groups and films, the groups' sums stay the same and
    /// add up to the film's.
    #[test]
    fn changes_of_group_and_flushes_leave_no_trace() {
        let run = |buffers: usize, flush: u32| {
            let mut all: Vec<(SplatBuffer, usize)> = (0..buffers).map(|_| (buffer(), 0)).collect();
            let crop = all[0].0.crop();
            let (mut film, groups) = (Film::new(crop), GroupFilm::new(crop, 3));
            for i in 0..300 {
                let (b, of) = &mut all[i as usize % buffers];
                if *of != i as usize % 3 {
                    groups.settle(*of, b);
                    *of = i as usize % 3;
                }
                splat(b, i);
                if i % flush == 0 {
                    groups.settle(*of, b);
                    film.absorb(b);
                }
            }
            for (b, of) in &mut all {
                groups.settle(*of, b);
                film.absorb(b);
            }
            let sum = |i: usize| -> Vec<i128> {
                let group = |g: &Mutex<Sums>| g.lock().unwrap().get(i);
                groups.groups.iter().map(group).collect()
            };
            let sums: Vec<Vec<i128>> = (0..crop.pixels()).map(sum).collect();
            for (p, s) in film.raw().iter().zip(&sums) {
                assert_eq!(p[1], s.iter().sum::<i128>() << 32);
            }
            sums
        };
        let first = run(1, 1);
        assert!(first.iter().all(|s| s.iter().all(|&v| v > 0)));
        assert_eq!(run(2, 7), first);
        assert_eq!(run(5, 1000), first);
    }

    #[test]
    fn the_variance_is_that_of_the_mean() {
        let crop = Crop::from([0, 0, 2, 1]);
        let mut film = GroupFilm::new(crop, 4);
        for (g, y) in [1.0, 2.0, 3.0, 4.0].into_iter().enumerate() {
            film.groups[g].get_mut().unwrap().add(0, (y * ONE) as i64);
        }
        // Sample variance 5/3 over 4 groups, times a scale of 2 squared.
        let v = film.variance(2.0);
        assert!((v[0] - 5.0 / 3.0).abs() < 1e-15 && v[1] == 0.0, "{v:?}");
        assert_eq!(GroupFilm::new(crop, 1).variance(1.0)[0], f64::INFINITY);
        // Four groups of as many chains; then without the last one: sums 1, 2, 3 of three chains.
        let some = film.variance_of_some(&[1; 4], 2.0 * 4.0);
        assert!((some[0] - 5.0 / 3.0 * 16.0).abs() < 1e-13, "{some:?}");
        film.groups[3] = Mutex::new(Sums::Narrow(vec![0, 0]));
        let some = film.variance_of_some(&[1, 1, 1, 0], 1.0);
        assert!((some[0] - 1.0 / 3.0).abs() < 1e-15, "{some:?}");
    }

    #[test]
    fn sums_past_64_bits_are_kept() {
        let mut s = Sums::Narrow(vec![5, 0]);
        for _ in 0..3 {
            s.add(1, i64::MAX);
        }
        s.add(1, -7);
        assert_eq!((s.get(0), s.get(1)), (5, 3 * i64::MAX as i128 - 7));
    }
}
