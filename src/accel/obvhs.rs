//! A backend in safe Rust, to check Embree with: the hierarchy is built by the crate obvhs, the traversal is here,
//! because it has to keep a promise that none of the crate's own makes: no box is passed over whose primitive the
//! shared routine would hit.

use super::triangle::Sheared;
use super::{Accel, Ray, fit::padded_bounds, quadric};
use crate::scene::Geometry;
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::{Boundable, BvhBuildParams};
use std::time::Duration;

/// Deepest tree that is walked with a stack on the machine's stack.
const STACK: usize = 192;

/// A binary bounding-volume hierarchy over a geometry.
pub struct Obvhs<'a> {
    geometry: &'a Geometry,
    bvh: Bvh2,
    /// Primitives in the order of the leaves, which is the order they are read in.
    leaves: Vec<Leaf>,
    /// Largest coordinate of anything.
    reach: f32,
}

/// What a visit to a primitive needs.
#[derive(Clone, Copy)]
struct Leaf {
    prim: u32,
    /// Of a triangle.
    corners: [Vec3; 3],
}

/// A primitive's box, as obvhs wants to see it.
struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl<'a> Obvhs<'a> {
    /// Builds over all primitives of `geometry`. The build uses one thread, and is the same every time.
    pub fn new(geometry: &'a Geometry) -> Self {
        super::surface::prepare(geometry);
        let mut reach = 0f32;
        let boxes: Vec<Bounds> = (0..geometry.prim_count() as u32)
            .map(|p| {
                let (lo, hi) = padded_bounds(geometry, p);
                reach = reach
                    .max(lo.abs().max_element())
                    .max(hi.abs().max_element());
                Bounds(Aabb::new(Vec3A::from(lo), Vec3A::from(hi)))
            })
            .collect();
        let mut time = Duration::ZERO;
        let mut bvh = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut time);
        let leaf = |&prim: &u32| Leaf {
            prim,
            corners: match geometry.quadric(prim) {
                None => geometry.corners(prim),
                Some(_) => [Vec3::ZERO; 3],
            },
        };
        let leaves = std::mem::take(&mut bvh.primitive_indices)
            .iter()
            .map(leaf)
            .collect();
        Self {
            geometry,
            bvh,
            leaves,
            reach,
        }
    }

    /// Visits leaves front to back. `visit` gets a primitive and the far end so far, and returns the new far end, or
    /// `None` to stop.
    #[inline]
    fn walk(&self, ray: &Ray, mut visit: impl FnMut(&Leaf, f32) -> Option<f32>) {
        if self.bvh.nodes.is_empty() {
            return;
        }
        let slab = Slab::new(ray, self.reach);
        let mut far = ray.t_max;
        let mut array = [(0u32, 0f32); STACK];
        let mut heap;
        // Each level leaves at most one sibling behind.
        let stack: &mut [(u32, f32)] = if self.bvh.max_depth < STACK {
            &mut array
        } else {
            heap = vec![(0u32, 0f32); self.bvh.max_depth + 1];
            &mut heap
        };
        let mut height = 0;
        let mut next = slab.enter(&self.bvh.nodes[0].aabb, far).map(|t| (0, t));
        loop {
            let Some((index, near)) = next.take() else {
                if height == 0 {
                    return;
                }
                height -= 1;
                next = Some(stack[height]);
                continue;
            };
            if near > far {
                continue;
            }
            let node = &self.bvh.nodes[index as usize];
            let first = node.first_index as usize;
            if node.prim_count > 0 {
                for leaf in &self.leaves[first..first + node.prim_count as usize] {
                    match visit(leaf, far) {
                        Some(t) => far = t,
                        None => return,
                    }
                }
                continue;
            }
            let a = slab.enter(&self.bvh.nodes[first].aabb, far);
            let b = slab.enter(&self.bvh.nodes[first + 1].aabb, far);
            let child = first as u32;
            next = match (a, b) {
                (Some(a), Some(b)) => {
                    let (near, later) = if a <= b {
                        ((child, a), (child + 1, b))
                    } else {
                        ((child + 1, b), (child, a))
                    };
                    stack[height] = later;
                    height += 1;
                    Some(near)
                }
                (Some(a), None) => Some((child, a)),
                (None, Some(b)) => Some((child + 1, b)),
                (None, None) => None,
            };
        }
    }

    /// Distance to a primitive by the shared routines, if in 0 < t.
    #[inline]
    fn distance(&self, sheared: &Sheared, ray: &Ray, leaf: &Leaf) -> Option<f32> {
        let t = match self.geometry.quadric(leaf.prim) {
            None => sheared.intersect(&leaf.corners)?.t,
            Some(q) => quadric::intersect(q, ray)?,
        };
        (t > 0.0).then_some(t)
    }
}

impl Accel for Obvhs<'_> {
    fn geometry(&self) -> &Geometry {
        self.geometry
    }

    fn nearest(&self, ray: &Ray) -> Option<u32> {
        let sheared = Sheared::new(ray);
        let mut best = None;
        self.walk(ray, |leaf, far| {
            let prim = leaf.prim;
            let Some(t) = self.distance(&sheared, ray, leaf) else {
                return Some(far);
            };
            // Of primitives at the very same distance the first in number is named, whatever the tree looks like.
            let nearer = t < far || (t == far && best.is_some_and(|b| prim < b));
            if !nearer {
                return Some(far);
            }
            best = Some(prim);
            Some(t)
        });
        best
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let sheared = Sheared::new(ray);
        let mut hit = false;
        self.walk(ray, |leaf, far| {
            hit = self
                .distance(&sheared, ray, leaf)
                .is_some_and(|t| t < ray.t_max);
            (!hit).then_some(far)
        });
        hit
    }

    fn name(&self) -> String {
        "obvhs".to_owned()
    }

    fn memory_bytes(&self) -> usize {
        size_of_val(self.bvh.nodes.as_slice()) + size_of_val(self.leaves.as_slice())
    }
}

/// A ray ready for slab tests that err on the side of entering.
struct Slab {
    /// o moved by ±`slack`: subtracting one from the low and the other from the high face widens every box by it.
    low: Vec3A,
    high: Vec3A,
    inverse: Vec3A,
}

impl Slab {
    #[inline]
    fn new(ray: &Ray, reach: f32) -> Self {
        // The shared triangle routine rounds a corner by up to 4u of its distance in every coordinate, so a face may
        // answer for rays that pass its box by that much; o itself is rounded once more in the sum here.
        let slack = 4.0 * f32::EPSILON * (reach + ray.o.abs().max_element());
        let o = Vec3A::from(ray.o);
        // A direction of 0 would make 0·∞; this one moves less than a rounding within any distance of use.
        let d = ray.d.to_array().map(|d| {
            if d.abs() < 1e-30 {
                1e-30f32.copysign(d)
            } else {
                d
            }
        });
        Self {
            low: o + slack,
            high: o - slack,
            inverse: Vec3A::from_array(d).recip(),
        }
    }

    /// Where the ray enters the box, if it does before `far`.
    #[inline]
    fn enter(&self, aabb: &Aabb, far: f32) -> Option<f32> {
        let a = (aabb.min - self.low) * self.inverse;
        let b = (aabb.max - self.high) * self.inverse;
        let enter = a.min(b).max_element().max(0.0);
        // 1 + 2γ3 on the far side makes up for the roundings of both (Ize 2013; PBRT 6.8.2).
        let leave = a.max(b).min_element() * (1.0 + 4.0 * f32::EPSILON);
        (enter <= leave && enter <= far).then_some(enter)
    }
}
