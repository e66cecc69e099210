//! Ray–sphere and ray–disk intersection in f64, where the coefficients made from f32 data keep 29 spare bits.

use super::{OwnRay, Ray};
use crate::real::{Convert, Real, Vec2};
use crate::scene::Quadric;
use glam::{DVec2, DVec3, Vec3};

/// Nearest t with 0 < t < t_max, or `None`.
#[inline]
pub fn intersect(quadric: &Quadric, ray: &Ray) -> Option<f32> {
    match quadric {
        Quadric::Sphere { center, radius, .. } => sphere(*center, *radius, ray),
        Quadric::Disk {
            center,
            normal,
            radius,
            ..
        } => disk(*center, *normal, *radius, ray),
    }
}

/// The two distances at which the line of the ray meets the sphere, nearer first. The discriminant comes from the
/// vector between the centre and the foot of its perpendicular, without the cancellation of b² − 4ac, and the second
/// root from c/(a·t) (PBRT 6.8.1 and 6.2.2).
#[inline]
fn roots(o: DVec3, d: DVec3, radius: f64) -> Option<(f64, f64)> {
    let a = d.length_squared();
    let b = o.dot(d);
    let foot = o - d * (b / a);
    let discriminant = a * (radius - foot.length()) * (radius + foot.length());
    if discriminant < 0.0 || discriminant.is_nan() {
        return None;
    }
    let root = discriminant.sqrt();
    // (|o| − r)(|o| + r) rather than |o|² − r²: o lies near the surface whenever it matters.
    let c = (o.length() - radius) * (o.length() + radius);
    let q = if b < 0.0 { root - b } else { -root - b };
    let (t0, t1) = if q == 0.0 { (0.0, 0.0) } else { (q / a, c / q) };
    Some(if t0 <= t1 { (t0, t1) } else { (t1, t0) })
}

#[inline]
fn sphere(center: Vec3, radius: f32, ray: &Ray) -> Option<f32> {
    let o = ray.o.as_dvec3() - center.as_dvec3();
    let (t0, t1) = roots(o, ray.d.as_dvec3(), radius as f64)?;
    in_range(t0, ray).or_else(|| in_range(t1, ray))
}

#[inline]
fn disk(center: Vec3, normal: Vec3, radius: f32, ray: &Ray) -> Option<f32> {
    let (o, d) = (ray.o.as_dvec3() - center.as_dvec3(), ray.d.as_dvec3());
    let n = normal.as_dvec3();
    let cos = d.dot(n);
    if cos == 0.0 {
        return None;
    }
    let t = -o.dot(n) / cos;
    let inside = (o + d * t).length_squared() <= (radius as f64).powi(2);
    if inside { in_range(t, ray) } else { None }
}

/// `t` rounded to f32, if that lies inside the ray.
#[inline]
fn in_range(t: f64, ray: &Ray) -> Option<f32> {
    let t = t as f32;
    (t > 0.0 && t < ray.t_max).then_some(t)
}

/// The distance of the hit that a backend found, which calls [`intersect`] itself.
#[cfg(not(feature = "double"))]
#[inline]
pub fn met(quadric: &Quadric, ray: &OwnRay) -> Option<Real> {
    intersect(quadric, ray)
}

/// The distance of the hit that a backend found, by the ray that it was asked of in f32.
#[cfg(feature = "double")]
pub fn met(quadric: &Quadric, ray: &OwnRay) -> Option<Real> {
    let (t, passed_by) = on_line(quadric, ray.o, ray.d);
    if passed_by {
        intersect(quadric, &ray.single()).map(Real::from)
    } else {
        Some(t)
    }
}

/// Where the line o + t·d in f64 meets a quadric that a backend says it does, at the first t > 0 if there is one. The
/// flag tells that it passes by (the backend's roundings said otherwise) at this, the nearest point.
pub fn on_line(quadric: &Quadric, o: DVec3, d: DVec3) -> (f64, bool) {
    match quadric {
        Quadric::Sphere { center, radius, .. } => {
            let o = o - center.as_dvec3();
            match roots(o, d, *radius as f64) {
                Some((t0, t1)) => (if t0 > 0.0 { t0 } else { t1 }, false),
                None => (-o.dot(d) / d.length_squared(), true),
            }
        }
        Quadric::Disk {
            center,
            normal,
            radius,
            ..
        } => {
            let (o, n) = (o - center.as_dvec3(), normal.as_dvec3());
            let t = -o.dot(n) / d.dot(n);
            if t.is_finite() {
                let outside = (o + d * t).length_squared() > (*radius as f64).powi(2);
                (t, outside)
            } else {
                (-o.dot(d) / d.length_squared(), true)
            }
        }
    }
}

