//! A step looked at from all sides: every quantity that path x and proposal y carry computed again from their vertices, the way
//! back, and every edge asked of the scene anew.

use super::{Seen, Setting};
use crate::accel::{Accel, surface};
use crate::mutation::{Context, ratio};
use crate::path::{Kind, Path, Pool, Tally, Vertex, World, follow};
use crate::real::{Convert, Real, Vec3};
use crate::sampling::Rng;
use serde::Serialize;
use std::ops::AddAssign;

/// Largest deviations of many steps, and what of them is beyond its bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Deviations {
    /// Steps looked at.
    pub steps: u64,
    /// Steps that made a proposal.
    pub proposals: u64,
    /// Links of paths computed again.
    pub links: u64,
    /// Links, spectra, densities and tables that were carried along and differ from what their vertices give. The same
    /// functions see the same vertices, so there is to be none.
    pub stale: u64,
    /// The largest relative difference among them.
    pub stale_by: f64,
    /// |r(x→y)·r(y→x) − 1|, the densities of both directions, over its bound of (6k + 32)·ε: each of four products over k
    /// vertices rounds 3k + 8 times by ε/2 or less. Largest found.
    pub way_back: f64,
    /// Edges of the paths that neither sight nor a ray passes, although the path carries light.
    pub blocked: u64,
    /// Edges followed from one end by a ray.
    pub followed: u64,
    /// Largest distance of the hit from the vertex at the other end, over what the roundings of point, direction and distance
    /// explain.
    pub missed_by: f64,
    /// Edges whose ray passed the vertex at the other end by more than that, or met it where sight is blocked: those that
    /// graze an edge of the geometry.
    pub missed: u64,
    /// Impossible values.
    pub impossible: u64,
}

impl Deviations {
    /// Nothing beyond its bound.
    pub fn fine(&self) -> bool {
        self.stale == 0 && self.way_back <= 1.0 && self.blocked == 0 && self.impossible == 0
    }
}

impl AddAssign for Deviations {
    fn add_assign(&mut self, o: Self) {
        self.steps += o.steps;
        self.proposals += o.proposals;
        self.links += o.links;
        self.stale += o.stale;
        self.stale_by = self.stale_by.max(o.stale_by);
        self.way_back = self.way_back.max(o.way_back);
        self.blocked += o.blocked;
        self.followed += o.followed;
        self.missed_by = self.missed_by.max(o.missed_by);
        self.missed += o.missed;
        self.impossible += o.impossible;
    }
}

/// Looks at a step.
pub fn verify<const N: usize, A: Accel>(set: &Setting<A>, seen: &Seen<N>, d: &mut Deviations) {
    d.steps += 1;
    d.impossible += seen.tally.impossible();
    let (Some(strategy), Some(r)) = (seen.turn.strategy, seen.turn.ratio) else {
        return;
    };
    d.proposals += 1;
    let world = set.world;
    let mut tally = Tally::default();
    let again = [seen.x, seen.y].map(|p| rebuilt(world, p, seen.pool, &mut tally));
    for (p, q) in [seen.x, seen.y].into_iter().zip(&again) {
        compare(p, q, d);
    }
    edges(world, seen.y, seen.pool, &mut tally, d);
    if r > 0.0 {
        let ctx = Context {
            world,
            rng: &mut Rng::new(0, 0, 0, 0),
            entries: None,
            tally: &mut tally,
            indirect_only: set.options.direct == super::Direct::Separate,
            weigh_deletions: set.options.weigh_deletions,
        };
        let back = ratio(strategy, &again[1], &again[0], seen.pool, seen.kept, &ctx);
        let k = seen.x.k().max(seen.y.k()) as f64;
        let bound = (6.0 * k + 32.0) * f64::EPSILON;
        let off = (back * r - 1.0).abs() / bound;
        d.way_back = d
            .way_back
            .max(if off.is_nan() { f64::INFINITY } else { off });
    }
    d.impossible += tally.impossible();
}

/// The path with everything computed from its vertices and modes alone.
pub(super) fn rebuilt<const N: usize, A: Accel>(
    world: &World<A>,
    x: &Path<N>,
    pool: &Pool<N>,
    tally: &mut Tally,
) -> Path<N> {
    let mut y = x.clone_capacity(world.max_edges);
    for link in &x.links {
        y.push(link.slot, link.mode);
    }
    y.relink(world, pool, 0, x.k());
    y.measure(world, pool, tally);
    y.strategies();
    y
}

