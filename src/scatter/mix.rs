//! Which of a mix's two materials a point is made of.
//!
//! As in pbrt-v4 the choice is a hash of the point, so the surface is a fine dust of both materials. pbrt-v4 hashes the
//! viewing direction too; that would make a path's value depend on which end found it, so here the point alone counts.

use crate::real::{Convert, Real, Vec2, Vec3};
use crate::sampling::rng::mix;
use crate::scene::texture::Image;
use crate::scene::{Material, Scene};

/// The material that is not a mix which `material` comes down to at `point` with texture coordinates `uv`.
///
/// `point` must have the same bits whenever the path is evaluated: it is the hit point as stored in a vertex.
#[inline]
pub fn resolve(scene: &Scene, material: u32, uv: Vec2, point: Vec3) -> u32 {
    resolve_in(&scene.materials, &scene.images, material, uv, point)
}

/// As [`resolve`], given the tables it needs.
pub fn resolve_in(
    materials: &[Material],
    images: &[Image],
    material: u32,
    uv: Vec2,
    point: Vec3,
) -> u32 {
    let mut at = material;
    // The loader admits no cycle; the bound holds if one came in all the same.
    for _ in 0..=materials.len() {
        let Some(Material::Mix { amount, a, b }) = materials.get(at as usize) else {
            return at;
        };
        let amount = amount.eval(uv, images);
        at = if amount > 0.0 && (amount >= 1.0 || uniform(point, at) < amount) {
            *b
        } else {
            *a
        };
    }
    crate::scene::NONE
}

/// A number in [0, 1) from the bits of a point, one for each mix, so that nested mixes are independent.
#[inline]
fn uniform(p: Vec3, salt: u32) -> Real {
    let p = p.single();
    let word = |a: f32, b: u32| (u64::from(a.to_bits()) << 32) | u64::from(b);
    let h = mix(mix(word(p.x, p.y.to_bits())).wrapping_add(word(p.z, salt)));
    (h >> 40) as Real * (1.0 / (1 << 24) as Real)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dust_has_the_right_share_and_is_independent_between_mixes() {
        let n = 512;
        let (mut one, mut both) = (0, 0);
        for i in 0..n {
            for j in 0..n {
                let p = Vec3::new(i as Real / n as Real, 3.0 + j as Real / n as Real, 0.5);
                let (a, b) = (uniform(p, 1) < 0.3, uniform(p, 2) < 0.3);
                one += u32::from(a);
                both += u32::from(a && b);
            }
        }
        let m = f64::from(n * n);
        for (got, p) in [(one, 0.3), (both, 0.09)] {
            let se = (p * (1.0 - p) * m).sqrt();
            assert!((f64::from(got) - p * m).abs() < 4.0 * se, "{got} {p}");
        }
    }
}
