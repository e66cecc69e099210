//! Bidirectional sampling: a light and an eye sub-path, and every path x_{s,t} that joins them (Veach chapter 10).

use super::{Emitters, LightPoint, Palette, Path, Pool, Start, Tally, Vertex, World, walk::Walk};
use crate::accel::Accel;
use crate::real::Vec2;
use crate::sampling::Rng;
use crate::scatter::{Mode, Transport};
use crate::scene::spectrum::Lanes;

/// How strategies are weighted against each other (Veach 9.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heuristic {
    /// w_s ∝ p_s.
    Balance,
    /// w_s ∝ p_s².
    Power,
}

/// A joined path and what it is worth.
#[derive(Clone, Copy)]
pub struct Joined<'a, const N: usize> {
    /// The path, measured, its strategies known.
    pub path: &'a Path<N>,
    /// The pool of its vertices.
    pub pool: &'a Pool<N>,
    /// Number of light vertices.
    pub s: usize,
    /// Number of eye vertices.
    pub t: usize,
    /// τ of the weighted contribution C_{s,t}, the raster point having density 1/|raster domain|.
    pub weight: f64,
}

/// Draws pairs of sub-paths and joins them.
pub struct Sampler<const N: usize> {
    pool: Pool<N>,
    light_walk: Walk,
    eye_walk: Walk,
    light: Path<N>,
    eye: Path<N>,
    joined: Path<N>,
    palette: Palette<N>,
}

impl<const N: usize> Sampler<N> {
    /// Room for paths of at most `max_edges` edges.
    pub fn new(max_edges: usize) -> Self {
        let path = || Path::new(max_edges + 2, Lanes::new(0.0));
        Self {
            pool: Pool::new(3 * max_edges + 8),
            light_walk: Walk::new(max_edges + 2),
            eye_walk: Walk::new(max_edges + 2),
            light: path(),
            eye: path(),
            joined: path(),
            palette: Palette::new(Lanes::new(0.0)),
        }
    }

    /// Draws both sub-paths; the eye sub-path starts at raster point `raster`.
    pub fn sample<A: Accel>(
        &mut self,
        world: &World<A>,
        lanes: &Lanes<N>,
        raster: Vec2,
        rng: &mut Rng,
        tally: &mut Tally,
    ) {
        self.pool.reset();
        self.palette.tune(lanes);
        for p in [&mut self.light, &mut self.eye, &mut self.joined] {
            p.clear();
            p.lanes = *lanes;
        }
        let lens: Vertex<N> = world.lens.sample_vertex(rng.next_vec2());
        self.eye_walk.start(self.pool.put(lens));
        let start = Start::at(lens.p);
        let ray = (start, world.lens.direction(lens.p, raster));
        let max = world.max_edges;
        self.eye_walk.follow(
            world,
            &mut self.pool,
            &self.palette,
            Transport::FromEye,
            ray,
            max + 1,
            rng,
            tally,
        );
        self.light_walk.clear();
        if let Some(x0) =
            world
                .emitters
                .sample_point(world.scene, &self.palette, LightPoint::new(rng))
        {
            let ray = world.emitters.sample_direction(world.scene, &x0, rng);
            let ray = (world.leave(&x0, ray.0, ray.1), ray.1);
            self.light_walk.start(self.pool.put(x0));
            self.light_walk.follow(
                world,
                &mut self.pool,
                &self.palette,
                Transport::FromLight,
                ray,
                max,
                rng,
                tally,
            );
        }
        self.link_walks(world);
    }

    /// Computes what of the links does not depend on how the walks will be joined. A stand-in at the far end of each
    /// makes its last vertex an inner one.
    fn link_walks<A: Accel>(&mut self, world: &World<A>) {
        let stand_in = self.eye_walk.vertices[0];
        for &(slot, mode) in self.light_walk.vertices.iter().chain([&stand_in]) {
            self.light.push(slot, mode);
        }
        let n = self.light_walk.len();
        if n >= 2 {
            self.light
                .relink_parts(world, &self.pool, 0..n - 1, 0..n - 1);
        }
        for &(slot, mode) in [&stand_in]
            .into_iter()
            .chain(self.eye_walk.vertices.iter().rev())
        {
            self.eye.push(slot, mode);
        }
        let n = self.eye_walk.len();
        if n >= 2 {
            self.eye.relink_parts(world, &self.pool, 1..n, 2..n + 1);
        }
    }

