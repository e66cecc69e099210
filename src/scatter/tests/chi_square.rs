//! Sampled directions are counted in bins over the sphere and held against the integral of the density over each bin.

use super::*;
use crate::real::{Convert, Real};
use crate::sampling::{Rng, warp};
use crate::scatter::Mode;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// Bins in cos θ; even, so that the horizon is an edge.
const NZ: usize = 20;
/// Bins in φ.
const NPHI: usize = 32;
const SAMPLES: u32 = 50_000;
/// Probability of a false alarm in the whole family.
const FAMILY: f64 = 0.01;

/// Nodes and weights of Gauss and Legendre on −1..1.
const GAUSS: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

fn direction(z: f64, phi: f64) -> Vec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new((r * phi.cos()) as Real, (r * phi.sin()) as Real, z as Real)
}

/// ∫ f dω over a cell (z, φ) by a Gauss product rule.
fn gauss(f: &impl Fn(Vec3) -> Real, z: (f64, f64), phi: (f64, f64)) -> f64 {
    let (hz, hp) = (0.5 * (z.1 - z.0), 0.5 * (phi.1 - phi.0));
    let mut s = 0.0;
    for (a, wa) in GAUSS {
        for (b, wb) in GAUSS {
            let d = direction(z.0 + hz * (1.0 + a), phi.0 + hp * (1.0 + b));
            s += wa * wb * f64::from(f(d));
        }
    }
    s * hz * hp
}

/// As [`gauss`], halved along whichever side changes the result more until neither does.
fn integrate(f: &impl Fn(Vec3) -> Real, z: (f64, f64), phi: (f64, f64), depth: u32) -> f64 {
    let (mz, mp) = (0.5 * (z.0 + z.1), 0.5 * (phi.0 + phi.1));
    let whole = gauss(f, z, phi);
    let by_z = gauss(f, (z.0, mz), phi) + gauss(f, (mz, z.1), phi);
    let by_phi = gauss(f, z, (phi.0, mp)) + gauss(f, z, (mp, phi.1));
    let (dz, dp) = ((by_z - whole).abs(), (by_phi - whole).abs());
    // Of all probability; a part of the count moves by 0.01, where the noise of the smallest bin is √5. The first
    // halvings are unconditional, so that a lobe between the nodes is seen.
    if depth >= 24 || (depth >= 2 && dz.max(dp) < 2e-7) {
        return by_z;
    }
    if dz >= dp {
        integrate(f, (z.0, mz), phi, depth + 1) + integrate(f, (mz, z.1), phi, depth + 1)
    } else {
        integrate(f, z, (phi.0, mp), depth + 1) + integrate(f, z, (mp, phi.1), depth + 1)
    }
}

/// How many of `SAMPLES` samples fall in each bin. What is not a non-specular sample counts in one more.
fn count<const N: usize>(bsdf: &Bsdf<N>, from: Vec3, dir: Transport) -> Vec<u32> {
    let mut count = vec![0u32; NZ * NPHI + 1];
    // Every transport and number of lanes draws its own numbers.
    let mut rng = Rng::new(9, dir as u32, N as u32, from.z.single().to_bits());
    for _ in 0..SAMPLES {
        let bin = match bsdf.sample(from, dir, rng.next_f32(), rng.next_vec2()) {
            Some(s) if s.mode == Mode::NonSpecular => {
                let phi = f64::from(s.to.y).atan2(f64::from(s.to.x)).rem_euclid(TAU) / TAU;
                let i = ((f64::from(s.to.z) + 1.0) * 0.5 * NZ as f64) as usize;
                let j = (phi * NPHI as f64) as usize;
                i.min(NZ - 1) * NPHI + j.min(NPHI - 1)
            }
            _ => NZ * NPHI,
        };
        count[bin] += 1;
    }
    count
}

/// What the density lets expect in each bin of [`count`].
fn expect<const N: usize>(bsdf: &Bsdf<N>, from: Vec3) -> Vec<f64> {
    let edge = |i: usize| i as f64 / NZ as f64 * 2.0 - 1.0;
    let turn = |j: usize| j as f64 / NPHI as f64 * TAU;
    let f = |to| bsdf.pdf(from, to, Transport::FromEye);
    let all = f64::from(SAMPLES);
    let mut expected: Vec<f64> = (0..NZ * NPHI)
        .map(|c| {
            let (i, j) = (c / NPHI, c % NPHI);
            all * integrate(&f, (edge(i), edge(i + 1)), (turn(j), turn(j + 1)), 0)
        })
        .collect();
    let sum: f64 = expected.iter().sum();
    assert!(sum < all * (1.0 + 1e-3), "density of mass {}", sum / all);
    expected.push((all - sum).max(0.0));
    expected
}

