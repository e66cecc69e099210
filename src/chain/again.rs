//! A chain made again from its seed, to look into a step of it.

use super::{Chain, Setting, Sink, Splat, Turn, seed_group, start_chain};
use crate::accel::Accel;
use crate::film::{Crop, Filter, SplatBuffer};
use crate::path::{Ends, Fault, Path, Pool, Sampler, Tally, World};

/// Which chain of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Which {
    /// The run's seed.
    pub seed: u64,
    /// Generation.
    pub generation: u32,
    /// Group.
    pub group: u32,
    /// Number of the chain in its group.
    pub chain: u32,
}

/// A chain of a run, at its start. `None` if the group found no light or has no such chain.
pub fn chain_again<const N: usize, A: Accel>(
    set: &Setting<A>,
    which: Which,
    tally: &mut Tally,
) -> Option<Chain<N>> {
    let batch = seed_group::<N, A>(set, which.seed, which.generation, which.group, tally);
    let start = *batch.seeds.get(which.chain as usize)?;
    let mut sampler = Sampler::new(set.world.max_edges);
    start_chain(set, which, start, &mut sampler, tally)
}

/// What a step gave the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Given {
    /// XYZ of f/τ.
    pub xyz: [f32; 3],
    /// Raster point, pixels.
    pub raster: glam::Vec2,
    /// Expected number of steps.
    pub weight: f32,
    /// Why the film would not take it.
    pub fault: Option<Fault>,
}

/// A sink that keeps what the last step gave, and asks a film of its own whether it would take it.
pub struct Witness {
    film: SplatBuffer,
    /// What the last step gave.
    pub given: Vec<Given>,
}

impl Witness {
    /// Nothing yet.
    pub fn new<A: Accel>(world: &World<A>) -> Self {
        let filter = Filter::new(&world.scene.settings.filter);
        Self {
            film: SplatBuffer::new(Crop::from(world.scene.camera.crop), filter),
            given: Vec::new(),
        }
    }
}

impl<const N: usize> Sink<N> for Witness {
    fn splat(&mut self, path: &Path<N>, weight: f64) {
        let s = Splat::of(path, weight);
        let taken = self.film.splat(s.raster, s.xyz, s.weight);
        self.given.push(Given {
            xyz: s.xyz,
            raster: s.raster,
            weight: s.weight,
            fault: taken.err().map(Fault::from),
        });
    }
}

/// A step that is looked into: the current path, the proposal and the decision.
pub struct Seen<'a, const N: usize> {
    /// Number of the step.
    pub step: u64,
    /// The current path x.
    pub x: &'a Path<N>,
    /// The proposal y; of an earlier step where no path was made.
    pub y: &'a Path<N>,
    /// The vertices of both.
    pub pool: &'a Pool<N>,
    /// Which ends of x the proposal keeps.
    pub kept: Ends,
    /// What was decided.
    pub turn: &'a Turn,
    /// Counters of this step alone.
    pub tally: Tally,
}

/// Makes one step; `look` sees it before the chain moves, and what it gives stands in the witness afterwards. A film that fills
/// up is not told of earlier steps.
pub fn step_seen<const N: usize, A: Accel>(
    chain: &mut Chain<N>,
    set: &Setting<A>,
    witness: &mut Witness,
    look: impl FnOnce(&Seen<N>),
) {
    let before = chain.stats.tally;
    let step = chain.steps();
    let turn = chain.turn(set);
    look(&Seen {
        step,
        x: &chain.x,
        y: chain.proposal(),
        pool: chain.pool(),
        kept: chain.kept(),
        turn: &turn,
        tally: chain.stats.tally.since(&before),
    });
    witness.given.clear();
    chain.settle(set, &turn, witness);
}
