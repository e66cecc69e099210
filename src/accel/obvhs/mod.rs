//! A backend in safe Rust, to check Embree with: the hierarchy is built by the crate obvhs, the traversal is here,
//! because it has to keep a promise that none of the crate's own makes: no box is passed over whose primitive the
//! shared routine would hit.

mod binary;
mod build;
mod leaf;
mod node;
mod wide;

pub use build::{ObvhsOptions, Preset, Tree};

use super::{Accel, Ray, quadric};
use crate::scene::Geometry;
use binary::Binary;
use leaf::{Corners, Shear, Verdict};
use std::time::{Duration, Instant};
use wide::Wide;

/// A bounding-volume hierarchy over a geometry.
pub struct Obvhs<'a> {
    geometry: &'a Geometry,
    tree: Hierarchy,
    /// Corners of the primitives in the order of the leaves, which is the order they are read in.
    corners: Vec<Corners>,
    /// Their numbers.
    prims: Vec<u32>,
    /// Largest coordinate of anything.
    reach: f32,
    options: ObvhsOptions,
    build_time: Duration,
}

enum Hierarchy {
    Wide(Wide),
    Binary(Binary),
}

impl<'a> Obvhs<'a> {
    /// Builds over all primitives of `geometry` as is best for rendering.
    pub fn new(geometry: &'a Geometry) -> Self {
        Self::with_options(geometry, ObvhsOptions::default())
    }

    /// Builds in the rayon pool that it is called in; the tree is the same for any number of threads.
    pub fn with_options(geometry: &'a Geometry, options: ObvhsOptions) -> Self {
        super::surface::prepare(geometry);
        let start = Instant::now();
        let parts = build::Parts::new(geometry, options.splits);
        let reach = parts.reach;
        let (tree, order) = match options.tree {
            Tree::Wide => {
                let (tree, order) = Wide::build(&parts, options);
                (Hierarchy::Wide(tree), order)
            }
            Tree::Binary => {
                let (tree, order) = Binary::build(&parts, options);
                (Hierarchy::Binary(tree), order)
            }
        };
        let prims: Vec<u32> = order.iter().map(|&i| parts.prims[i as usize]).collect();
        let corners = |&prim: &u32| match geometry.quadric(prim) {
            None => Corners::new(geometry.corners(prim)),
            Some(_) => Corners::ASK,
        };
        Self {
            geometry,
            tree,
            corners: prims.iter().map(corners).collect(),
            prims,
            reach,
            options,
            build_time: start.elapsed(),
        }
    }

    /// Wall time of the build.
    pub fn build_time(&self) -> Duration {
        self.build_time
    }

    /// Number of leaf entries: primitives, or pieces of them.
    pub fn entries(&self) -> usize {
        self.prims.len()
    }

    /// Visits leaf entries, near ones first where `ORDERED`. `visit` gets the number of an entry and the far end so
    /// far, and returns the new far end, or `None` to stop.
    #[inline(always)]
    fn walk<const ORDERED: bool>(&self, ray: &Ray, visit: impl FnMut(usize, f32) -> Option<f32>) {
        match &self.tree {
            Hierarchy::Wide(tree) => tree.walk::<ORDERED>(ray, self.reach, visit),
            Hierarchy::Binary(tree) => tree.walk(ray, self.reach, visit),
        }
    }

    /// Distance to the primitive of a leaf entry by the shared routines, if in 0 < t.
    #[inline(always)]
    fn distance(&self, shear: &Shear, ray: &Ray, entry: usize) -> Option<f32> {
        let t = match shear.distance(&self.corners[entry]) {
            Verdict::Miss => return None,
            Verdict::Hit(t) => t,
            Verdict::Ask => self.ask(shear, ray, entry)?,
        };
        (t > 0.0).then_some(t)
    }

    /// What four lanes of f32 do not decide: a ray on an edge, a quadric.
    #[cold]
    fn ask(&self, shear: &Shear, ray: &Ray, entry: usize) -> Option<f32> {
        let prim = self.prims[entry];
        match self.geometry.quadric(prim) {
            None => Some(shear.sheared.intersect(&self.geometry.corners(prim))?.t),
            Some(q) => quadric::intersect(q, ray),
        }
    }
}

impl Accel for Obvhs<'_> {
    fn geometry(&self) -> &Geometry {
        self.geometry
    }

    #[inline]
    fn nearest(&self, ray: &Ray) -> Option<u32> {
        let shear = Shear::new(ray);
        let mut best = None;
        self.walk::<true>(ray, |entry, far| {
            let Some(t) = self.distance(&shear, ray, entry) else {
                return Some(far);
            };
            // Of primitives at the very same distance the first in number is named, whatever the tree looks like.
            let nearer = t < far
                || (t == far && best.is_some_and(|b: usize| self.prims[entry] < self.prims[b]));
            if !nearer {
                return Some(far);
            }
            best = Some(entry);
            Some(t)
        });
        best.map(|entry| self.prims[entry])
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        let shear = Shear::new(ray);
        let mut hit = false;
        self.walk::<false>(ray, |entry, far| {
            hit = self
                .distance(&shear, ray, entry)
                .is_some_and(|t| t < ray.t_max);
            (!hit).then_some(far)
        });
        hit
    }

    fn name(&self) -> String {
        format!("obvhs {}", self.options)
    }

    fn memory_bytes(&self) -> usize {
        let tree = match &self.tree {
            Hierarchy::Wide(tree) => tree.memory_bytes(),
            Hierarchy::Binary(tree) => tree.memory_bytes(),
        };
        tree + size_of_val(self.corners.as_slice()) + size_of_val(self.prims.as_slice())
    }
}