/// The point of the quadric nearest to a point close to it, in f64; the outward normal of a sphere or the normal of a
/// disk goes with it. It takes the error of a rounded t out of the point.
#[inline]
pub fn project(quadric: &Quadric, p: DVec3) -> (DVec3, DVec3) {
    match quadric {
        Quadric::Sphere { center, radius, .. } => {
            let n = (p - center.as_dvec3()).normalize_or(DVec3::Z);
            (center.as_dvec3() + n * *radius as f64, n)
        }
        Quadric::Disk { center, normal, .. } => {
            let n = normal.as_dvec3();
            let height = (p - center.as_dvec3()).dot(n) / n.length_squared();
            (p - n * height, n)
        }
    }
}

/// Which point of a quadric is nearest to `near`, as two numbers: on a sphere the octahedral map of the direction from its
/// centre (Meyer et al. 2010), on a disk the lengths along its tangent and bitangent. [`point`] finds it again.
#[inline]
pub fn place(quadric: &Quadric, near: DVec3) -> Vec2 {
    match quadric {
        Quadric::Sphere { center, .. } => octahedral(near - center.as_dvec3()).real(),
        Quadric::Disk {
            center,
            normal,
            tangent,
            ..
        } => {
            let (r, t) = (near - center.as_dvec3(), tangent.as_dvec3());
            let b = normal.as_dvec3().cross(t);
            DVec2::new(r.dot(t), r.dot(b)).real()
        }
    }
}

/// The point of the quadric at a [`place`] with its normal, as [`project`] gives them: on the surface to f64's digits, and
/// along the surface as far from where it was as two f32 numbers tell.
#[inline]
pub fn point(quadric: &Quadric, place: Vec2) -> (DVec3, DVec3) {
    let p = place.double();
    match quadric {
        Quadric::Sphere { center, radius, .. } => {
            let n = direction(p);
            (center.as_dvec3() + n * *radius as f64, n)
        }
        Quadric::Disk {
            center,
            normal,
            tangent,
            ..
        } => {
            let (n, t) = (normal.as_dvec3(), tangent.as_dvec3());
            let near = center.as_dvec3() + t * p.x + n.cross(t) * p.y;
            project(quadric, near)
        }
    }
}

/// A direction of any length on the square −1 … 1: the octahedron |x| + |y| + |z| = 1 seen from +z, its lower half folded
/// outwards. +z for no direction.
#[inline]
fn octahedral(d: DVec3) -> DVec2 {
    let sum = d.abs().element_sum();
    if sum == 0.0 {
        return DVec2::ZERO;
    }
    let p = d.truncate() / sum;
    if d.z < 0.0 { folded(p) } else { p }
}

/// The unit direction of a point of the square.
#[inline]
fn direction(p: DVec2) -> DVec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let p = if z < 0.0 { folded(p) } else { p };
    p.extend(z).normalize()
}

/// Mirrors each triangle of the square in its outer or inner edge.
#[inline]
fn folded(p: DVec2) -> DVec2 {
    (DVec2::ONE - DVec2::new(p.y, p.x).abs()).copysign(p)
}

#[cfg(test)]
mod tests {
    use super::super::testing::Rng;
    use super::*;
    use glam::Mat3;

    fn unit_sphere(center: Vec3, radius: f32) -> Quadric {
        Quadric::Sphere {
            center,
            radius,
            to_object: Mat3::IDENTITY,
            inward: false,
        }
    }

    fn ray(o: Vec3, d: Vec3) -> Ray {
        Ray {
            o,
            d,
            t_max: f32::INFINITY,
        }
    }

    #[test]
    fn sphere_from_outside_inside_and_behind() {
        let s = unit_sphere(Vec3::ZERO, 1.0);
        assert_eq!(intersect(&s, &ray(Vec3::Z * 3.0, Vec3::NEG_Z)), Some(2.0));
        assert_eq!(intersect(&s, &ray(Vec3::ZERO, Vec3::X * 2.0)), Some(0.5));
        assert_eq!(intersect(&s, &ray(Vec3::Z * 3.0, Vec3::Z)), None);
        let short = Ray {
            t_max: 2.0,
            ..ray(Vec3::Z * 3.0, Vec3::NEG_Z)
        };
        assert_eq!(intersect(&s, &short), None);
    }

