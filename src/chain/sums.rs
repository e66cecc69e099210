//! What the chains have added up so far: everything their image and its error need, and nothing that goes on.
//!
//! All of it is a sum of integers, a maximum, or the same for every part of the work, so the sums of parts that machines
//! shared out add up to the very sums of one machine.

use super::sink::Films;
use super::stats::{read_tally, save_tally};
use super::{ChainStats, MltOptions};
use crate::film::{Bins, Crop, GroupFilm, Malformed, Reader, Shards, Writer};
use crate::path::Tally;
use std::io;
use std::sync::Mutex;

/// What sums of chains have in common when they are of the same image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Pixels.
    pub crop: Crop,
    /// Independent groups.
    pub groups: u32,
    /// Chains of a group.
    pub chains: u32,
    /// Steps of a chain in a round.
    pub round: u32,
    /// Spectral bins.
    pub bins: Option<Bins>,
}

impl Shape {
    /// Of a run with these settings.
    pub fn new(crop: Crop, o: &MltOptions) -> Self {
        let (groups, chains, round) = (o.groups, o.chains, o.round);
        Self {
            crop,
            groups,
            chains,
            round,
            bins: o.bins,
        }
    }
}

/// Sums of some or all chains of a run.
pub struct Sums {
    pub(super) shape: Shape,
    pub(super) film: Mutex<Films>,
    pub(super) groups: GroupFilm,
    /// b_g of every group and generation so far; NaN where no chain of the group is among these.
    pub b: Vec<Vec<f64>>,
    /// Splats are divided by this power of two, near b of the first generation.
    pub(super) unit: f64,
    /// Rounds made in all generations.
    pub rounds: u64,
    /// Counters of chains; those of the current generation may still stand in the chains.
    pub(super) stats: ChainStats,
    /// Rays and faults of seeding.
    pub seeding: Tally,
    /// Which chains' sums these are.
    pub shards: Shards,
}

impl Sums {
    /// Of chains that have not begun.
    pub fn new(shape: Shape, shards: Shards) -> Self {
        Self {
            shape,
            film: Mutex::new(Films::new(shape.crop, shape.bins)),
            groups: GroupFilm::new(shape.crop, shape.groups as usize),
            b: Vec::new(),
            unit: 1.0,
            rounds: 0,
            stats: ChainStats::default(),
            seeding: Tally::default(),
            shards,
        }
    }

    /// Pixels of the image.
    pub fn crop(&self) -> Crop {
        self.shape.crop
    }

    /// Spectral bins.
    pub fn bins(&self) -> Option<Bins> {
        self.shape.bins
    }

    /// Chain number `chain` of a group is among these.
    pub fn has(&self, group: u32, chain: u32) -> bool {
        let Shape { groups, chains, .. } = self.shape;
        self.shards
            .has_block(group * chains + chain, groups * chains)
    }

    /// Chains of each group that are among these.
    pub fn counts(&self) -> Vec<u32> {
        let of = |g| (0..self.shape.chains).filter(|c| self.has(g, *c)).count() as u32;
        (0..self.shape.groups).map(of).collect()
    }

    /// b, the integral of τ over the chain's paths and the raster domain (px²), and its standard error over the groups.
    pub fn brightness(&self) -> (f64, f64) {
        let each: Vec<f64> = (0..self.shape.groups as usize)
            .filter_map(|g| {
                let known: Vec<f64> = self
                    .b
                    .iter()
                    .map(|b| b[g])
                    .filter(|b| !b.is_nan())
                    .collect();
                let n = known.len();
                (n > 0 || self.b.is_empty()).then(|| known.iter().sum::<f64>() / n.max(1) as f64)
            })
            .collect();
        let g = each.len().max(1) as f64;
        let mean = each.iter().sum::<f64>() / g;
        let var = each.iter().map(|b| (b - mean).powi(2)).sum::<f64>() / (g.max(2.0) - 1.0);
        (mean, (var / g).sqrt())
    }

    /// Mutations made, failed ones counted.
    pub fn mutations(&self) -> u64 {
        let chains: u32 = self.counts().iter().sum();
        self.rounds * chains as u64 * self.shape.round as u64
    }

    /// XYZ of each pixel of the crop.
    pub fn image(&mut self) -> Vec<[f64; 3]> {
        let scale = self.scale();
        self.films().colors.to_xyz(scale)
    }

    /// Radiance per nm, `[pixel · bins + bin]`, if there are bins.
    pub fn spectrum(&mut self) -> Option<Vec<f32>> {
        let scale = self.scale();
        let film = &self.films().spectra;
        film.as_ref().map(|f| f.to_values(scale))
    }

