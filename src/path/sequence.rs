//! A path as indices into a pool of vertices, with its links and the densities of all its bidirectional strategies.

use super::link::scatter_terms_at;
use super::{Emitters, Kind, Link, Pool, Tally, Vertex, World};
use crate::accel::Accel;
use crate::real::{Real, Vec2};
use crate::scatter::Mode;
use crate::scene::spectrum::{Lanes, Spectrum};
use std::ops::Range;

/// Which of the ends of a path were replaced: how many vertices are kept on either side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ends {
    /// Kept vertices x0 … x_l on the light side: l + 1.
    pub light: usize,
    /// Kept vertices x_m … xk on the eye side: k + 1 − m.
    pub eye: usize,
}

/// A path x0 … xk.
#[derive(Clone, Debug)]
pub struct Path<const N: usize> {
    /// Vertices x0 … xk, by their pool slots, with what belongs to them.
    pub links: Vec<Link<N>>,
    /// Wavelengths.
    pub lanes: Lanes<N>,
    /// Π f_s, scaled by 2^−shape_exp.
    pub shape: Spectrum<N>,
    /// Binary exponent of `shape`.
    pub shape_exp: i32,
    /// τ(shape).
    pub shape_tau: f64,
    /// Raster point.
    pub raster: Vec2,
    /// p_{s,k+1−s} up to a common factor, s = 0 … k+1; 0 where the strategy cannot make this path. This and the tables
    /// below have room for the longest path; what lies beyond this one's length is left over.
    pub rho: Vec<f64>,
    /// Prefix sums of `rho`: `sum[j] = Σ_{s<j} rho[s]`, j = 0 … k+2.
    pub sum: Vec<f64>,
    /// Prefix sums of `sum`.
    pub(super) area: Vec<f64>,
    /// τ of the unweighted contribution C*_{s,t} is `total / rho[s]`.
    pub total: f64,
    /// `deletion[d]`: Σ over all sub-paths of d edges of p_d1·p_d2 (Veach 11.4.2 and 11.5.4), index 0 unused.
    pub deletion: Vec<f64>,
    /// Sum of `deletion`.
    pub deletion_sum: f64,
    /// `rho`, `sum` and `total` are those of this path.
    pub known: bool,
}

impl<const N: usize> Path<N> {
    /// An empty path with room for `max_edges` edges.
    pub fn new(max_edges: usize, lanes: Lanes<N>) -> Self {
        Self {
            links: Vec::with_capacity(max_edges + 1),
            lanes,
            shape: Spectrum::ZERO,
            shape_exp: 0,
            shape_tau: 0.0,
            raster: Vec2::ZERO,
            rho: vec![0.0; max_edges + 2],
            sum: vec![0.0; max_edges + 3],
            area: vec![0.0; max_edges + 4],
            total: 0.0,
            deletion: vec![0.0; max_edges + 3],
            deletion_sum: 0.0,
            known: false,
        }
    }

    /// An empty path with the same wavelengths and room for `max_edges` edges.
    pub fn clone_capacity(&self, max_edges: usize) -> Self {
        Self::new(max_edges, self.lanes)
    }

    /// Becomes a copy of `o`, slots and all, without allocating.
    pub fn copy_from(&mut self, o: &Self) {
        self.links.clone_from(&o.links);
        let n = o.k() + 2;
        self.rho[..n].copy_from_slice(&o.rho[..n]);
        self.sum[..=n].copy_from_slice(&o.sum[..=n]);
        self.deletion[..=n].copy_from_slice(&o.deletion[..=n]);
        self.lanes = o.lanes;
        self.shape = o.shape;
        self.shape_exp = o.shape_exp;
        self.shape_tau = o.shape_tau;
        self.raster = o.raster;
        self.total = o.total;
        self.deletion_sum = o.deletion_sum;
        self.known = o.known;
    }

    /// Number of edges k.
    #[inline]
    pub fn k(&self) -> usize {
        self.links.len() - 1
    }

    /// Forgets all vertices.
    pub fn clear(&mut self) {
        self.links.clear();
        self.known = false;
    }