/// Counts what differs between a path and itself made anew.
fn compare<const N: usize>(x: &Path<N>, y: &Path<N>, d: &mut Deviations) {
    let mut same = |a: f64, b: f64| {
        if a != b {
            d.stale += 1;
            let by = (a - b).abs() / a.abs().max(b.abs());
            d.stale_by = d.stale_by.max(if by.is_nan() { f64::INFINITY } else { by });
        }
    };
    for (i, (a, b)) in x.links.iter().zip(&y.links).enumerate() {
        a.fs.0
            .iter()
            .zip(b.fs.0)
            .for_each(|(a, b)| same(*a as f64, b as f64));
        same(a.pl, b.pl);
        same(a.pe, b.pe);
        same(a.prob_l as f64, b.prob_l as f64);
        same(a.prob_e as f64, b.prob_e as f64);
        if i < x.k() {
            same(a.g, b.g);
            same(a.inv_d2, b.inv_d2);
        }
    }
    d.links += x.links.len() as u64;
    same(x.shape_tau, y.shape_tau);
    same(x.shape_exp as f64, y.shape_exp as f64);
    same(x.raster.x as f64, y.raster.x as f64);
    same(x.raster.y as f64, y.raster.y as f64);
    if x.known {
        let n = x.k() + 2;
        let tables = x.rho[..n].iter().zip(&y.rho[..n]);
        let deletions = x.deletion[1..=n].iter().zip(&y.deletion[1..=n]);
        tables.chain(deletions).for_each(|(a, b)| same(*a, *b));
        same(x.total, y.total);
        same(x.deletion_sum, y.deletion_sum);
    }
}

/// Asks the scene of every edge: seen from both ends, and followed by a ray from the light side, or from the lens. A ray may
/// have found what sight, which keeps a larger distance from both ends, calls blocked: such an edge grazes the geometry.
fn edges<const N: usize, A: Accel>(
    world: &World<A>,
    x: &Path<N>,
    pool: &Pool<N>,
    tally: &mut Tally,
    d: &mut Deviations,
) {
    for i in 0..x.k() {
        let link = &x.links[i];
        let (a, b) = (pool.get(link.slot), pool.get(x.links[i + 1].slot));
        let hidden = !world.visible(a, b, tally) || !world.visible(b, a, tally);
        let there = || passed(world, (a, b), link.dir, link.cos_far, link.inv_d2);
        let back = || passed(world, (b, a), -link.dir, link.cos_near, link.inv_d2);
        // Rays meet surfaces only.
        let by = match (a.kind, b.kind) {
            (Kind::Infinite, _) => None,
            (_, Kind::Surface) => Some(there()),
            (Kind::Surface, _) => Some(back()),
            _ => None,
        };
        let Some(by) = by else {
            d.blocked += hidden as u64;
            continue;
        };
        d.followed += 1;
        if by <= 1.0 {
            d.missed_by = d.missed_by.max(by);
        }
        let both = a.kind == Kind::Surface && b.kind == Kind::Surface;
        if hidden && by > 1.0 && !(both && back() <= 1.0) {
            d.blocked += 1;
        } else if hidden || by > 1.0 {
            d.missed += 1;
        }
    }
}

/// By how much a ray from a in the direction of b passes b, over what roundings explain; ∞ if it meets nothing.
fn passed<const N: usize, A: Accel>(
    world: &World<A>,
    (a, b): (&Vertex<N>, &Vertex<N>),
    dir: Vec3,
    cos_far: Real,
    inv_d2: f64,
) -> f64 {
    let (ray, hit) = follow(world, world.leave(a, a.p, dir), dir);
    let Some(hit) = hit else {
        return f64::INFINITY;
    };
    let s = surface(&world.scene.geometry, &hit, &ray);
    // Both points and the offset are known to their bounds, a direction to 4 roundings; a plane met at a cosine moves the
    // hit by that over it.
    let length = inv_d2.sqrt().recip();
    let known = 2.0 * a.error as f64 + (b.error + s.error) as f64;
    let turned = 4.0 * f32::EPSILON as f64 * length;
    let off = (s.p - b.p).double().length() * cos_far.abs() as f64;
    off / (2.0 * (known + turned))
}
