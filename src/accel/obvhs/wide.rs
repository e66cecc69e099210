//! Eight children a node.

use super::super::Ray;
use super::build::{ObvhsOptions, Parts};
use super::node::{Node, Slab};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::cwbvh::{CwBvh, node::CwBvhNode};
use rayon::prelude::*;

/// Nodes waiting that fit on the machine's stack: seven for each level of a tree 22 deep.
const STACK: usize = 160;
/// Most entries a leaf can have.
const LEAF: u32 = 3;

/// The tree.
pub struct Wide {
    nodes: Vec<Node>,
    /// Most nodes that can wait at once.
    waiting: usize,
}

impl Wide {
    /// The tree, and the parts in the order of its leaves.
    pub fn build(parts: &Parts, options: ObvhsOptions) -> (Self, Vec<u32>) {
        let most = options
            .preset
            .parameters()
            .max_prims_per_leaf
            .clamp(1, LEAF);
        let bvh = bvh2_to_cwbvh(&parts.binary(options), most, false, true);
        let node = |n: &CwBvhNode| rounded(n, &bvh, parts);
        let nodes: Vec<Node> = bvh.nodes.par_iter().map(node).collect();
        let waiting = 7 * depth(&nodes) + 8;
        (Self { nodes, waiting }, bvh.primitive_indices)
    }

    /// Bytes of the nodes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
    }

    /// See [`super::Obvhs::walk`].
    #[inline(always)]
    pub fn walk<const ORDERED: bool>(
        &self,
        ray: &Ray,
        reach: f32,
        mut visit: impl FnMut(usize, f32) -> Option<f32>,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        let slab = Slab::new(ray, reach);
        let mut far = ray.t_max;
        let mut array = [(0f32, 0u32); STACK];
        let mut heap;
        let stack: &mut [(f32, u32)] = if self.waiting <= STACK {
            &mut array
        } else {
            heap = vec![(0f32, 0u32); self.waiting];
            &mut heap
        };
        let (mut height, mut next) = (0, 0u32);
        loop {
            let node = &self.nodes[next as usize];
            let (entered, near) = slab.enter(node, far);
            let mut leaves = entered & !(node.inner as u32);
            while leaves != 0 {
                let i = leaves.trailing_zeros() as usize;
                leaves &= leaves - 1;
                let leaf = node.leaf[i & 7] as u32;
                let first = node.entry + (leaf & 31);
                for entry in first..first + (leaf >> 5).count_ones() {
                    match visit(entry as usize, far) {
                        Some(t) => far = t,
                        None => return,
                    }
                }
            }
            let base = height;
            let mut inner = entered & node.inner as u32;
            while inner != 0 {
                let i = inner.trailing_zeros();
                let below = node.inner as u32 & ((1 << i) - 1);
                inner &= inner - 1;
                let child = (near[i as usize & 7], node.child + below.count_ones());
                let mut at = height;
                if ORDERED {
                    // The nearest ends on top.
                    while at > base && stack[at - 1].0 < child.0 {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                }
                stack[at] = child;
                height += 1;
            }
            loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                if stack[height].0 <= far {
                    next = stack[height].1;
                    break;
                }
            }
        }
    }
}

/// A node of the crate with boxes that are sure to hold what lies below it.
fn rounded(n: &CwBvhNode, bvh: &CwBvh, parts: &Parts) -> Node {
    let exact = bvh.exact_node_aabbs.as_ref().expect("asked for");
    let mut leaf = [0u8; 8];
    let boxes = std::array::from_fn(|i| {
        if n.is_child_empty(i) {
            return None;
        }
        if !n.is_leaf(i) {
            return Some(exact[n.child_node_index(i) as usize]);
        }
        leaf[i] = n.child_meta[i];
        let (first, count) = n.child_primitives(i);
        let entries = &bvh.primitive_indices[first as usize..(first + count) as usize];
        let boxes = entries.iter().map(|e| &parts.boxes[*e as usize]);
        Some(boxes.fold(Aabb::INVALID, |a, b| a.union(b)))
    });
    Node::new(
        n.imask,
        n.child_base_idx,
        n.primitive_base_idx,
        leaf,
        &boxes,
    )
}

/// Levels of the tree.
fn depth(nodes: &[Node]) -> usize {
    let mut level: Vec<u32> = vec![0; usize::from(!nodes.is_empty())];
    let mut depth = 0;
    while !level.is_empty() {
        let children = |i: &u32| {
            let n = &nodes[*i as usize];
            n.child..n.child + n.inner.count_ones()
        };
        level = level.iter().flat_map(children).collect();
        depth += 1;
    }
    depth
}
