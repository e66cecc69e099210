//! The one ray–triangle routine: watertight, so that a ray through a shared edge meets at least one of the two faces.
//!
//! Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013: the triangle is moved to the ray's
//! origin and sheared so that the ray becomes the z axis; signs of the three 2D edge functions decide. Two faces that
//! share an edge compute the same edge function with the sign turned, bit for bit, and a value of exactly 0 is decided
//! again in f64, where the products of f32 are exact.

use super::{OwnRay, Ray};
use glam::{DVec3, Vec2, Vec3};

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Distance in units of |d|.
    pub t: f32,
    /// Barycentric weight of corner 1.
    pub b1: f32,
    /// Barycentric weight of corner 2.
    pub b2: f32,
}

/// A ray with the shear that turns it into the z axis; made once a ray.
#[derive(Clone, Copy, Debug)]
pub struct Sheared {
    origin: Vec3,
    /// Axis along which |d| is largest; it becomes z.
    pub(super) kz: u8,
    pub(super) shear: Vec3,
}

/// Shear of a ray of transport.
pub fn sheared(ray: &OwnRay) -> Sheared {
    Sheared::new(&ray.single())
}

impl Sheared {
    /// Shear of a ray whose direction is not 0.
    #[inline]
    pub fn new(ray: &Ray) -> Self {
        let a = ray.d.abs();
        let kz = if a.x > a.y && a.x > a.z {
            0
        } else if a.y > a.z {
            1
        } else {
            2
        };
        let d = permute(ray.d, kz);
        let s = 1.0 / d.z;
        Self {
            origin: ray.o,
            kz,
            shear: Vec3::new(-d.x * s, -d.y * s, s),
        }
    }

    /// A corner in the ray's frame: x and y across the ray, z·shear.z the distance. Depends on the corner alone, which
    /// is what makes neighbours agree.
    #[inline]
    fn apply(&self, p: Vec3) -> Vec3 {
        let q = permute(p - self.origin, self.kz);
        Vec3::new(q.x + self.shear.x * q.z, q.y + self.shear.y * q.z, q.z)
    }

    /// Meets the triangle anywhere on the line of the ray; the caller compares `t` with its interval.
    #[inline]
    pub fn intersect(&self, corners: &[Vec3; 3]) -> Option<TriangleHit> {
        let [p0, p1, p2] = corners.map(|p| self.apply(p));
        let (e0, e1, e2) = (edge(p1, p2), edge(p2, p0), edge(p0, p1));
        if e0 == 0.0 || e1 == 0.0 || e2 == 0.0 {
            return self.decide_exactly(p0, p1, p2);
        }
        if (e0 < 0.0 || e1 < 0.0 || e2 < 0.0) && (e0 > 0.0 || e1 > 0.0 || e2 > 0.0) {
            return None;
        }
        let inverse = 1.0 / (e0 + e1 + e2);
        let (b0, b1, b2) = (e0 * inverse, e1 * inverse, e2 * inverse);
        // The barycentric mean of depths lies between them, so no t falls outside the triangle's own range.
        let t = (b0 * p0.z + b1 * p1.z + b2 * p2.z) * self.shear.z;
        t.is_finite().then_some(TriangleHit { t, b1, b2 })
    }

    /// The same in f64, for sheared corners of which an edge function is 0 in f32: on the edge, or below what f32 holds.
    #[cold]
    fn decide_exactly(&self, p0: Vec3, p1: Vec3, p2: Vec3) -> Option<TriangleHit> {
        let [p0, p1, p2] = [p0, p1, p2].map(|p| p.as_dvec3());
        // Products of f32 are exact in f64; the difference is rounded once, so its sign is right and antisymmetric.
        let edge = |a: DVec3, b: DVec3| a.x * b.y - a.y * b.x;
        let (e0, e1, e2) = (edge(p1, p2), edge(p2, p0), edge(p0, p1));
        if (e0 < 0.0 || e1 < 0.0 || e2 < 0.0) && (e0 > 0.0 || e1 > 0.0 || e2 > 0.0) {
            return None;
        }
        let det = e0 + e1 + e2;
        if det == 0.0 {
            return None;
        }
        let t = (e0 * p0.z + e1 * p1.z + e2 * p2.z) / det * self.shear.z as f64;
        let (t, b1, b2) = (t as f32, (e1 / det) as f32, (e2 / det) as f32);
        t.is_finite().then_some(TriangleHit { t, b1, b2 })
    }

    /// How far the line of the ray lies beyond each edge of a triangle, in the plane across the z axis, the farthest edge
    /// first; and the unit vector in that plane that leads out over it.
    #[cold]
    pub fn ways_out(&self, corners: &[Vec3; 3]) -> [(f32, Vec3); 3] {
        let p = corners.map(|p| self.apply(p).as_dvec3().truncate());
        let turn = (p[1] - p[0]).perp_dot(p[2] - p[0]).signum();
        let mut ways = [0, 1, 2].map(|i| {
            let (a, b) = (p[i], p[(i + 1) % 3]);
            let out = -(b - a).normalize_or_zero().perp() * turn;
            let (out, beyond) = (out.as_vec2(), -a.dot(out) as f32);
            let way = match self.kz {
                0 => Vec3::new(0.0, out.x, out.y),
                1 => Vec3::new(out.y, 0.0, out.x),
                _ => Vec3::new(out.x, out.y, 0.0),
            };
            (beyond, way)
        });
        ways.sort_by(|a, b| b.0.total_cmp(&a.0));
        ways
    }

