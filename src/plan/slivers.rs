//! Triangles that a ray in f32 may meet again although it leaves them.

use crate::scene::{Geometry, SLIVER};
use std::collections::BTreeMap;

/// The shapes of a part of the scene that have slivers, each with the aspect of the worst.
pub fn slivers(part: &Geometry) -> BTreeMap<usize, f64> {
    let mut worst = BTreeMap::new();
    for prim in 0..part.triangles.len() {
        let squared = part.aspect_squared(prim as u32);
        if squared > SLIVER * SLIVER {
            let shape = part.prim_shape[prim] as usize;
            let of = worst.entry(shape).or_insert(0f64);
            *of = of.max(squared.sqrt());
        }
    }
    worst
}
