//! The equal-area octahedral map of environment images (Clarberg 2008).

use crate::scene::texture::Image;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_4, PI};

/// The unit direction shown at `uv` in the unit square: the middle is +z, the corners are −z, and equal areas of
/// the square are equal solid angles.
pub(super) fn direction(uv: DVec2) -> DVec3 {
    let p = 2.0 * uv - 1.0;
    let a = p.abs();
    // Signed distance from the diagonal |x| + |y| = 1, where z = 0.
    let d = 1.0 - (a.x + a.y);
    let r = 1.0 - d.abs();
    let phi = if r == 0.0 {
        0.0
    } else {
        ((a.y - a.x) / r + 1.0) * FRAC_PI_4
    };
    let z = (1.0 - r * r).copysign(d);
    let s = r * (2.0 - r * r).sqrt();
    DVec3::new(
        (s * phi.cos()).copysign(p.x),
        (s * phi.sin()).copysign(p.y),
        z,
    )
}

/// Illuminance of the upper hemisphere on the plane z = 0 as pbrt-v4 counts it for its `illuminance` parameter:
/// mean of luminance · cos θ over all texels, times 2π.
pub(super) fn illuminance(map: &Image) -> f64 {
    let mut sum = 0.0;
    for y in 0..map.height {
        for x in 0..map.width {
            let uv = DVec2::new(
                (f64::from(x) + 0.5) / f64::from(map.width),
                (f64::from(y) + 0.5) / f64::from(map.height),
            );
            let [r, g, b] = map.texel((y * map.width + x) as usize).map(f64::from);
            sum += (0.2126 * r + 0.7152 * g + 0.0722 * b) * direction(uv).z.max(0.0);
        }
    }
    sum * 2.0 * PI / (f64::from(map.width) * f64::from(map.height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::texture::Texels;

    #[test]
    fn directions_are_unit_and_equal_area() {
        let n = 64;
        let mut up = [0.0; 4];
        for y in 0..n {
            for x in 0..n {
                let uv = (DVec2::new(x as f64, y as f64) + 0.5) / n as f64;
                let d = direction(uv);
                assert!((d.length() - 1.0).abs() < 1e-12);
                // Bands of equal height in z have equal area on a sphere.
                up[(((d.z + 1.0) * 2.0) as usize).min(3)] += 1.0;
            }
        }
        // A band's border is a line of about 4·n texels, each within half a texel of it.
        for band in up {
            let want = (n * n) as f64 / 4.0;
            assert!((band - want).abs() < 4.0 * n as f64, "{up:?}");
        }
        assert!((direction(DVec2::splat(0.5)) - DVec3::Z).length() < 1e-12);
        assert!((direction(DVec2::new(1.0, 0.5)) - DVec3::X).length() < 1e-12);
        assert!((direction(DVec2::new(0.5, 1.0)) - DVec3::Y).length() < 1e-12);
        assert!((direction(DVec2::ZERO) + DVec3::Z).length() < 1e-12);
    }

    /// A white map: mean of max(cos θ, 0) over the sphere is 1/4.
    #[test]
    fn illuminance_of_white() {
        let n = 32;
        let map = Image {
            width: n,
            height: n,
            texels: Texels::Floats(vec![[1.0; 3]; (n * n) as usize]),
        };
        // The midpoint rule on a kinked function: error of order 1/n².
        assert!((illuminance(&map) - PI / 2.0).abs() < 10.0 / f64::from(n * n));
    }
}