    /// Variance of each pixel's luminance, from the spread of the groups; the error of b is in it.
    pub fn variance(&mut self) -> Vec<f64> {
        if self.shards.is_whole() {
            let scale = self.scale() * self.shape.groups as f64;
            return self.groups.variance(scale);
        }
        let counts = self.counts();
        let scale = self.scale() * counts.iter().sum::<u32>() as f64;
        self.groups.variance_of_some(&counts, scale)
    }

    /// Degrees of freedom of [`Self::variance`].
    pub fn freedom(&self) -> u64 {
        let groups = self.counts().iter().filter(|c| **c > 0).count() as u64;
        groups.saturating_sub(1)
    }

    /// What a unit of the film is worth.
    fn scale(&self) -> f64 {
        match self.mutations() {
            0 => 0.0,
            n => self.unit / n as f64,
        }
    }

    pub(super) fn films(&mut self) -> &mut Films {
        self.film.get_mut().expect("no thread panicked")
    }

    /// Writes the sums, `stats` in place of their own counters.
    pub(super) fn save(&mut self, w: &mut Writer, stats: ChainStats) -> io::Result<()> {
        let s = self.shape;
        s.crop.save(w)?;
        let bins = s.bins.map_or(0, |b| b.count as u32);
        for v in [s.groups, s.chains, s.round, bins] {
            w.u32(v)?;
        }
        self.shards.save(w)?;
        w.u64(self.rounds)?;
        w.f64(self.unit)?;
        w.u32(self.b.len() as u32)?;
        self.b.iter().try_for_each(|b| w.floats(b))?;
        stats.save(w)?;
        save_tally(w, &self.seeding)?;
        let films = self.films();
        films.colors.save(w)?;
        if let Some(spectra) = &films.spectra {
            spectra.save(w)?;
        }
        self.groups.save(w)
    }

    /// What [`Self::save`] wrote.
    pub(super) fn read(r: &mut Reader) -> Result<Self, Malformed> {
        let crop = Crop::read(r)?;
        let [groups, chains, round, bins] = [r.u32()?, r.u32()?, r.u32()?, r.u32()?];
        let bins = (bins > 0).then(|| Bins::new(bins as usize));
        // A pixel takes a byte at least in each of these blocks.
        r.holds(crop.pixels(), 3 + bins.map_or(0, |b| b.count))?;
        r.holds(crop.pixels(), groups as usize)?;
        if groups
            .checked_mul(chains)
            .is_none_or(|n| n == 0 || n > MOST_CHAINS)
            || round == 0
        {
            return Err(Malformed::new(format!(
                "claims {groups} groups of {chains} chains and rounds of {round} steps"
            )));
        }
        let shape = Shape {
            crop,
            groups,
            chains,
            round,
            bins,
        };
        let shards = Shards::read(r)?;
        let (rounds, unit) = (r.u64()?, r.f64()?);
        let generations = r.count(8 * groups as usize)?;
        let each = rounds.checked_mul(groups as u64 * chains as u64);
        if each.and_then(|n| n.checked_mul(round as u64)).is_none() {
            return Err(Malformed::new(format!("claims {rounds} rounds")));
        }
        let b = (0..generations)
            .map(|_| r.floats(groups as usize))
            .collect::<Result<_, _>>()?;
        let stats = ChainStats::read(r)?;
        let seeding = read_tally(r)?;
        let films = Films::read(r, crop, bins)?;
        let groups = GroupFilm::read(r, crop, groups as usize)?;
        Ok(Self {
            shape,
            film: Mutex::new(films),
            groups,
            b,
            unit,
            rounds,
            stats,
            seeding,
            shards,
        })
    }

    /// Adds the sums of other chains of the same run.
    ///
    /// # Errors
    /// Sums of another run, or of chains that are here already.
    pub(super) fn merge(&mut self, mut other: Self) -> Result<(), Malformed> {
        let same = self.shape == other.shape
            && self.unit.to_bits() == other.unit.to_bits()
            && self.b.len() == other.b.len();
        if !same {
            return Err(Malformed::new("is of another render"));
        }
        if self.rounds != other.rounds {
            return Err(Malformed::new(format!(
                "has {} rounds, the others {}",
                other.rounds, self.rounds
            )));
        }
        for (a, b) in self.b.iter_mut().flatten().zip(other.b.iter().flatten()) {
            if a.is_nan() {
                *a = *b;
            } else if !b.is_nan() && a.to_bits() != b.to_bits() {
                return Err(Malformed::new(
                    "measured another brightness from the same samples: another machine type or library?",
                ));
            }
        }
        self.shards.merge(&other.shards)?;
        self.stats += other.stats;
        self.seeding += other.seeding;
        self.groups.merge(&other.groups);
        let theirs = std::mem::replace(other.films(), Films::new(Crop::from([0; 4]), None));
        self.films().merge(&theirs);
        Ok(())
    }
}

/// Most chains that are read of a file.
const MOST_CHAINS: u32 = 1 << 20;