    /// Appends a vertex with its scattering mode.
    #[inline]
    pub fn push(&mut self, slot: u16, mode: Mode) {
        self.links.push(Link::at(slot, mode));
    }

    /// Becomes a copy of `x` with other vertices in place of everything between the kept ends: those found from the
    /// light side in path order, then those found from the eye side, last first. Links of the ends are copied, the modes
    /// of new vertices are given, [`Self::relink`] does the rest.
    #[inline]
    pub fn splice(
        &mut self,
        x: &Self,
        ends: Ends,
        from_light: &[(u16, Mode)],
        from_eye: &[(u16, Mode)],
    ) {
        self.known = false;
        self.lanes = x.lanes;
        self.raster = x.raster;
        let first = ends.light + from_light.len();
        let last = first + from_eye.len();
        // What stands in the links between the ends is left over from another path: relinking overwrites all of it.
        self.links.resize(last + ends.eye, Link::default());
        self.links[..ends.light].copy_from_slice(&x.links[..ends.light]);
        for (l, v) in self.links[ends.light..first].iter_mut().zip(from_light) {
            (l.slot, l.mode) = *v;
        }
        let new = from_eye.iter().rev();
        for (l, v) in self.links[first..last].iter_mut().zip(new) {
            (l.slot, l.mode) = *v;
        }
        self.links[last..].copy_from_slice(&x.links[x.links.len() - ends.eye..]);
    }

    /// Recomputes edges between vertices `a` … `b` and the scattering at each of them.
    #[inline]
    pub fn relink<A: Accel>(&mut self, world: &World<A>, pool: &Pool<N>, a: usize, b: usize) {
        let mut x = pool.get(self.links[a].slot);
        for i in a..b {
            let next = pool.get(self.links[i + 1].slot);
            self.links[i].span(x, next);
            self.scatter(world, pool, i, x);
            x = next;
        }
        self.scatter(world, pool, b, x);
    }

    /// Recomputes the edges i → i+1 for i in `edges` and the scattering at the vertices `inner`.
    #[inline]
    pub fn relink_parts<A: Accel>(
        &mut self,
        world: &World<A>,
        pool: &Pool<N>,
        edges: Range<usize>,
        inner: Range<usize>,
    ) {
        for i in edges {
            let (x, next) = (self.links[i].slot, self.links[i + 1].slot);
            self.links[i].span(pool.get(x), pool.get(next));
        }
        for i in inner {
            self.scatter(world, pool, i, pool.get(self.links[i].slot));
        }
    }

    #[inline(always)]
    fn scatter<A: Accel>(&mut self, world: &World<A>, pool: &Pool<N>, i: usize, x: &Vertex<N>) {
        let k = self.k();
        if i == 0 {
            self.leave_light(world, x);
        } else if i == k {
            self.reach_lens(world, x, pool.get(self.links[k - 1].slot));
        } else {
            let Some([before, here, after]) = self.links.get_mut(i - 1..i + 2) else {
                unreachable!("an inner vertex has neighbours");
            };
            let t = scatter_terms_at(
                x,
                here.mode,
                -before.dir,
                here.dir,
                -before.cos_far,
                here.cos_near,
            );
            here.fs = t.fs;
            here.prob_l = t.prob_l;
            here.prob_e = t.prob_e;
            // A light sub-path can end on the lens if that has an area.
            after.pl = if i + 1 < k || world.lens.has_aperture() {
                t.pdf_l * here.to_far()
            } else {
                0.0
            };
            before.pe = if i > 1 || Emitters::can_be_hit(pool.get(before.slot)) {
                t.pdf_e * before.to_near()
            } else {
                0.0
            };
        }
    }

    fn leave_light<A: Accel>(&mut self, world: &World<A>, x: &Vertex<N>) {
        let k = self.k();
        let link = &mut self.links[0];
        let pdf = world.emitters.pdf_direction(world.scene, x, link.dir);
        link.fs = world.emitters.radiance(world.scene, x, link.dir);
        link.pl = world.emitters.pdf_point(world.scene, x);
        (link.prob_l, link.prob_e) = (1.0, 1.0);
        let to_far = link.to_far();
        // See `World::reach_lens`.
        let ends = world.lens.has_aperture() && x.kind != Kind::Infinite;
        self.links[1].pl = if k > 1 || ends { pdf * to_far } else { 0.0 };
    }

