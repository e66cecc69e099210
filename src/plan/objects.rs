//! Which objects are worth an instance level.
//!
//! A ray finds its way through one tree quicker than through a tree of trees: it enters an instance by a box around all of
//! it, is carried into the object's space, and begins again at the top. So objects are put into the world as long as that
//! takes little memory, the ones that take least first, and only the rest is instanced.

use crate::scene::Geometry;

/// Primitives that objects may become beside one copy of each: at about 200 bytes (vertices, indices, what a hit looks up
/// and the tree) they are a fifth of a gigabyte, little beside the film and the chains of an image worth that scene.
pub const FLAT: u64 = 1 << 20;

/// For each object, whether it is instanced if objects may become `flat` more primitives.
pub fn instanced(g: &Geometry, flat: u64) -> Vec<bool> {
    let uses = g.uses();
    let more = |i: usize| {
        let copies = uses[i].saturating_sub(1) as u64;
        copies * g.objects[i].prim_count() as u64
    };
    let mut order: Vec<usize> = (0..g.objects.len()).collect();
    order.sort_by_key(|i| more(*i));
    let mut instanced = vec![false; g.objects.len()];
    let mut sum = 0u64;
    for i in order {
        sum = sum.saturating_add(more(i));
        instanced[i] = uses[i] > 0 && sum > flat;
    }
    instanced
}