/// Pearson's statistic with small bins merged in order of their size, as a p-value.
fn chi_square(count: &[u32], expected: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..count.len()).collect();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));
    let (mut x2, mut bins) = (0.0, 0);
    let (mut e, mut o) = (0.0, 0.0);
    let mut left: f64 = expected.iter().sum();
    for (k, &i) in order.iter().enumerate() {
        e += expected[i];
        o += f64::from(count[i]);
        left -= expected[i];
        if e >= 5.0 && (left >= 5.0 || k + 1 == order.len()) {
            x2 += (o - e).powi(2) / e;
            bins += 1;
            (e, o) = (0.0, 0.0);
        }
    }
    if bins < 2 {
        return 1.0;
    }
    ChiSquared::new(f64::from(bins - 1)).unwrap().sf(x2)
}

#[test]
fn samples_follow_the_density_from_both_ends_with_one_lane_and_four() {
    let with_base =
        |(name, b): &(String, Bsdf<4>)| (name == "coated").then(|| (format!("smooth {name}"), *b));
    let four: Vec<_> = rough()
        .into_iter()
        .chain(smooth().iter().filter_map(with_base))
        .collect();
    let one: Vec<_> = rough::<1>()
        .into_iter()
        .chain(smooth().into_iter().filter(|(_, b)| b.has_non_specular()))
        .collect();
    // Šidák: that many independent tests at this level have one false alarm with probability FAMILY.
    let tests = (four.len() * directions().len() * 4) as f64;
    let level = 1.0 - (1.0 - FAMILY).powf(1.0 / tests);
    let mut rng = Rng::new(7, 0, 0, 0);
    for ((name, four), (_, one)) in four.iter().zip(&one) {
        for from in directions() {
            let expected = expect(one, from);
            // One integral serves all four cases, because the density is the same function in all.
            for _ in 0..200 {
                let to = warp::sphere(rng.next_vec2());
                for dir in BOTH {
                    let p = one.pdf(from, to, Transport::FromEye);
                    assert_eq!(p, one.pdf(from, to, dir), "{name}");
                    assert_eq!(p, four.pdf(from, to, dir), "{name}");
                }
            }
            for dir in BOTH {
                for (lanes, count) in [(1, count(one, from, dir)), (4, count(four, from, dir))] {
                    let p = chi_square(&count, &expected);
                    assert!(
                        p >= level,
                        "{name} from {from} {dir:?}, {lanes} lanes: p = {p:e} < {level:e}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_density_five_per_cent_too_rough_is_found_out() {
    let make = |a: Real| {
        Bsdf::<1>::RoughConductor(RoughConductor {
            index: silver(),
            ggx: ggx((a, a)),
        })
    };
    let from = directions()[1];
    let p = chi_square(
        &count(&make(0.3), from, BOTH[0]),
        &expect(&make(0.315), from),
    );
    assert!(p < 1e-6, "{p}");
}

#[test]
fn sample_returns_the_bits_of_pdf() {
    let mut rng = Rng::new(10, 0, 0, 0);
    for (name, bsdf) in rough::<4>().iter().chain(&smooth::<4>()) {
        for from in directions() {
            for dir in BOTH {
                for _ in 0..2000 {
                    let Some(s) = bsdf.sample(from, dir, rng.next_f32(), rng.next_vec2()) else {
                        continue;
                    };
                    let (w_l, w_e) = ends(from, s.to, dir);
                    assert!(s.pdf > 0.0 && s.pdf.is_finite(), "{name}");
                    // Reflection at a facet of slope 1/α loses a few bits of unit length.
                    assert!((s.to.length_squared() - 1.0).abs() < 4e-6, "{name}");
                    let again = match s.mode {
                        Mode::NonSpecular => bsdf.pdf(from, s.to, dir),
                        mode => {
                            assert_eq!(bsdf.deflect(from, mode, dir), Some(s.to), "{name}");
                            let d = bsdf.specular(w_l, w_e, mode).expect(name);
                            match dir {
                                Transport::FromEye => d.prob_e,
                                Transport::FromLight => d.prob_l,
                            }
                        }
                    };
                    assert_eq!(s.pdf, again, "{name} from {from} to {}", s.to);
                }
            }
        }
    }
}
