//! A node of eight children, their boxes in eight bits a coordinate (Ylitie, Karras and Laine, "Efficient Incoherent
//! Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017, whose layout obvhs builds), and its test.

use super::super::Ray;
use obvhs::aabb::Aabb;
use wide::{CmpLe, f32x8};

/// Eight boxes p + q·2^e.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Node {
    p: [f32; 3],
    /// Exponents as the bits of an f32 hold them.
    e: [u8; 3],
    /// Which children are nodes.
    pub inner: u8,
    /// The first of them.
    pub child: u32,
    /// First leaf entry of any child.
    pub entry: u32,
    /// Of a child that is a leaf: offset of its entries in the low five bits, a bit for each entry above. 0: no child.
    pub leaf: [u8; 8],
    /// Low x of all children, high x, low y …
    planes: [[u8; 8]; 6],
}

const _: () = assert!(size_of::<Node>() == 80);

impl Node {
    /// Rounds boxes outward. Every box of `boxes` is held whole by its eight bits, whatever the tree's builder rounded.
    pub fn new(
        inner: u8,
        child: u32,
        entry: u32,
        leaf: [u8; 8],
        boxes: &[Option<Aabb>; 8],
    ) -> Self {
        let all = boxes.iter().flatten();
        let whole = all.fold(Aabb::INVALID, |a, b| a.union(b));
        let mut node = Self {
            p: whole.min.to_array(),
            e: [1; 3],
            inner,
            child,
            entry,
            leaf,
            planes: [[255; 8], [0; 8], [255; 8], [0; 8], [255; 8], [0; 8]],
        };
        for k in 0..3 {
            let (low, high) = (whole.min[k] as f64, whole.max[k] as f64);
            // f64 holds the differences of two f32 and their products with powers of two to 2⁻⁵³; a step of that size
            // too little would be lost in the slack of the test.
            while (high - low) / node.step(k) > 255.0 {
                // In the first turn to the right binade, then up one if that is not enough.
                let guess = ((high - low) / 255.0) as f32;
                node.e[k] = (node.e[k] + 1).max((guess.to_bits() >> 23) as u8);
            }
            let step = node.step(k);
            for (i, b) in boxes.iter().enumerate() {
                if let Some(b) = b {
                    let at = |x: f32| (x as f64 - low) / step;
                    node.planes[2 * k][i] = at(b.min[k]).floor() as u8;
                    node.planes[2 * k + 1][i] = at(b.max[k]).ceil() as u8;
                }
            }
        }
        node
    }

    fn step(&self, k: usize) -> f64 {
        f32::from_bits((self.e[k] as u32) << 23) as f64
    }

    /// The box of a child.
    #[cfg(test)]
    pub fn boxed(&self, i: usize) -> [[f64; 2]; 3] {
        [0, 1, 2].map(|k| {
            [0, 1].map(|s| self.p[k] as f64 + self.planes[2 * k + s][i] as f64 * self.step(k))
        })
    }
}

/// A ray ready for tests that err on the side of entering.
pub struct Slab {
    /// Origin moved against and along the ray by the slack: boxes grow by it.
    near: [f32; 3],
    far: [f32; 3],
    inverse: [f32; 3],
    /// Which plane of an axis the ray meets first: 0 low, 1 high.
    first: [usize; 3],
}

