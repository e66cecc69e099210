//! A run between two rounds as bytes, and back: the sums, and each chain by what makes it again to the last bit.
//!
//! A vertex is kept as its primitive and its place on it, a chain as its vertices, its wavelength and its counts of steps
//! and entries; random streams are functions of those. Everything else (lobes, densities, the spectrum of the path) is
//! computed again, and the path's raster point and target must come out as they were.

use super::markov::Chain;
use super::schedule::{Generation, Member, Mlt, idle_chain};
use super::{MltOptions, Shape, Sums, TestImage, state_path};
use crate::accel::Accel;
use crate::film::{Crop, Malformed, Reader, Shards, Writer};
use crate::path::World;
use crate::real::{Real, Vec2};
use std::io;

/// A run that is not running.
pub struct Saved {
    /// What it has added up.
    pub sums: Sums,
    generation: Option<Idle>,
}

/// A generation's chains as bytes.
struct Idle {
    index: u32,
    rounds: u64,
    targets: Vec<f64>,
    /// Group, number in it, state.
    chains: Vec<(u32, u32, Vec<u8>)>,
}

impl Saved {
    /// What [`Mlt::save`] or [`Self::save`] wrote.
    pub fn read(r: &mut Reader) -> Result<Self, Malformed> {
        let sums = Sums::read(r)?;
        if r.u8()? == 0 {
            let generation = None;
            return Ok(Self { sums, generation });
        }
        let (index, rounds) = (r.u32()?, r.u64()?);
        if (index as usize).checked_add(1) != Some(sums.b.len()) || rounds > sums.rounds {
            return Err(Malformed(format!(
                "is in round {rounds} of generation {index} after {} rounds and {} generations",
                sums.rounds,
                sums.b.len()
            )));
        }
        let targets = r.floats(sums.shape.groups as usize)?;
        let n = r.count(12)?;
        let mut chains: Vec<(u32, u32, Vec<u8>)> = Vec::with_capacity(n);
        for _ in 0..n {
            let (group, number) = (r.u32()?, r.u32()?);
            let bytes = r.count(1)?;
            let rises = chains.last().is_none_or(|c| (c.0, c.1) < (group, number));
            let known = group < sums.shape.groups && number < sums.shape.chains;
            if !rises || !known || !sums.has(group, number) {
                return Err(Malformed(format!("has chain {number} of group {group}")));
            }
            chains.push((group, number, r.bytes(bytes)?.to_vec()));
        }
        let generation = Some(Idle {
            index,
            rounds,
            targets,
            chains,
        });
        Ok(Self { sums, generation })
    }

    /// Writes it as [`Mlt::save`] does.
    pub fn save(&mut self, w: &mut Writer) -> io::Result<()> {
        let stats = self.sums.stats;
        self.sums.save(w, stats)?;
        let Some(g) = &self.generation else {
            return w.u8(0);
        };
        w.u8(1)?;
        head(w, g.index, g.rounds, &g.targets, g.chains.len())?;
        for (group, number, state) in &g.chains {
            chain(w, *group, *number, state)?;
        }
        Ok(())
    }

    /// Counters of all chains.
    pub fn stats(&self) -> super::ChainStats {
        self.sums.stats
    }

    /// Takes in another part of the same run.
    ///
    /// # Errors
    /// A part of another run, or one that is here already.
    pub fn merge(&mut self, other: Self) -> Result<(), Malformed> {
        match (&mut self.generation, other.generation) {
            (None, None) => {}
            (Some(a), Some(b)) if (a.index, a.rounds) == (b.index, b.rounds) => {
                for (mine, theirs) in a.targets.iter_mut().zip(&b.targets) {
                    if mine.is_nan() {
                        *mine = *theirs;
                    }
                }
                a.chains.extend(b.chains);
                a.chains.sort_by_key(|c| (c.0, c.1));
            }
            _ => return Err(Malformed::new("stands in another round")),
        }
        self.sums.merge(other.sums)
    }
}

fn head(w: &mut Writer, index: u32, rounds: u64, targets: &[f64], chains: usize) -> io::Result<()> {
    w.u32(index)?;
    w.u64(rounds)?;
    w.floats(targets)?;
    w.u32(chains as u32)
}

fn chain(w: &mut Writer, group: u32, number: u32, state: &[u8]) -> io::Result<()> {
    w.u32(group)?;
    w.u32(number)?;
    w.u32(state.len() as u32)?;
    w.bytes(state)
}