    #[test]
    fn sphere_hits_lie_on_the_sphere_however_far_the_origin() {
        let mut rng = Rng(3);
        for _ in 0..10_000 {
            let center = rng.vec3() - 0.5;
            let radius = 0.1 + rng.next();
            let far = 10f32.powf(4.0 * rng.next());
            let o = center + rng.direction() * (radius + far);
            let d = (center + rng.direction() * radius * 0.9 - o).normalize();
            let t = intersect(&unit_sphere(center, radius), &ray(o, d)).expect("aimed at");
            let p = o.as_dvec3() + d.as_dvec3() * t as f64;
            let off = ((p - center.as_dvec3()).length() - radius as f64).abs();
            // t is rounded to f32 once: half an ulp of it.
            let bound = t as f64 * f32::EPSILON as f64 * 0.5 * (1.0 + 1e-6);
            assert!(off <= bound, "{off} > {bound}");
        }
    }

    /// A coordinate of the square is rounded by 2⁻²⁵ at most, which moves the third coordinate of the octahedron by the sum
    /// of two such, and its points are at least 1/√3 from the centre: √6·√3·2⁻²⁵ in all, 1.27·10⁻⁷ of the radius.
    #[test]
    fn two_numbers_tell_a_point_of_a_sphere() {
        let mut rng = Rng(5);
        // Edges and corners of the octahedron, and beside them.
        let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(1.0, 1.0, 0.0)];
        let corners = axes.iter().flat_map(|a| [*a, -*a]);
        let beside = corners.flat_map(|a| [a, a + Vec3::splat(1e-8), a - Vec3::splat(1e-8)]);
        let mut all: Vec<Vec3> = beside.collect();
        all.extend((0..100_000).map(|_| rng.direction()));
        for d in all {
            let center = 100.0 * (rng.vec3() - 0.5);
            let s = unit_sphere(center, 0.1 + rng.next());
            let near = center.as_dvec3() + d.as_dvec3() * (0.5 + rng.next() as f64);
            let (p, n) = project(&s, near);
            let (q, m) = point(&s, place(&s, near));
            let bound = 18f64.sqrt() * 0.5f64.powi(25) * (1.0 + 1e-6);
            assert!((m - n).length() <= bound, "{d}: {m} is not {n}");
            let Quadric::Sphere { radius, .. } = s else {
                unreachable!()
            };
            assert!((p - q).length() <= bound * radius as f64 + 1e-13);
            let off = ((q - center.as_dvec3()).length() - radius as f64).abs();
            assert!(off < 1e-13, "{off}");
        }
        // The centre has no nearest point, and some.
        let s = unit_sphere(Vec3::ONE, 1.0);
        assert_eq!(point(&s, place(&s, DVec3::ONE)).1, DVec3::Z);
    }

    /// The point moves by the roundings of the two numbers and by how far the f32 axes are from orthonormal, each some 2⁻²⁴
    /// of the radius.
    #[test]
    fn two_numbers_tell_a_point_of_a_disk() {
        let mut rng = Rng(6);
        for _ in 0..100_000 {
            let normal = rng.direction();
            let tangent = normal.cross(rng.direction()).normalize();
            let (center, radius) = (100.0 * (rng.vec3() - 0.5), 0.1 + rng.next());
            let disk = Quadric::Disk {
                center,
                normal,
                tangent,
                radius,
            };
            let r = tangent.as_dvec3() * (rng.next() as f64)
                + normal.cross(tangent).as_dvec3() * rng.next() as f64;
            let near = center.as_dvec3() + r * radius as f64 + normal.as_dvec3() * 1e-5;
            let (p, _) = project(&disk, near);
            let (q, n) = point(&disk, place(&disk, near));
            assert!((p - q).length() < 8.0 * 0.5f64.powi(24) * radius as f64);
            let height = (q - center.as_dvec3()).dot(n).abs();
            assert!(n == normal.as_dvec3() && height < 1e-13, "{height}");
        }
    }

    #[test]
    fn disk_is_met_inside_its_radius_only() {
        let disk = Quadric::Disk {
            center: Vec3::new(0.0, 0.0, 1.0),
            normal: Vec3::Z,
            tangent: Vec3::X,
            radius: 2.0,
        };
        let hit = |x: f32| intersect(&disk, &ray(Vec3::new(x, 0.0, 4.0), Vec3::NEG_Z));
        assert_eq!(hit(1.999), Some(3.0));
        assert_eq!(hit(2.001), None);
        assert_eq!(
            intersect(&disk, &ray(Vec3::new(0.0, 0.0, 1.0), Vec3::X)),
            None
        );
    }
}