impl Slab {
    /// `reach` is the largest coordinate of any box.
    #[inline(always)]
    pub fn new(ray: &Ray, reach: f32) -> Self {
        // With R = reach + |o| and u = 2⁻²⁴, a plane's distance is rounded as if the plane were off by at most 6u·R:
        // p − o, its product, q·2^e·inverse and their sum by u each, 1/d by u. The shared triangle routine rounds a
        // corner by up to 4u·R and o is rounded once more here, so its face may answer for rays that pass its box by
        // 11u·R. This is 16u·R.
        let slack = 8.0 * f32::EPSILON * (reach + ray.o.abs().max_element());
        // A component of 0 would make 0·∞; this one moves less than 2⁻³⁸ R within the distance of anything.
        let least = ray.d.abs().max_element() * 2f32.powi(-40);
        let (mut near, mut far, mut inverse, mut first) = ([0.0; 3], [0.0; 3], [0.0; 3], [0; 3]);
        for k in 0..3 {
            let (o, d) = (ray.o[k], ray.d[k]);
            let d = if d.abs() < least {
                least.copysign(d)
            } else {
                d
            };
            let along = slack.copysign(d);
            near[k] = o + along;
            far[k] = o - along;
            inverse[k] = 1.0 / d;
            first[k] = usize::from(d < 0.0);
        }
        Self {
            near,
            far,
            inverse,
            first,
        }
    }

    /// Which children the ray enters before `far`, and where (0 if it starts inside).
    #[inline(always)]
    pub fn enter(&self, node: &Node, far: f32) -> (u32, [f32; 8]) {
        let (mut enter, mut leave) = (f32x8::ZERO, f32x8::splat(far));
        for k in 0..3 {
            let step = f32::from_bits((node.e[k] as u32) << 23) * self.inverse[k];
            let step = f32x8::splat(step);
            let near = (node.p[k] - self.near[k]) * self.inverse[k];
            let away = (node.p[k] - self.far[k]) * self.inverse[k];
            // Written so that the compiler sees an index below 6.
            let first = self.first[k] & 1;
            let (a, b) = (&node.planes[2 * k + first], &node.planes[2 * k + 1 - first]);
            enter = (floats(a) * step + f32x8::splat(near)).fast_max(enter);
            leave = (floats(b) * step + f32x8::splat(away)).fast_min(leave);
        }
        (enter.cmp_le(leave).move_mask() as u32, enter.to_array())
    }
}

#[inline(always)]
fn floats(q: &[u8; 8]) -> f32x8 {
    f32x8::new(q.map(f32::from))
}

#[cfg(test)]
mod tests {
    use super::super::super::testing::Rng;
    use super::*;
    use glam::Vec3A;

    #[test]
    fn rounded_boxes_hold_what_they_should_and_little_more() {
        let mut rng = Rng(32);
        for turn in 0..20_000 {
            let scale = 10f32.powi(turn % 37 - 18);
            let shift = if turn % 3 == 0 { 1000.0 } else { 0.0 };
            let mut corner = |size: f32| Vec3A::from(rng.vec3() * size + shift) * scale;
            let boxes = [(); 8].map(|()| {
                let (a, b) = (corner(1.0), corner(1.0));
                Aabb::new(a.min(b), a.max(b))
            });
            let mut given = boxes.map(Some);
            // Flat boxes, and sizes of 255 steps exactly.
            given[1] = Some(Aabb::new(boxes[0].min, boxes[0].min));
            if turn % 5 == 0 {
                let lo = Vec3A::ZERO;
                given = [None; 8];
                given[0] = Some(Aabb::new(
                    lo,
                    Vec3A::splat(255.0 * 2f32.powi(turn % 60 - 30)),
                ));
            }
            let node = Node::new(0, 0, 0, [0; 8], &given);
            let all = given.iter().flatten();
            let whole = all.fold(Aabb::INVALID, |a, b| a.union(b));
            for (i, b) in given.iter().enumerate() {
                let Some(b) = b else { continue };
                for (k, [lo, hi]) in node.boxed(i).into_iter().enumerate() {
                    let (min, max) = (b.min[k] as f64, b.max[k] as f64);
                    assert!(lo <= min && max <= hi, "{b:?} {lo} {hi}");
                    // A step is at most 2/255 of the whole, or the smallest there is.
                    let step = (whole.max[k] as f64 - whole.min[k] as f64) * (2.0 / 255.0);
                    let step = step.max(f32::MIN_POSITIVE as f64) * (1.0 + 1e-6);
                    assert!(min - lo < step && hi - max < step, "{b:?} {lo} {hi}");
                }
            }
        }
    }
}
