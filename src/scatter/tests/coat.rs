//! The coated base against a random walk through the layers it sums up in closed form.

use super::*;
use crate::real::Real;
use crate::sampling::{Rng, warp};
use crate::scatter::coat_table::{THICKNESS, smooth_return};

/// Bins in cos θ of the light that leaves.
const BINS: usize = 6;

/// One crossing of the layer.
fn absorb(w: Vec3) -> f64 {
    (-f64::from(THICKNESS) / f64::from(w.z.abs())).exp()
}

/// The coat alone as an interface: new direction and weight of a particle that comes along `from`.
fn interface(eta: Real, ggx: Option<Ggx>, from: Vec3, rng: &mut Rng) -> Option<(Vec3, f64)> {
    let bsdf = match ggx {
        None => Bsdf::<1>::Dielectric(Dielectric {
            eta,
            dispersive: false,
        }),
        Some(ggx) => Bsdf::RoughDielectric(RoughDielectric {
            eta,
            ggx,
            dispersive: false,
        }),
    };
    let s = bsdf.sample(from, Transport::FromLight, rng.next_f32(), rng.next_vec2())?;
    let w = match ggx {
        None => 1.0,
        Some(_) => f64::from(bsdf.eval(from, s.to)[0]) * f64::from(s.to.z.abs()) / f64::from(s.pdf),
    };
    Some((s.to, w))
}

/// Energy that leaves after at least one and at most `most` meetings with the base, by bins of cos θ, with variances of
/// the means.
fn walk(
    eta: Real,
    ggx: Option<Ggx>,
    albedo: f64,
    from: Vec3,
    most: u32,
    n: u32,
) -> ([f64; BINS], [f64; BINS]) {
    let mut rng = Rng::new(6, 0, 0, 0);
    let (mut sum, mut squares) = ([0.0; BINS], [0.0; BINS]);
    for _ in 0..n {
        let Some((mut w, mut weight)) = interface(eta, ggx, from, &mut rng) else {
            continue;
        };
        for _ in 0..most {
            if w.z > 0.0 {
                break;
            }
            weight *= absorb(w) * albedo;
            let up = warp::cosine_hemisphere(rng.next_vec2());
            weight *= absorb(up);
            let Some((to, k)) = interface(eta, ggx, -up, &mut rng) else {
                break;
            };
            weight *= k;
            w = to;
            if w.z > 0.0 {
                let bin = ((w.z * BINS as Real) as usize).min(BINS - 1);
                sum[bin] += weight;
                squares[bin] += weight * weight;
            }
        }
    }
    let n = f64::from(n);
    let mean = sum.map(|s| s / n);
    let mut var = squares.map(|s| s / n);
    for (v, m) in var.iter_mut().zip(mean) {
        *v = (*v - m * m) / n;
    }
    (mean, var)
}

/// The same from the closed form: f_s of the base is that of the coated lobe less that over a black base.
fn closed_form(eta: Real, ggx: Option<Ggx>, albedo: Real, from: Vec3) -> [f64; BINS] {
    let lobe = |a: Real| CoatedDiffuse::<1>::new(Spectrum([a]), eta, ggx, false);
    let (full, black) = (lobe(albedo), lobe(0.0));
    const PER_BIN: usize = 400;
    let mut sum = [0.0; BINS];
    for i in 0..BINS * PER_BIN {
        let z = (i as Real + 0.5) / (BINS * PER_BIN) as Real;
        // Across the plane of incidence, where the coat's own lobe is faint and the difference keeps its digits; the
        // base's light has no preferred azimuth.
        let to = Vec3::new(0.0, (1.0 - z * z).sqrt(), z.copysign(from.z));
        let f = full.eval(from, to)[0] - black.eval(from, to)[0];
        sum[i / PER_BIN] += f64::from(f * z) * std::f64::consts::TAU / (BINS * PER_BIN) as f64;
    }
    sum
}

