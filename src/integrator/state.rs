//! A run of any integrator as bytes, and what can be done with one without its scene: add parts up, make the image.

use super::{CameraSums, LightSums, Outcome, mlt, sampled};
use crate::chain::{Saved, read_tally, save_tally};
use crate::film::{Bins, Crop, Malformed, Reader, Shards, Writer};
use crate::path::Tally;
use std::io;

/// A run that is not running.
pub struct State {
    /// Rays and faults so far, those of chains apart.
    pub tally: Tally,
    /// Wall time spent on it, seconds.
    pub seconds: f64,
    pub(super) sums: Kind,
}

/// The sums of each kind of run.
pub(super) enum Kind {
    /// Camera samples; with light-tracing splats for bidirectional path tracing.
    Sampled(CameraSums, Option<LightSums>),
    /// Chains, the direct pass, and the area of the raster domain in px².
    Chains(Box<Saved>, CameraSums, f64),
}

const SAMPLED: u8 = 0;
const WITH_LIGHT: u8 = 1;
const CHAINS: u8 = 2;

/// Writes what all runs have.
fn save_head(w: &mut Writer, kind: u8, tally: &Tally, seconds: f64) -> io::Result<()> {
    w.u8(kind)?;
    save_tally(w, tally)?;
    w.f64(seconds)
}

/// Writes a sampling run.
pub(super) fn save_sampled(
    w: &mut Writer,
    (tally, seconds): (&Tally, f64),
    camera: &CameraSums,
    light: Option<&LightSums>,
) -> io::Result<()> {
    let kind = if light.is_some() { WITH_LIGHT } else { SAMPLED };
    save_head(w, kind, tally, seconds)?;
    camera.save(w)?;
    light.map_or(Ok(()), |l| l.save(w))
}

/// Writes a run of chains, which `chains` writes itself.
pub(super) fn save_chains(
    w: &mut Writer,
    (tally, seconds): (&Tally, f64),
    chains: impl FnOnce(&mut Writer) -> io::Result<()>,
    direct: &CameraSums,
    raster_area: f64,
) -> io::Result<()> {
    save_head(w, CHAINS, tally, seconds)?;
    w.f64(raster_area)?;
    chains(w)?;
    direct.save(w)
}

impl State {
    /// What [`Standing::save`](super::Standing::save) or [`Self::save`] wrote, and nothing else.
    pub fn read(r: &mut Reader) -> Result<Self, Malformed> {
        let kind = r.u8()?;
        let (tally, seconds) = (read_tally(r)?, r.f64()?);
        if !(0.0..1e12).contains(&seconds) {
            return Err(Malformed(format!("claims {seconds} s of work")));
        }
        let sums = match kind {
            SAMPLED => Kind::Sampled(CameraSums::read(r)?, None),
            WITH_LIGHT => {
                let camera = CameraSums::read(r)?;
                let light = LightSums::read(r, &camera)?;
                Kind::Sampled(camera, Some(light))
            }
            CHAINS => {
                let area = r.f64()?;
                let chains = Box::new(Saved::read(r)?);
                let direct = CameraSums::read(r)?;
                if direct.crop != chains.sums.crop()
                    || direct.spectra.as_ref().map(|s| s.0) != chains.sums.bins()
                    || direct.shards != chains.sums.shards
                {
                    return Err(Malformed::new("holds two images that do not go together"));
                }
                Kind::Chains(chains, direct, area)
            }
            kind => return Err(Malformed(format!("holds a run of kind {kind}"))),
        };
        if r.left() > 0 {
            return Err(Malformed(format!("goes on {} bytes too long", r.left())));
        }
        Ok(Self {
            tally,
            seconds,
            sums,
        })
    }

    /// Writes it again.
    pub fn save(&mut self, w: &mut Writer) -> io::Result<()> {
        let head = (&self.tally, self.seconds);
        match &mut self.sums {
            Kind::Sampled(camera, light) => save_sampled(w, head, camera, light.as_ref()),
            Kind::Chains(chains, direct, area) => {
                save_chains(w, head, |w| chains.save(w), direct, *area)
            }
        }
    }

    /// Which parts of the work it holds.
    pub fn shards(&self) -> &Shards {
        &self.camera().shards
    }

    fn camera(&self) -> &CameraSums {
        match &self.sums {
            Kind::Sampled(camera, _) => camera,
            Kind::Chains(_, direct, _) => direct,
        }
    }

    /// Pixels of the image.
    pub fn crop(&self) -> Crop {
        self.camera().crop
    }

    /// Spectral bins.
    pub fn bins(&self) -> Option<Bins> {
        self.camera().spectra.as_ref().map(|s| s.0)
    }

    /// Rounds made: of chains, or of samples a pixel.
    pub fn rounds(&self) -> u64 {
        match &self.sums {
            Kind::Sampled(camera, _) => camera.samples as u64,
            Kind::Chains(chains, ..) => chains.sums.rounds,
        }
    }

    /// Takes in another part of the same run.
    ///
    /// # Errors
    /// A part of another run, or one that is here already. What is here is then of no more use.
    pub fn merge(&mut self, other: Self) -> Result<(), Malformed> {
        match (&mut self.sums, other.sums) {
            (Kind::Sampled(a, None), Kind::Sampled(b, None)) => a.merge(b)?,
            (Kind::Sampled(a, Some(light)), Kind::Sampled(b, Some(more))) => {
                a.merge(b)?;
                light.merge(&more);
            }
            (Kind::Chains(a, direct, _), Kind::Chains(b, more, _)) => {
                a.merge(*b)?;
                direct.merge(more)?;
            }
            _ => return Err(Malformed::new("is of another integrator")),
        }
        self.tally += other.tally;
        self.seconds = self.seconds.max(other.seconds);
        Ok(())
    }

    /// The image.
    pub fn outcome(&mut self) -> Outcome {
        match &mut self.sums {
            Kind::Sampled(camera, light) => {
                Outcome::Sampled(sampled(camera, light.as_ref(), false))
            }
            Kind::Chains(chains, direct, area) => {
                let stats = chains.stats();
                let r = mlt::result(&mut chains.sums, stats, direct, *area, false);
                Outcome::Mlt(Box::new(r))
            }
        }
    }

    /// Rays and faults of the whole run.
    pub fn whole_tally(&self) -> Tally {
        let mut all = self.tally;
        if let Kind::Chains(chains, ..) = &self.sums {
            all += chains.stats().tally;
            all += chains.sums.seeding;
        }
        all
    }
}
