//! Where a chain's contributions go: colours always, spectral bins when the run asks for them.

use crate::film::{Bins, Crop, Film, Filter, GroupFilm, Malformed, Reader};
use crate::film::{SpectralBuffer, SpectralFilm, SplatBuffer};
use crate::path::{Path, Tally};
use crate::real::{Convert, Real};
use glam::Vec2;

/// Receives what a chain gives the image.
pub trait Sink<const N: usize> {
    /// The chain spent `weight` steps, by expectation, at `path`.
    fn splat(&mut self, path: &Path<N>, weight: f64);
}

/// One contribution to the colour image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    /// Raster point.
    pub raster: Vec2,
    /// XYZ of f/τ(f).
    pub xyz: [f32; 3],
    /// Expected number of steps spent here.
    pub weight: f32,
    /// Edges of the path, so that a run can be judged by path length: an image's mean is b whatever the chain does.
    pub edges: u32,
}

impl Splat {
    /// What a path gives with a weight.
    #[inline]
    pub fn of<const N: usize>(path: &Path<N>, weight: f64) -> Self {
        Self {
            raster: path.raster.single(),
            xyz: path.color().single(),
            weight: weight as f32,
            edges: path.k() as u32,
        }
    }
}

impl<const N: usize, F: FnMut(Splat)> Sink<N> for F {
    #[inline]
    fn splat(&mut self, path: &Path<N>, weight: f64) {
        self(Splat::of(path, weight));
    }
}

/// The run's exact sums.
pub(super) struct Films {
    pub(super) colors: Film,
    pub(super) spectra: Option<SpectralFilm>,
}

impl Films {
    pub(super) fn new(crop: Crop, bins: Option<Bins>) -> Self {
        Self {
            colors: Film::new(crop),
            spectra: bins.map(|b| SpectralFilm::new(crop, b)),
        }
    }

    /// Those of a file.
    pub(super) fn read(r: &mut Reader, crop: Crop, bins: Option<Bins>) -> Result<Self, Malformed> {
        let colors = Film::read(r, crop)?;
        let spectra = bins.map(|b| SpectralFilm::read(r, crop, b)).transpose()?;
        Ok(Self { colors, spectra })
    }

    /// Adds other sums of the same image.
    pub(super) fn merge(&mut self, other: &Self) {
        self.colors.merge(&other.colors);
        if let (Some(a), Some(b)) = (&mut self.spectra, &other.spectra) {
            a.merge(b);
        }
    }

    /// Adds a thread's sums and clears them.
    pub(super) fn absorb(&mut self, buffers: &mut Buffers) {
        self.colors.absorb(&mut buffers.colors);
        if let (Some(film), Some(buffer)) = (&mut self.spectra, &mut buffers.spectra) {
            film.absorb(buffer);
        }
    }
}

/// A thread's sums.
pub(super) struct Buffers {
    colors: SplatBuffer,
    spectra: Option<SpectralBuffer>,
    /// The group whose chains fill them now.
    group: u32,
}

impl Buffers {
    pub(super) fn new(crop: Crop, filter: &Filter, bins: Option<Bins>) -> Self {
        Self {
            group: 0,
            colors: SplatBuffer::new(crop, filter.clone()),
            spectra: bins.map(|b| SpectralBuffer::new(crop, b, filter.clone())),
        }
    }

    /// Whether a chain of this group can go on filling them as they are.
    pub(super) fn serve(&self, group: u32) -> bool {
        self.group == group
    }

    /// From now on they are filled by a chain of `group`.
    pub(super) fn turn_to(&mut self, group: u32, groups: &GroupFilm) {
        if self.group != group {
            self.settle(groups);
            self.group = group;
        }
    }

    /// Tells the group what it has added; before the buffers are absorbed.
    pub(super) fn settle(&mut self, groups: &GroupFilm) {
        groups.settle(self.group as usize, &mut self.colors);
    }

    /// Absorb the buffers before the next round.
    pub(super) fn is_full(&self) -> bool {
        self.colors.is_full() || self.spectra.as_ref().is_some_and(SpectralBuffer::is_full)
    }
}

/// Splats that wait to be added together: their pixels are far apart in memory, and so the waits for them overlap.
const QUEUE: usize = 32;

/// Fills a thread's buffers from one chain.
pub(super) struct FilmSink {
    buffers: Buffers,
    /// Factor on every weight: the brightness of the chain's group.
    scale: f32,
    faults: Tally,
    queue: [(Vec2, [f32; 3], f32); QUEUE],
    queued: usize,
}

impl FilmSink {
    pub(super) fn new(buffers: Buffers, scale: f32) -> Self {
        Self {
            buffers,
            scale,
            faults: Tally::default(),
            queue: [(Vec2::ZERO, [0.0; 3], 0.0); QUEUE],
            queued: 0,
        }
    }

    /// The buffers with everything in them.
    pub(super) fn buffers(&mut self) -> &mut Buffers {
        self.add_queued();
        &mut self.buffers
    }

    /// The buffers, and the faults of what was not taken.
    pub(super) fn finish(mut self) -> (Buffers, Tally) {
        self.add_queued();
        (self.buffers, self.faults)
    }

    #[inline(never)]
    fn add_queued(&mut self) {
        let queue = &self.queue[..self.queued];
        let touch = |sum, s: &(Vec2, [f32; 3], f32)| sum ^ self.buffers.colors.touch(s.0);
        std::hint::black_box(queue.iter().fold(0, touch));
        for &(raster, xyz, weight) in queue {
            if let Err(f) = self.buffers.colors.splat(raster, xyz, weight) {
                self.faults.fault(f.into());
            }
        }
        self.queued = 0;
    }
}

impl<const N: usize> Sink<N> for FilmSink {
    #[inline]
    fn splat(&mut self, path: &Path<N>, weight: f64) {
        let s = Splat::of(path, weight);
        let weight = s.weight * self.scale;
        self.queue[self.queued % QUEUE] = (s.raster, s.xyz, weight);
        self.queued += 1;
        if self.queued == QUEUE {
            self.add_queued();
        }
        // A branch, not a second kind of sink: two copies of the step would no longer be inlined into one body each.
        if let Some(buffer) = &mut self.buffers.spectra {
            splat_spectrum(buffer, path, weight, &mut self.faults);
        }
    }
}

#[cold]
#[inline(never)]
fn splat_spectrum<const N: usize>(
    buffer: &mut SpectralBuffer,
    path: &Path<N>,
    weight: f32,
    faults: &mut Tally,
) {
    let values = path.shape * path.lanes.nm() * (1.0 / path.shape_tau as Real);
    let lanes = path
        .lanes
        .lambda
        .single()
        .into_iter()
        .zip(values.0.single());
    if let Err(f) = buffer.splat(path.raster.single(), lanes, weight) {
        faults.fault(f.into());
    }
}
