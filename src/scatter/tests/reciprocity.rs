//! f_s(l → e)·n_l² = f_s(e → l)·n_e², and its like for delta lobes (Veach, eq. 5.14).

use super::*;
use crate::real::Real;
use crate::sampling::{Rng, warp};
use crate::scatter::Mode;

#[test]
fn non_specular_lobes_are_reciprocal() {
    let mut rng = Rng::new(1, 0, 0, 0);
    for (name, bsdf) in rough::<4>().iter().chain(&smooth::<4>()) {
        let mut seen = 0;
        for i in 0..20_000 {
            let a = warp::sphere(rng.next_vec2());
            // Half of the pairs at random, half where the lobe is bright.
            let b = if i % 2 == 0 {
                warp::sphere(rng.next_vec2())
            } else {
                match bsdf.sample(a, Transport::FromEye, rng.next_f32(), rng.next_vec2()) {
                    Some(s) if s.mode == Mode::NonSpecular => s.to,
                    _ => continue,
                }
            };
            let there = bsdf.eval(a, b) * basic(bsdf, a, b).sqrt();
            let back = bsdf.eval(b, a) * basic(bsdf, b, a).sqrt();
            for lane in 0..4 {
                let (p, q) = (f64::from(there[lane]), f64::from(back[lane]));
                assert!(p >= 0.0 && p.is_finite(), "{name} {a} {b}");
                // Both directions see the same facet to 16 ε (the half vector of a nearly parallel pair is short). That
                // changes D by 4·16 ε/α at most, α ≥ 0.02, and T, in proportion to the cosine c of the flatter ray at
                // the facet, by 16 ε/c².
                let tolerance =
                    16.0 * f64::from(Real::EPSILON) * (4.0 / 0.02 + 1.0 / flatter(bsdf, a, b));
                assert!(
                    (p - q).abs() <= tolerance * p.max(q) + 1e-7,
                    "{name}: {a} {b}: {p} {q}"
                );
                seen += u32::from(p > 0.0);
            }
        }
        let nothing = !bsdf.has_non_specular();
        assert!(nothing == (seen == 0), "{name}");
        assert!(nothing || seen > 10_000, "{name} {seen}");
    }
}

/// Square of the smaller of the two directions' cosines at the facet that refracts one into the other; 1 in reflection.
fn flatter<const N: usize>(bsdf: &Bsdf<N>, a: Vec3, b: Vec3) -> f64 {
    if a.z * b.z > 0.0 {
        return 1.0;
    }
    // n_a/n_b, from its square.
    let m = (a * basic(bsdf, a, b).sqrt() + b).normalize();
    f64::from(a.dot(m).abs().min(b.dot(m).abs())).powi(2)
}

#[test]
fn delta_lobes_are_reciprocal() {
    let mut rng = Rng::new(2, 0, 0, 0);
    for (name, bsdf) in smooth::<4>() {
        for _ in 0..10_000 {
            let a = warp::sphere(rng.next_vec2());
            for mode in [Mode::Reflect, Mode::Transmit] {
                let Some(b) = bsdf.deflect(a, mode, Transport::FromEye) else {
                    continue;
                };
                let (Some(there), Some(back)) =
                    (bsdf.specular(a, b, mode), bsdf.specular(b, a, mode))
                else {
                    continue;
                };
                let (n_there, n_back) = (basic(&bsdf, a, b), basic(&bsdf, b, a));
                // dR/dcos is 1/cos near the critical angle.
                let tolerance = 2e-6 / a.z.abs().min(b.z.abs());
                for lane in 0..4 {
                    let d = there.value[lane] * n_there - back.value[lane] * n_back;
                    assert!(d.abs() < tolerance, "{name} {a} {b} {d}");
                }
                assert!((there.prob_e - back.prob_l).abs() < 1e-7, "{name}");
                assert!(
                    (there.jacobian * back.jacobian - 1.0).abs() < 1e-5,
                    "{name}"
                );
            }
        }
    }
}
