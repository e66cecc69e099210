//! Steps kept for another build: both paths by their vertices, and what this build makes of them in numbers. The other build
//! makes the paths again in its own numbers and compares.

use super::quantities::{KINDS, Kind, geometry_bounds, quantities};
use super::state_path::{Number, read_as, save};
use super::verify::rebuilt;
use super::{Direct, Seen, Setting};
use crate::accel::Accel;
use crate::film::{Malformed, Reader, Writer};
use crate::mutation::{Context, Strategy, ratio};
use crate::path::{Ends, Path, Pool, Tally};
use crate::real::{Convert, Real};
use crate::sampling::Rng;
use std::io;

/// Writes a step in which a path was made; nothing otherwise.
pub fn keep<const N: usize, A: Accel>(
    set: &Setting<A>,
    group: u32,
    seen: &Seen<N>,
    w: &mut Writer,
) -> io::Result<()> {
    let (Some(strategy), Some(ratio)) = (seen.turn.strategy, seen.turn.ratio) else {
        return Ok(());
    };
    w.u8(1)?;
    w.u32(group)?;
    w.u64(seen.step)?;
    w.u8(strategy as u8)?;
    w.u32(seen.kept.light as u32)?;
    w.u32(seen.kept.eye as u32)?;
    w.f64(ratio)?;
    for p in [seen.x, seen.y] {
        w.real(p.lanes.u)?;
        save(p, seen.pool, w)?;
        // A proposal's strategies may not be known yet.
        let again = rebuilt(set.world, p, seen.pool, &mut Tally::default());
        quantities(&again).try_for_each(|q| w.f64(q.1))?;
    }
    Ok(())
}

/// Where a value was found: group, step, and whether in the proposal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Found {
    /// Group of the chain, which is the first of it.
    pub group: u32,
    /// Step of the chain.
    pub step: u64,
    /// In the proposal y, not in the current path x.
    pub proposal: bool,
}

/// Kept steps compared.
#[derive(Clone, Debug, Default)]
pub struct Specimens {
    /// Steps.
    pub steps: u64,
    /// Deviations of each of [`KINDS`].
    pub deviations: [Vec<f64>; KINDS.len()],
    /// Values that are 0 in one build only; they are not among the deviations.
    pub lost: [u64; KINDS.len()],
    /// Where the largest deviation of each kind was found.
    pub worst: [Found; KINDS.len()],
    /// The largest of each kind.
    pub largest: [f64; KINDS.len()],
    /// Paths that carry no light in this build.
    pub dark: u64,
    /// Largest deviation of a geometry term, over its bound.
    pub over_bound: f64,
    /// Where that was found.
    pub over_bound_at: Found,
    /// Edges so short or grazing that f32 does not tell how large their geometry term is.
    pub unresolved: u64,
    /// Edges.
    pub edges: u64,
}

impl Specimens {
    /// Reads all steps, written with coordinates of so many bytes, and compares.
    ///
    /// # Errors
    /// What is not such a file, or not of this scene.
    pub fn read<const N: usize, A: Accel>(
        set: &Setting<A>,
        bytes: u8,
        r: &mut Reader,
    ) -> Result<Self, Malformed> {
        let number: Number = match bytes {
            4 => |r| Ok(r.f32()?.real()),
            8 => |r| Ok(r.f64()?.real()),
            _ => return Err(Malformed(format!("has coordinates of {bytes} bytes"))),
        };
        let mut all = Self::default();
        let max = set.world.max_edges;
        let lanes = set.world.lanes::<N>(0.0);
        let mut pool = Pool::new(2 * max + 2);
        let mut paths = [(); 2].map(|()| Path::new(max, lanes));
        while r.left() > 0 {
            pool.reset();
            all.read_step(set, number, &mut paths, &mut pool, r)?;
        }
        Ok(all)
    }