    fn reach_lens<A: Accel>(&mut self, world: &World<A>, x: &Vertex<N>, before: &Vertex<N>) {
        let k = self.k();
        let e = &mut self.links[k - 1];
        let cos = e.cos_far.abs() as f64;
        e.pe = if k > 1 || Emitters::can_be_hit(before) {
            world.lens.raster_per_solid_angle(cos) / world.lens.raster_area * e.to_near()
        } else {
            0.0
        };
        self.raster = world.lens.raster(x.p, -e.dir).unwrap_or(Vec2::NEG_INFINITY);
        let lens = &mut self.links[k];
        lens.fs = Spectrum::splat(world.lens.importance(cos) as Real);
        lens.pe = world.lens.pdf_vertex();
        (lens.prob_l, lens.prob_e) = (1.0, 1.0);
    }

    /// Multiplies the spectra of all vertices. False if the path carries nothing in any lane; a product that is no
    /// number is counted.
    #[inline]
    pub fn measure<A: Accel>(
        &mut self,
        world: &World<A>,
        pool: &Pool<N>,
        tally: &mut Tally,
    ) -> bool {
        // A delta light is not seen itself: its image would be a point on the raster that no camera ray can find. Nor is
        // it through deltas, where only t = 0 would find it, as a disk of confusion without the sharp image in it.
        if (self.k() == 1 || world.lens.has_aperture()) && self.shows_delta_light(pool) {
            return false;
        }
        let mut s = Spectrum::ONE;
        let mut exp = 0;
        for (i, link) in self.links.iter().enumerate() {
            s *= link.fs;
            // Powers of two only, so that scaling rounds nothing.
            if i & 1 == 1 {
                let m = s.max();
                if m < 1e-12 {
                    if m <= 0.0 {
                        // `max` passes over lanes that are no number.
                        tally.check(s.mean() as f64);
                        return false;
                    }
                    s = s * (1u64 << 40) as Real;
                    exp -= 40;
                } else if m > 1e12 {
                    s = s * (1.0 / (1u64 << 40) as Real);
                    exp += 40;
                }
            }
        }
        if N > 1
            && world.dispersive
            && self
                .links
                .iter()
                .any(|l| pool.get(l.slot).bsdf.is_dispersive())
        {
            let hero = s[0] * N as Real;
            s = Spectrum::ZERO;
            s.0[0] = hero;
        }
        self.shape = s;
        self.shape_exp = exp;
        self.shape_tau = s.dot(self.lanes.target) as f64;
        self.known = false;
        self.shape_tau > 0.0 || {
            tally.check(self.shape_tau);
            false
        }
    }

    /// L S*E with a delta light.
    #[cold]
    fn shows_delta_light(&self, pool: &Pool<N>) -> bool {
        let inner = &self.links[1..self.k()];
        !Emitters::can_be_hit(pool.get(self.links[0].slot))
            && inner.iter().all(|l| l.mode != Mode::NonSpecular)
    }

    /// XYZ of f / τ(f): what a chain splats.
    #[inline]
    pub fn color(&self) -> [Real; 3] {
        let inv = 1.0 / self.shape_tau as Real;
        self.lanes.xyz.map(|w| self.shape.dot(w) * inv)
    }

    /// Two neighbours see each other, asked of the scene.
    #[inline]
    pub fn edge_visible<A: Accel>(
        &self,
        world: &World<A>,
        pool: &Pool<N>,
        i: usize,
        tally: &mut Tally,
    ) -> bool {
        world.visible(
            pool.get(self.links[i].slot),
            pool.get(self.links[i + 1].slot),
            tally,
        )
    }

    /// The path's light is computed by the direct-lighting pass: LS*E or LDS*E by modes.
    #[inline]
    pub fn is_direct(&self) -> bool {
        let k = self.k();
        self.links[1..k]
            .iter()
            .skip(1)
            .all(|l| l.mode != Mode::NonSpecular)
    }
}
