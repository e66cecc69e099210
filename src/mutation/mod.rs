//! Mutation strategies, one a file. Each changes a path and knows the density of what it does.
//!
//! A strategy proposes y from x and returns `T(y→x)·τ(y) / (T(x→y)·τ(x))` without the probability of choosing the
//! strategy itself, which the chain knows.

mod bidirectional;
mod caustic;
mod dispersion;
mod falsify;
mod grow;
mod lens;
mod lens_subpath;
mod multi_chain;
#[cfg(test)]
mod tests;
mod turn;
mod wavelength;

pub use bidirectional::Bidirectional;
pub use caustic::CausticPerturbation;
pub use lens::LensPerturbation;
pub use lens_subpath::LensSubpath;
pub use multi_chain::MultiChainPerturbation;
pub use wavelength::Wavelength;

pub use crate::plan::Strategy;

use crate::accel::Accel;
use crate::path::{Ends, Palette, Path, Pool, Start, Tally, Vertex, World, trace_into};
use crate::real::Vec3;
use crate::sampling::{Entries, Rng};
use crate::scatter::{Mode, Transport};
use crate::scene::spectrum::Lanes;

impl Strategy {
    /// The strategy may be chosen at x (`dispersive`: the scene has such materials at all).
    #[inline]
    pub fn suits<const N: usize>(self, dispersive: bool, x: &Path<N>, pool: &Pool<N>) -> bool {
        match self {
            // Asking whether some strategy could make x costs as much as the mutation; where none can, it fails and is
            // a rejection.
            Self::Bidirectional => true,
            Self::Lens => LensPerturbation::suits(x, pool).is_some(),
            Self::Caustic => CausticPerturbation::suits(x).is_some(),
            Self::MultiChain => MultiChainPerturbation::suits(x, pool).is_some(),
            Self::LensSubpath => LensSubpath::suits(x).is_some(),
            Self::Wavelength => Wavelength::suits(dispersive, x, pool),
        }
    }

    /// Proposes y in `ws.y`; see the module.
    #[inline]
    pub fn propose<const N: usize, A: Accel>(
        self,
        x: &mut Path<N>,
        ws: &mut Workspace<N>,
        ctx: &mut Context<A>,
    ) -> Option<f64> {
        match self {
            Self::Bidirectional => Bidirectional::propose(x, ws, ctx),
            Self::Lens => LensPerturbation::propose(x, ws, ctx),
            Self::Caustic => CausticPerturbation::propose(x, ws, ctx),
            Self::MultiChain => MultiChainPerturbation::propose(x, ws, ctx),
            Self::LensSubpath => LensSubpath::propose(x, ws, ctx),
            Self::Wavelength => Wavelength::propose(x, ws, ctx),
        }
    }
}

/// What a strategy works on.
pub struct Workspace<const N: usize> {
    /// Vertices of both paths.
    pub pool: Pool<N>,
    /// Spectra at the wavelengths of x.
    pub palette: Palette<N>,
    /// The proposal.
    pub y: Path<N>,
    /// New vertices found from the light side, in path order, with their modes.
    pub from_light: Vec<(u16, Mode)>,
    /// New vertices found from the eye side, against path order, with their modes.
    pub from_eye: Vec<(u16, Mode)>,
    /// Which ends of x the proposal keeps.
    pub ends: Ends,
}

impl<const N: usize> Workspace<N> {
    /// Room for paths of at most `max_edges` edges.
    pub fn new(max_edges: usize) -> Self {
        Self {
            pool: Pool::new(3 * max_edges + 9),
            palette: Palette::new(Lanes::new(0.0)),
            y: Path::new(max_edges, Lanes::new(0.0)),
            from_light: Vec::with_capacity(max_edges + 3),
            from_eye: Vec::with_capacity(max_edges + 3),
            ends: Ends { light: 0, eye: 0 },
        }
    }

    /// Forgets the last proposal's scratch and makes ready for one from x.
    #[inline]
    pub fn begin(&mut self, x: &Path<N>) {
        self.forget();
        self.palette.tune(&x.lanes);
    }

    #[inline]
    fn forget(&mut self) {
        self.from_light.clear();
        self.from_eye.clear();
    }

