//! Two children a node.

use super::super::Ray;
use super::build::{ObvhsOptions, Parts};
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse, reinsertion::ReinsertionOptimizer};

/// Deepest tree that is walked with a stack on the machine's stack.
const STACK: usize = 192;

/// The tree.
pub struct Binary {
    bvh: Bvh2,
}

impl Binary {
    /// The tree, and the parts in the order of its leaves.
    pub fn build(parts: &Parts, options: ObvhsOptions) -> (Self, Vec<u32>) {
        let p = options.preset.parameters();
        let mut bvh = parts.binary(options);
        collapse(
            &mut bvh,
            p.max_prims_per_leaf.clamp(1, 255),
            p.collapse_traversal_cost,
        );
        let again = p.reinsertion_batch_ratio * p.post_collapse_reinsertion_batch_ratio_multiplier;
        ReinsertionOptimizer::default().run(&mut bvh, again, None);
        let order = std::mem::take(&mut bvh.primitive_indices);
        // What only the builder reads.
        bvh.parents = Vec::new();
        bvh.primitives_to_nodes = Vec::new();
        bvh.nodes.shrink_to_fit();
        (Self { bvh }, order)
    }

    /// Bytes of the nodes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.bvh.nodes.as_slice())
    }

    /// See [`super::Obvhs::walk`]; always front to back.
    #[inline(always)]
    pub fn walk(&self, ray: &Ray, reach: f32, mut visit: impl FnMut(usize, f32) -> Option<f32>) {
        if self.bvh.nodes.is_empty() {
            return;
        }
        let slab = Slab::new(ray, reach);
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
        let mut next = slab.enter(self.bvh.nodes[0].aabb(), far).map(|t| (0, t));
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
                for entry in first..first + node.prim_count as usize {
                    match visit(entry, far) {
                        Some(t) => far = t,
                        None => return,
                    }
                }
                continue;
            }
            let a = slab.enter(self.bvh.nodes[first].aabb(), far);
            let b = slab.enter(self.bvh.nodes[first + 1].aabb(), far);
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
}

/// A ray ready for slab tests that err on the side of entering.
struct Slab {
    /// o moved by ±`slack`: subtracting one from the low and the other from the high face widens every box by it.
    low: Vec3A,
    high: Vec3A,
    inverse: Vec3A,
}

impl Slab {
    #[inline(always)]
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
    #[inline(always)]
    fn enter(&self, aabb: &Aabb, far: f32) -> Option<f32> {
        let a = (aabb.min - self.low) * self.inverse;
        let b = (aabb.max - self.high) * self.inverse;
        let enter = a.min(b).max_element().max(0.0);
        // 1 + 2γ3 on the far side makes up for the roundings of both (Ize 2013; PBRT 6.8.2).
        let leave = a.max(b).min_element() * (1.0 + 4.0 * f32::EPSILON);
        (enter <= leave && enter <= far).then_some(enter)
    }
}