    /// The point of the triangle nearest to the line of the ray, for a triangle that `intersect` misses by a rounding.
    #[cold]
    pub fn nearest_point(&self, corners: &[Vec3; 3]) -> TriangleHit {
        let p = corners.map(|p| self.apply(p).as_dvec3());
        let mut best = (f64::INFINITY, [1.0, 0.0, 0.0]);
        for i in 0..3 {
            let j = (i + 1) % 3;
            let (a, ab) = (p[i].truncate(), (p[j] - p[i]).truncate());
            let len2 = ab.length_squared();
            let s = if len2 > 0.0 {
                (-a.dot(ab) / len2).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let distance2 = (a + ab * s).length_squared();
            if distance2 < best.0 {
                let mut b = [0.0; 3];
                b[i] = 1.0 - s;
                b[j] = s;
                best = (distance2, b);
            }
        }
        let [b0, b1, b2] = best.1;
        TriangleHit {
            t: ((b0 * p[0].z + b1 * p[1].z + b2 * p[2].z) * self.shear.z as f64) as f32,
            b1: b1 as f32,
            b2: b2 as f32,
        }
    }
}

/// Cyclic permutation that brings axis `kz` to z.
#[inline]
fn permute(v: Vec3, kz: u8) -> Vec3 {
    match kz {
        0 => Vec3::new(v.y, v.z, v.x),
        1 => Vec3::new(v.z, v.x, v.y),
        _ => v,
    }
}

/// Twice the signed area of (0, a, b). Exactly antisymmetric; a fused multiply-add would break that.
#[inline]
fn edge(a: Vec3, b: Vec3) -> f32 {
    let (a, b): (Vec2, Vec2) = (a.truncate(), b.truncate());
    a.x * b.y - a.y * b.x
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Rng, soup};
    use super::*;

    fn ray(o: Vec3, d: Vec3) -> Ray {
        Ray {
            o,
            d,
            t_max: f32::INFINITY,
        }
    }

    #[test]
    fn hits_the_point_aimed_at() {
        let mut rng = Rng(1);
        let geometry = soup(&mut rng, 2000);
        let mut tested = 0;
        for tri in 0..2000 {
            let corners = geometry.corners(tri);
            let (b1, b2) = rng.barycentric();
            let target = corners[0] * (1.0 - b1 - b2) + corners[1] * b1 + corners[2] * b2;
            let o = rng.vec3() * 4.0 - 2.0;
            let r = ray(o, target - o);
            let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let cos = (n.dot(r.d) / (n.length() * r.d.length())).abs();
            let longest = (corners[1] - corners[0])
                .length()
                .max((corners[2] - corners[0]).length());
            let height = n.length() / longest;
            // A rounding of 2⁻²⁴ of the coordinates (below 4 here) moves the hit by that over the cosine, and the
            // weights by that over the height.
            let bound = 32.0 * 4.0 * f32::EPSILON / cos / height;
            if bound > 0.01 || b1.min(b2).min(1.0 - b1 - b2) < bound {
                continue;
            }
            let hit = Sheared::new(&r).intersect(&corners).expect("aimed at");
            assert!((hit.b1 - b1).abs() < bound, "{hit:?} {b1} {b2} {bound}");
            assert!((hit.b2 - b2).abs() < bound, "{hit:?} {b1} {b2} {bound}");
            assert!((hit.t - 1.0).abs() < bound, "{hit:?} {bound}");
            tested += 1;
        }
        assert!(tested > 1500, "{tested}");
    }

    #[test]
    fn shared_edges_and_corners_let_nothing_through() {
        // A fan around a corner; rays aimed at points of its inner edges must meet one face of it.
        let mut rng = Rng(2);
        for _ in 0..2000 {
            let apex = rng.vec3() - 0.5;
            let rim: Vec<Vec3> = (0..6)
                .map(|i| {
                    let phi = i as f32 * std::f32::consts::TAU / 6.0 + 0.4 * rng.next();
                    Vec3::new(phi.cos(), phi.sin(), 0.3 * (rng.next() - 0.5)) + apex
                })
                .collect();
            let edge = (rng.next() * 6.0) as usize;
            let s = if rng.next() < 0.2 {
                0.0
            } else {
                0.9 * rng.next()
            };
            let target = apex + (rim[edge.min(5)] - apex) * s;
            let o = apex + Vec3::new(rng.next() - 0.5, rng.next() - 0.5, 2.0 + rng.next());
            let sheared = Sheared::new(&ray(o, target - o));
            let met = (0..6).any(|i| {
                sheared
                    .intersect(&[apex, rim[i], rim[(i + 1) % 6]])
                    .is_some()
            });
            assert!(met, "leak at {target} from {o}");
        }
    }

    #[test]
    fn nearest_point_of_a_miss_lies_on_the_edge_that_was_missed() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let r = ray(Vec3::new(0.5, -1e-3, 2.0), Vec3::NEG_Z);
        let sheared = Sheared::new(&r);
        assert_eq!(sheared.intersect(&corners), None);
        let hit = sheared.nearest_point(&corners);
        assert_eq!((hit.t, hit.b1, hit.b2), (2.0, 0.5, 0.0));
    }

    #[test]
    fn a_triangle_whose_squares_underflow_f32_is_met() {
        let s = 1e-25;
        let corners = [Vec3::ZERO, Vec3::X * s, Vec3::Y * s];
        let r = ray(Vec3::new(0.25 * s, 0.25 * s, 1.0), Vec3::NEG_Z);
        let hit = Sheared::new(&r).intersect(&corners).expect("aimed at");
        assert_eq!((hit.t, hit.b1, hit.b2), (1.0, 0.25, 0.25));
    }

    #[test]
    fn a_triangle_seen_edge_on_is_missed() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let r = ray(Vec3::new(-1.0, 0.2, 0.0), Vec3::X);
        assert_eq!(Sheared::new(&r).intersect(&corners), None);
    }
}