    /// The vertices of the proposal found from one side.
    #[inline]
    fn found(&mut self, from: Transport) -> &mut Vec<(u16, Mode)> {
        match from {
            Transport::FromLight => &mut self.from_light,
            Transport::FromEye => &mut self.from_eye,
        }
    }

    /// Takes a slot for a vertex of the proposal.
    #[inline]
    pub fn put(&mut self, from: Transport, v: Vertex<N>, mode: Mode) -> u16 {
        let slot = self.pool.put(v);
        self.found(from).push((slot, mode));
        slot
    }

    /// A vertex of the proposal at the place of one of x.
    #[inline]
    pub fn again(&mut self, from: Transport, slot: u16) -> u16 {
        let v = *self.pool.get(slot);
        self.put(from, v, Mode::NonSpecular)
    }

    /// Follows the ray (start, unit direction) to a vertex of the proposal.
    #[inline]
    pub fn trace<A: Accel>(
        &mut self,
        world: &World<A>,
        from: Transport,
        ray: (Start, Vec3),
        mode: Mode,
        tally: &mut Tally,
    ) -> Option<u16> {
        let slot = self.pool.take();
        self.found(from).push((slot, mode));
        let v = self.pool.get_mut(slot);
        trace_into(world, ray, &self.palette, tally, v).then_some(slot)
    }

    /// Slots taken by this proposal.
    #[inline]
    pub fn fresh(&self) -> impl Iterator<Item = u16> {
        self.from_light.iter().chain(&self.from_eye).map(|v| v.0)
    }

    /// `y` becomes x with the new vertices between the kept ends.
    #[inline]
    pub fn splice(&mut self, x: &Path<N>) {
        self.y
            .splice(x, self.ends, &self.from_light, &self.from_eye);
    }

    /// The proposal is dropped.
    #[inline]
    pub fn reject(&mut self) {
        for v in self.from_light.drain(..).chain(self.from_eye.drain(..)) {
            self.pool.release(v.0);
        }
    }

    /// The proposal becomes the current path `x`.
    #[inline]
    pub fn accept(&mut self, x: &mut Path<N>) {
        let old = self.ends.light..x.links.len() - self.ends.eye;
        for l in &x.links[old] {
            self.pool.release(l.slot);
        }
        self.forget();
        std::mem::swap(x, &mut self.y);
    }
}

/// Everything a proposal may look at besides the path itself.
pub struct Context<'a, A: Accel> {
    /// The scene.
    pub world: &'a World<'a, A>,
    /// Random numbers of this step.
    pub rng: &'a mut Rng,
    /// Where lens sub-paths start; from `rng` if there are none.
    pub entries: Option<&'a mut Entries>,
    /// Counters.
    pub tally: &'a mut Tally,
    /// Paths of the direct-lighting pass are not the chain's.
    pub indirect_only: bool,
    /// p_d2 is importance-sampled (Veach 11.5.4); otherwise 1.
    pub weigh_deletions: bool,
}

impl<A: Accel> Context<'_, A> {
    /// What every proposal needs at last: it is the chain's, carries light, lies on the raster.
    #[inline]
    pub fn carries<const N: usize>(&mut self, y: &mut Path<N>, pool: &Pool<N>) -> bool {
        !(self.indirect_only && y.is_direct())
            && self.world.lens.contains(y.raster)
            && y.measure(self.world, pool, self.tally)
    }
}

/// What a strategy returns when it makes y from x, from the paths alone.
pub(crate) fn ratio<const N: usize, A: Accel>(
    s: Strategy,
    x: &Path<N>,
    y: &Path<N>,
    pool: &Pool<N>,
    ends: Ends,
    ctx: &Context<A>,
) -> f64 {
    match s {
        Strategy::Bidirectional => {
            Bidirectional::transition(y, x, ends, ctx) / Bidirectional::transition(x, y, ends, ctx)
        }
        Strategy::Lens => LensPerturbation::ratio(x, y, ends.light),
        Strategy::Caustic => {
            CausticPerturbation::ratio(ctx.world, x, y, pool, ends.light - 1).unwrap_or(0.0)
        }
        Strategy::MultiChain => MultiChainPerturbation::ratio(x, y, ends.light),
        Strategy::LensSubpath => LensSubpath::ratio(x, y, pool, ends.light),
        Strategy::Wavelength => {
            Wavelength::ratio(Wavelength::form(ctx.world.dispersive, x, pool), x, y)
        }
    }
}