impl<'a, A: Accel, const N: usize> Mlt<'a, A, N> {
    /// Writes the run as it stands between two rounds.
    pub fn save(&mut self, w: &mut Writer) -> io::Result<()> {
        let stats = self.stats();
        self.sums().save(w, stats)?;
        let Some(g) = &self.generation else {
            return w.u8(0);
        };
        w.u8(1)?;
        head(w, g.index, g.rounds, &g.targets, g.chains.len())?;
        let mut state = Vec::new();
        for m in &g.chains {
            state.clear();
            m.chain.save(&mut Writer::new(&mut state))?;
            chain(w, m.group, m.number, &state)?;
        }
        Ok(())
    }

    /// The run that was saved, with the same settings, seed and test image.
    ///
    /// # Errors
    /// A state that does not belong to them.
    pub fn resume(
        world: &'a World<'a, A>,
        options: MltOptions,
        seed: u64,
        test_image: Option<TestImage>,
        saved: Saved,
    ) -> Result<Self, Malformed> {
        let shape = Shape::new(Crop::from(world.scene.camera.crop), &options);
        if saved.sums.shape != shape {
            return Err(Malformed::new("is of another image or other settings"));
        }
        let mut run = Self::new(world, options, seed).with_test_image(test_image);
        if let Some(g) = saved.generation {
            let each = options.rounds_per_generation as u64;
            if g.rounds > each || saved.sums.rounds != g.index as u64 * each + g.rounds {
                return Err(Malformed(format!(
                    "is in round {} of generation {} after {} rounds",
                    g.rounds, g.index, saved.sums.rounds
                )));
            }
            let member = |(group, number, state): &(u32, u32, Vec<u8>)| {
                let mut chain = idle_chain(world, &options, seed, (g.index, *group, *number));
                let step = g.rounds * options.round as u64;
                chain.restore(world, step, &mut Reader::new(state))?;
                let b = g.targets[*group as usize];
                if !(b > 0.0 && b.is_finite()) {
                    return Err(Malformed(format!("has chains of a group whose b is {b}")));
                }
                Ok(Member {
                    chain,
                    group: *group,
                    number: *number,
                    b,
                })
            };
            let chains = g.chains.iter().map(member).collect::<Result<_, _>>()?;
            run.generation = Some(Generation {
                index: g.index,
                targets: g.targets,
                chains,
                rounds: g.rounds,
            });
        } else if saved.sums.rounds > 0 {
            return Err(Malformed::new("has rounds but no chains"));
        }
        run.sums = saved.sums;
        Ok(run)
    }

    /// Which parts of the work it does.
    pub fn shards(&self) -> &Shards {
        &self.sums.shards
    }
}

impl<const N: usize> Chain<N> {
    /// Writes the chain as it stands after [`Self::flush`].
    fn save(&self, w: &mut Writer) -> io::Result<()> {
        debug_assert_eq!(self.pending, 0.0, "a round is over");
        w.u64(self.stay)?;
        self.runs.iter().try_for_each(|run| w.u64(*run))?;
        w.u64(self.entries.as_ref().map_or(0, |e| e.dealt))?;
        w.real(self.x.lanes.u)?;
        w.real(self.x.raster.x)?;
        w.real(self.x.raster.y)?;
        w.f64(self.x.shape_tau)?;
        state_path::save(&self.x, self.pool(), w)
    }

    /// Stands where [`Self::save`] left it, before step number `step`.
    fn restore<A: Accel>(
        &mut self,
        world: &World<A>,
        step: u64,
        r: &mut Reader,
    ) -> Result<(), Malformed> {
        self.stay = r.u64()?;
        for run in &mut self.runs {
            *run = r.u64()?.min(u64::MAX / 2);
        }
        let dealt = r.u64()?;
        // No chain deals more than one entry a step; larger numbers would wrap.
        if dealt > step || self.stay > u64::MAX / 2 {
            return Err(Malformed(format!(
                "has {dealt} entries dealt in {step} steps"
            )));
        }
        if let Some(e) = &mut self.entries {
            e.dealt = dealt;
        }
        self.step = step;
        let u = r.real()?;
        if !(0.0..1.0).contains(&u) {
            return Err(Malformed(format!("has a wavelength number {u}")));
        }
        let raster = Vec2::new(r.real()?, r.real()?);
        let tau = r.f64()?;
        self.ws.pool.reset();
        self.x.lanes = world.lanes(u);
        state_path::read(world, &mut self.x, &mut self.ws.pool, r)?;
        let bits = |v: Vec2| v.to_array().map(Real::to_bits);
        let same =
            bits(self.x.raster) == bits(raster) && self.x.shape_tau.to_bits() == tau.to_bits();
        if !same || r.left() > 0 {
            return Err(Malformed::new(
                "holds a path that does not come out the same here: made on another type of machine?",
            ));
        }
        (self.pending, self.suited) = (0.0, None);
        Ok(())
    }
}