    /// Calls `f` for every path x_{s,t} with a contribution, t = 0 included where light passed the lens. With `indirect_only`, paths of the direct-lighting pass are
    /// left out.
    pub fn join<A: Accel>(
        &mut self,
        world: &World<A>,
        heuristic: Heuristic,
        indirect_only: bool,
        tally: &mut Tally,
        mut f: impl FnMut(Joined<N>, &mut Tally),
    ) {
        for t in 1..=self.eye_walk.len() {
            for s in 0..=self.light_walk.len() {
                if s + t < 2 || s + t > world.max_edges + 1 {
                    continue;
                }
                if let Some(weight) = self.join_one(world, s, t, heuristic, indirect_only, tally) {
                    f(self.made(s, t, weight), tally);
                }
            }
        }
        for i in 0..self.light_walk.crossings.len() {
            let s = self.light_walk.crossings[i].before + 1;
            if let Some(weight) = self.join_one(world, s, 0, heuristic, indirect_only, tally) {
                f(self.made(s, 0, weight), tally);
            }
        }
    }

    fn made(&self, s: usize, t: usize, weight: f64) -> Joined<'_, N> {
        Joined {
            path: &self.joined,
            pool: &self.pool,
            s,
            t,
            weight,
        }
    }

    /// Joins `s` light and `t` eye vertices; the result stands in the joined path. `None` if it carries nothing.
    pub fn join_one<A: Accel>(
        &mut self,
        world: &World<A>,
        s: usize,
        t: usize,
        heuristic: Heuristic,
        indirect_only: bool,
        tally: &mut Tally,
    ) -> Option<f64> {
        if t == 0 {
            return self.end_on_lens(world, s, heuristic, indirect_only, tally);
        }
        let (pool, y) = (&self.pool, &mut self.joined);
        let first_eye = self.eye.links.len() - t;
        // Cheap reasons first: the ends must be able to emit or to scatter diffusely.
        if s == 0 {
            if !Emitters::can_be_hit(pool.get(self.eye.links[first_eye].slot)) {
                return None;
            }
        } else {
            let (z, e) = (
                pool.get(self.light.links[s - 1].slot),
                pool.get(self.eye.links[first_eye].slot),
            );
            if (s > 1 && !z.bsdf.has_non_specular()) || (t > 1 && !e.bsdf.has_non_specular()) {
                return None;
            }
        }
        y.clear();
        y.links.extend_from_slice(&self.light.links[..s]);
        y.links.extend_from_slice(&self.eye.links[first_eye..]);
        y.raster = self.eye.raster;
        if s == 0 {
            y.links[0].mode = Mode::NonSpecular;
            y.relink(world, pool, 0, 1);
        } else {
            y.links[s - 1].mode = Mode::NonSpecular;
            y.links[s].mode = Mode::NonSpecular;
            y.relink(world, pool, s - 1, s);
        }
        if (indirect_only && y.is_direct())
            || (t == 1 && !world.lens.contains(y.raster))
            || !y.measure(world, pool, tally)
        {
            return None;
        }
        if s > 0 && !y.edge_visible(world, pool, s - 1, tally) {
            return None;
        }
        let survival = if s > 0 {
            self.light_walk.survival[s - 1]
        } else {
            1.0
        } * self.eye_walk.survival[t - 1];
        self.weigh(s, survival, heuristic, tally)
    }

    /// The path whose `s` vertices are all from the light, the last one on the lens.
    fn end_on_lens<A: Accel>(
        &mut self,
        world: &World<A>,
        s: usize,
        heuristic: Heuristic,
        indirect_only: bool,
        tally: &mut Tally,
    ) -> Option<f64> {
        let crossings = &self.light_walk.crossings;
        let crossing = *crossings.iter().find(|c| c.before + 1 == s)?;
        let (pool, y) = (&self.pool, &mut self.joined);
        y.clear();
        y.links.extend_from_slice(&self.light.links[..s - 1]);
        y.push(crossing.slot, Mode::NonSpecular);
        y.relink(world, pool, s - 2, s - 1);
        if (indirect_only && y.is_direct())
            || !world.lens.contains(y.raster)
            || !y.measure(world, pool, tally)
        {
            return None;
        }
        self.weigh(s, crossing.survival, heuristic, tally)
    }

    /// τ of the weighted contribution of the joined path, made by strategy `s` with probability `survival` of its walks.
    fn weigh(
        &mut self,
        s: usize,
        survival: f64,
        heuristic: Heuristic,
        tally: &mut Tally,
    ) -> Option<f64> {
        let y = &mut self.joined;
        if !y.strategies() || y.rho[s] <= 0.0 {
            tally.fault(super::Fault::ZeroDensity);
            return None;
        }
        let w = match heuristic {
            Heuristic::Balance => y.total / y.rho_sum(),
            Heuristic::Power => {
                let rho = &y.rho[..y.k() + 2];
                let top = rho.iter().fold(0.0f64, |a, &b| a.max(b));
                let squares: f64 = rho.iter().map(|r| (r / top).powi(2)).sum();
                y.total * (y.rho[s] / top) / (top * squares)
            }
        };
        let w = w / survival;
        (tally.check(w) && w > 0.0).then_some(w)
    }

    /// The path that [`Self::join_one`] last made.
    pub fn joined(&self) -> (&Path<N>, &Pool<N>) {
        (&self.joined, &self.pool)
    }
}