    fn read_step<const N: usize, A: Accel>(
        &mut self,
        set: &Setting<A>,
        number: Number,
        paths: &mut [Path<N>; 2],
        pool: &mut Pool<N>,
        r: &mut Reader,
    ) -> Result<(), Malformed> {
        if r.u8()? != 1 {
            return Err(Malformed::new("has something else where a step begins"));
        }
        let mut at = Found {
            group: r.u32()?,
            step: r.u64()?,
            proposal: false,
        };
        let strategy = r.u8()? as usize;
        let strategy = *Strategy::ALL
            .get(strategy)
            .ok_or_else(|| Malformed(format!("has a step by strategy {strategy}")))?;
        let [light, eye] = [r.u32()? as usize, r.u32()? as usize];
        let kept_ratio = r.f64()?;
        let mut lit = true;
        for (i, path) in paths.iter_mut().enumerate() {
            at.proposal = i == 1;
            let u = number(r)?;
            if !(0.0..1.0).contains(&u) {
                return Err(Malformed(format!("has a wavelength number {u}")));
            }
            path.lanes = set.world.lanes(u);
            let carries = read_as(set.world, path, pool, r, number)? && path.strategies();
            self.read_path(path, pool, at, carries, r)?;
            lit &= carries;
        }
        self.steps += 1;
        if !lit {
            return Ok(());
        }
        let (x, y) = (&paths[0], &paths[1]);
        let least = x.links.len().min(y.links.len());
        let kept = light.checked_add(eye).is_some_and(|n| n <= least);
        let from_light = matches!(strategy, Strategy::Caustic | Strategy::LensSubpath);
        let moved = light < least && (light > 0 || !from_light);
        if !kept || (!moved && strategy != Strategy::Bidirectional) {
            return Err(Malformed(format!(
                "has a step that keeps {light} and {eye} of {least} vertices"
            )));
        }
        let ctx = Context {
            world: set.world,
            rng: &mut Rng::new(0, 0, 0, 0),
            entries: None,
            tally: &mut Tally::default(),
            indirect_only: set.options.direct == Direct::Separate,
            weigh_deletions: set.options.weigh_deletions,
        };
        let found = ratio(strategy, x, y, pool, Ends { light, eye }, &ctx);
        self.note(Kind::Ratio, kept_ratio, found, at);
        Ok(())
    }

    /// Reads what the other build found of a path, and compares.
    fn read_path<const N: usize>(
        &mut self,
        path: &Path<N>,
        pool: &Pool<N>,
        at: Found,
        carries: bool,
        r: &mut Reader,
    ) -> Result<(), Malformed> {
        self.dark += u64::from(!carries);
        let mut bounds = geometry_bounds(path, pool);
        for (kind, found) in quantities(path) {
            let kept = r.f64()?;
            if !carries {
                continue;
            }
            self.note(kind, kept, found, at);
            if kind == Kind::Geometry {
                self.edges += 1;
                match bounds.next().flatten() {
                    None => self.unresolved += 1,
                    Some(bound) => {
                        let by = kind.deviation(kept, found) / bound;
                        if by > self.over_bound {
                            (self.over_bound, self.over_bound_at) = (by, at);
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn note(&mut self, kind: Kind, a: f64, b: f64, at: Found) {
        let i = kind as usize;
        let relative = !matches!(kind, Kind::Raster | Kind::Mis);
        if relative && (a == 0.0) != (b == 0.0) {
            self.lost[i] += 1;
            return;
        }
        let by = kind.deviation(a, b);
        self.deviations[i].push(by);
        if by > self.largest[i] {
            (self.largest[i], self.worst[i]) = (by, at);
        }
    }

    /// The deviation that a part `q` of those of a kind stays below; 0 of none.
    pub fn quantile(&mut self, kind: Kind, q: f64) -> f64 {
        let all = &mut self.deviations[kind as usize];
        if all.is_empty() {
            return 0.0;
        }
        let i = ((all.len() - 1) as f64 * q).round() as usize;
        *all.select_nth_unstable_by(i, f64::total_cmp).1
    }
}

/// Bytes of a coordinate as this build writes it.
pub const WIDTH: u8 = size_of::<Real>() as u8;