#[test]
fn closed_form_equals_the_random_walk() {
    let n = 200_000;
    for (eta, alpha) in [
        (1.5, None),
        (1.9, None),
        (1.5, Some(0.1)),
        (1.5, Some(0.4)),
        (1.33, Some(0.7)),
        (2.2, Some(0.25)),
    ] {
        let ggx = alpha.map(|a| ggx((a, a)));
        for albedo in [0.2, 0.8] {
            for cos in [0.95 as Real, 0.25] {
                let from = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                let (mean, var) = walk(eta, ggx, f64::from(albedo), from, 1000, n);
                let want = closed_form(eta, ggx, albedo, from);
                let total: f64 = want.iter().sum();
                for bin in 0..BINS {
                    // 5 standard errors, and of rough coats the tables' interpolation: half a per cent of the bin and a
                    // little of the whole near the horizon.
                    let table = if ggx.is_some() {
                        0.005 * want[bin] + 0.0005 * total
                    } else {
                        1e-4 * total
                    };
                    let tolerance = 5.0 * var[bin].sqrt() + table;
                    assert!(
                        (mean[bin] - want[bin]).abs() < tolerance,
                        "η {eta} α {alpha:?} ρ {albedo} cos {cos} bin {bin}: walk {} ± {}, closed form {}",
                        mean[bin],
                        var[bin].sqrt(),
                        want[bin]
                    );
                }
            }
        }
    }
}

#[test]
fn the_reference_stops_early_by_the_stated_amounts() {
    // pbrt-v4's walk ends after 10 crossings, so light meets the base at most 5 times: it lacks (ρ·r)⁵ of the base's
    // light. For η = 1.5 that is nothing at ρ = 0.2, 0.2 % at 0.5 and 2 % at 0.8.
    let r = f64::from(smooth_return(1.5));
    assert!((r - 0.57).abs() < 0.01, "{r}");
    for (albedo, lacks) in [(0.2f64, 0.0000), (0.5, 0.002), (0.8, 0.02)] {
        let got = (albedo * r).powi(5);
        assert!((got - lacks).abs() < 0.001, "{albedo} {got}");
    }
    let from = directions()[1];
    let (all, _) = walk(1.5, None, 0.8, from, 1000, 100_000);
    let (cut, _) = walk(1.5, None, 0.8, from, 5, 100_000);
    let ratio = cut.iter().sum::<f64>() / all.iter().sum::<f64>();
    // Both walks see the same numbers until the first is cut, so the ratio is far surer than either sum; 0.004 is
    // 5 standard errors if the two were independent.
    assert!((ratio - (1.0 - (0.8 * r).powi(5))).abs() < 0.004, "{ratio}");
}

#[test]
fn coats_of_any_index_keep_a_white_base_below_one() {
    let mut rng = Rng::new(8, 0, 0, 0);
    for i in 0..400 {
        let eta = 0.4 + 2.5 * rng.next_f32();
        let ggx = (i % 2 == 0 && eta > 1.0).then(|| {
            let a = 0.001 + 0.999 * rng.next_f32();
            ggx((a, a))
        });
        let cos = rng.next_f32().max(0.01);
        let from = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let base: f64 = closed_form(eta, ggx, 1.0, from).iter().sum();
        // The coat's own share, from the samples that go up.
        let n = 4000;
        let (mut s, mut s2) = (0.0, 0.0);
        for _ in 0..n {
            if let Some((to, w)) = interface(eta, ggx, from, &mut rng)
                && to.z > 0.0
            {
                s += w;
                s2 += w * w;
            }
        }
        let coat = s / f64::from(n);
        let se = ((s2 / f64::from(n) - coat * coat) / f64::from(n)).sqrt();
        assert!(
            base + coat <= 1.0 + 5.0 * se,
            "η {eta} {ggx:?} cos {cos}: {base} + {coat} ± {se}"
        );
    }
}

#[test]
fn a_coat_hardly_rough_has_the_base_of_a_smooth_one() {
    for eta in [1.2, 1.5, 2.4] {
        for from in directions() {
            let a = closed_form(eta, None, 0.5, from);
            let b = closed_form(eta, Ggx::new(1e-3, 1e-3), 0.5, from);
            for bin in 0..BINS {
                let whole: f64 = a.iter().sum();
                // Interpolation of the tables, as above.
                let tolerance = 0.005 * a[bin] + 0.001 * whole;
                assert!(
                    (a[bin] - b[bin]).abs() < tolerance,
                    "{eta} {from} {a:?} {b:?}"
                );
            }
        }
    }
}
