//! A tree over the primitives of the world or of one object, with what its leaves hold.

use super::super::{Ray, quadric};
use super::binary::Binary;
use super::build::{ObvhsOptions, Parts, Tree};
use super::leaf::{Corners, Shear, Verdict};
use super::wide::Wide;
use crate::scene::{Geometry, PrimId};

/// One level.
pub struct Level<'a> {
    geometry: &'a Geometry,
    tree: Hierarchy,
    /// Corners of the primitives in the order of the leaves, which is the order they are read in.
    corners: Vec<Corners>,
    /// Their numbers.
    prims: Vec<u32>,
    /// Largest coordinate of anything.
    reach: f32,
}

enum Hierarchy {
    Wide(Wide),
    Binary(Binary),
}

/// What a leaf entry holds that four lanes of f32 do not decide.
enum Asked {
    /// A primitive, met at this distance.
    Met(f32),
    /// Nothing on this ray.
    Passed,
    /// An instance.
    Instance(u32),
}

impl<'a> Level<'a> {
    /// A tree over the parts of a geometry.
    pub fn build(geometry: &'a Geometry, parts: &Parts, options: ObvhsOptions) -> Self {
        let (tree, order) = match options.tree {
            Tree::Wide => {
                let (tree, order) = Wide::build(parts, options);
                (Hierarchy::Wide(tree), order)
            }
            Tree::Binary => {
                let (tree, order) = Binary::build(parts, options);
                (Hierarchy::Binary(tree), order)
            }
        };
        let prims: Vec<u32> = order.iter().map(|&i| parts.prims[i as usize]).collect();
        let corners = |&prim: &u32| match geometry.triangles.len() > prim as usize {
            true => Corners::new(geometry.corners(prim)),
            false => Corners::ASK,
        };
        Self {
            geometry,
            tree,
            corners: prims.iter().map(corners).collect(),
            prims,
            reach: parts.reach,
        }
    }

    /// Number of leaf entries.
    pub fn entries(&self) -> usize {
        self.prims.len()
    }

    /// Bytes of the tree and its leaves.
    pub fn memory_bytes(&self) -> usize {
        let tree = match &self.tree {
            Hierarchy::Wide(tree) => tree.memory_bytes(),
            Hierarchy::Binary(tree) => tree.memory_bytes(),
        };
        tree + size_of_val(self.corners.as_slice()) + size_of_val(self.prims.as_slice())
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

    /// The nearest primitive, named by `id`, which gives none to those that do not count. `through` asks what the ray, cut at the nearest hit so far, meets of an
    /// instance.
    #[inline(always)]
    pub fn nearest(
        &self,
        ray: &Ray,
        id: impl Fn(u32) -> Option<PrimId>,
        through: impl Fn(u32, &Ray) -> Option<(f32, PrimId)>,
    ) -> Option<PrimId> {
        let met = self.nearest_of(ray, id, through);
        met.map(|(_, id)| id)
    }

    /// The same, and its distance.
    #[inline(always)]
    pub fn nearest_of(
        &self,
        ray: &Ray,
        id: impl Fn(u32) -> Option<PrimId>,
        through: impl Fn(u32, &Ray) -> Option<(f32, PrimId)>,
    ) -> Option<(f32, PrimId)> {
        let shear = Shear::new(ray);
        let mut best = None;
        self.walk::<true>(ray, |entry, far| {
            let (t, prim) = match shear.distance(&self.corners[entry]) {
                Verdict::Miss => return Some(far),
                Verdict::Hit(t) => (t, id(self.prims[entry])),
                Verdict::Ask => match self.ask(&shear, ray, entry) {
                    Asked::Passed => return Some(far),
                    Asked::Met(t) => (t, id(self.prims[entry])),
                    Asked::Instance(i) => {
                        // What is met at that very distance may be the first in number.
                        let t_max = far.next_up();
                        match through(i, &Ray { t_max, ..*ray }) {
                            Some((t, prim)) => (t, Some(prim)),
                            None => return Some(far),
                        }
                    }
                },
            };
            let Some(prim) = prim else {
                return Some(far);
            };
            // Of primitives at the very same distance the first in number is named, whatever the tree looks like.
            let nearer = t < far || (t == far && best.is_some_and(|b: (f32, PrimId)| prim < b.1));
            if t > 0.0 && nearer {
                best = Some((t, prim));
                Some(t)
            } else {
                Some(far)
            }
        });
        best
    }

    /// Something that counts lies in 0 < t < t_max; `through` asks the same of an instance.
    #[inline(always)]
    pub fn occluded(
        &self,
        ray: &Ray,
        counts: impl Fn(u32) -> bool,
        through: impl Fn(u32, &Ray) -> bool,
    ) -> bool {
        let met = |t: f32, entry: usize| t > 0.0 && t < ray.t_max && counts(self.prims[entry]);
        let shear = Shear::new(ray);
        let mut hit = false;
        self.walk::<false>(ray, |entry, far| {
            hit = match shear.distance(&self.corners[entry]) {
                Verdict::Miss => false,
                Verdict::Hit(t) => met(t, entry),
                Verdict::Ask => match self.ask(&shear, ray, entry) {
                    Asked::Passed => false,
                    Asked::Met(t) => met(t, entry),
                    Asked::Instance(i) => through(i, ray),
                },
            };
            (!hit).then_some(far)
        });
        hit
    }

    /// What four lanes of f32 do not decide: a ray on an edge, a quadric, an instance.
    #[cold]
    fn ask(&self, shear: &Shear, ray: &Ray, entry: usize) -> Asked {
        let prim = self.prims[entry];
        let g = self.geometry;
        let t = match (prim as usize).checked_sub(g.triangles.len()) {
            None => {
                let met = shear.sheared.intersect(&g.corners(prim));
                met.map(|h| h.t)
            }
            Some(i) => match g.quadrics.get(i) {
                Some(q) => quadric::intersect(q, ray),
                None => return Asked::Instance((i - g.quadrics.len()) as u32),
            },
        };
        t.map_or(Asked::Passed, Asked::Met)
    }
}
