//! The shared ray–triangle routine on the four lanes every processor has: the three corners side by side. Where it
//! decides, it decides as [`Sheared`] does, bit for bit, because it makes the same operations in the same order.

use super::super::Ray;
use super::super::triangle::Sheared;
use glam::{Vec3, Vec4, Vec4Swizzles};

/// x of the three corners, then y, then z; the fourth lane is 0.
#[derive(Clone, Copy)]
pub struct Corners([Vec4; 3]);

impl Corners {
    /// Every question about it is asked elsewhere: a primitive that is not a triangle.
    pub const ASK: Self = Self([Vec4::NAN; 3]);

    /// Corners of a triangle.
    pub fn new([a, b, c]: [Vec3; 3]) -> Self {
        Self([0, 1, 2].map(|k| Vec4::new(a[k], b[k], c[k], 0.0)))
    }
}

/// What four lanes can tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// The ray's line passes outside.
    Miss,
    /// It meets the triangle at this distance, which may be negative.
    Hit(f32),
    /// An edge is met exactly, a number left the range of f32, or this is no triangle.
    Ask,
}

/// A ray's shear with its numbers in every lane.
pub struct Shear {
    /// The same for scalars.
    pub sheared: Sheared,
    /// Which rows of [`Corners`] become x, y, z.
    rows: [usize; 3],
    origin: [Vec4; 3],
    shear: [Vec4; 2],
}

impl Shear {
    /// Shear of a ray whose direction is not 0.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        let sheared = Sheared::new(ray);
        let rows = match sheared.kz {
            0 => [1, 2, 0],
            1 => [2, 0, 1],
            _ => [0, 1, 2],
        };
        Self {
            rows,
            origin: rows.map(|k| Vec4::splat(ray.o[k])),
            shear: [Vec4::splat(sheared.shear.x), Vec4::splat(sheared.shear.y)],
            sheared,
        }
    }

    /// Where on its line the ray meets the triangle.
    #[inline(always)]
    pub fn distance(&self, Corners(rows): &Corners) -> Verdict {
        let [kx, ky, kz] = self.rows;
        let z = rows[kz] - self.origin[2];
        let x = (rows[kx] - self.origin[0]) + self.shear[0] * z;
        let y = (rows[ky] - self.origin[1]) + self.shear[1] * z;
        // Lane i is the edge function of the corners i+1 and i+2.
        let e = x.yzxw() * y.zxyw() - y.yzxw() * x.zxyw();
        let below = e.cmplt(Vec4::ZERO).bitmask() & 7;
        let above = e.cmpgt(Vec4::ZERO).bitmask() & 7;
        if below | above != 7 {
            return Verdict::Ask;
        }
        if below != 0 && above != 0 {
            return Verdict::Miss;
        }
        let inverse = 1.0 / (e.x + e.y + e.z);
        let b = e * inverse;
        let t = (b.x * z.x + b.y * z.y + b.z * z.z) * self.sheared.shear.z;
        if t.is_finite() {
            Verdict::Hit(t)
        } else {
            Verdict::Miss
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::testing::{Rng, soup};
    use super::*;

    #[test]
    fn four_lanes_say_what_the_shared_routine_says_bit_for_bit() {
        let mut rng = Rng(31);
        let geometry = soup(&mut rng, 500);
        let (mut hits, mut asked) = (0, 0);
        for i in 0..200_000 {
            let corners = geometry.corners(i % 500);
            let o = (rng.vec3() - 0.5) * 4.0;
            // Every fifth ray is aimed at a corner, where an edge function may be 0.
            let target = match i % 5 {
                0 => corners[0],
                _ => corners[0] + (rng.vec3() - 0.5) * 0.3,
            };
            let d = if i % 7 == 0 { -o } else { target - o };
            let t_max = f32::INFINITY;
            let shear = Shear::new(&Ray { o, d, t_max });
            let expected = shear.sheared.intersect(&corners).map(|h| h.t.to_bits());
            match shear.distance(&Corners::new(corners)) {
                Verdict::Ask => asked += 1,
                Verdict::Hit(t) => {
                    assert_eq!(Some(t.to_bits()), expected);
                    hits += 1;
                }
                Verdict::Miss => assert_eq!(None, expected),
            }
            assert_eq!(shear.distance(&Corners::ASK), Verdict::Ask);
        }
        assert!(hits > 5_000 && asked > 1_000, "{hits} {asked}");
    }
}
