//! Sampled directions are counted in bins over the sphere and held against the integral of the density over each bin.

use super::*;
use crate::sampling::Rng;
use crate::scatter::Mode;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// Bins in cos θ; even, so that the horizon is an edge.
const NZ: usize = 20;
/// Bins in φ.
const NPHI: usize = 32;
const SAMPLES: u32 = 100_000;
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
    Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32)
}

/// ∫ f dω over a cell by a Gauss product rule, split in four until the parts agree with the whole.
fn integrate(f: &impl Fn(Vec3) -> f32, z: (f64, f64), phi: (f64, f64), depth: u32) -> f64 {
    let gauss = |z: (f64, f64), phi: (f64, f64)| {
        let (hz, hp) = (0.5 * (z.1 - z.0), 0.5 * (phi.1 - phi.0));
        let mut s = 0.0;
        for (a, wa) in GAUSS {
            for (b, wb) in GAUSS {
                let d = direction(z.0 + hz * (1.0 + a), phi.0 + hp * (1.0 + b));
                s += wa * wb * f64::from(f(d));
            }
        }
        s * hz * hp
    };
    let (mz, mp) = (0.5 * (z.0 + z.1), 0.5 * (phi.0 + phi.1));
    let parts = [
        ((z.0, mz), (phi.0, mp)),
        ((z.0, mz), (mp, phi.1)),
        ((mz, z.1), (phi.0, mp)),
        ((mz, z.1), (mp, phi.1)),
    ];
    let whole = gauss(z, phi);
    let sum: f64 = parts.iter().map(|&(z, p)| gauss(z, p)).sum();
    // Of all probability; with 10⁵ samples a part moves by 0.02, where the noise of the smallest bin is √5.
    let tolerance = 2e-7;
    if depth >= 16 || (depth >= 1 && (whole - sum).abs() < tolerance) {
        return sum;
    }
    parts
        .iter()
        .map(|&(z, p)| integrate(f, z, p, depth + 1))
        .sum()
}

/// p-value of `SAMPLES` samples of `bsdf` against the density of `reference`. What is not a non-specular sample counts
/// in one more bin.
fn p_value<const N: usize>(bsdf: &Bsdf<N>, reference: &Bsdf<N>, from: Vec3, dir: Transport) -> f64 {
    let cells = NZ * NPHI;
    let mut count = vec![0u32; cells + 1];
    let mut rng = Rng::new(9, 0, 0, from.z.to_bits());
    for _ in 0..SAMPLES {
        let bin = match bsdf.sample(from, dir, rng.next_f32(), rng.next_vec2()) {
            Some(s) if s.mode == Mode::NonSpecular => {
                let phi = f64::from(s.to.y).atan2(f64::from(s.to.x)).rem_euclid(TAU) / TAU;
                let i = ((f64::from(s.to.z) + 1.0) * 0.5 * NZ as f64) as usize;
                let j = (phi * NPHI as f64) as usize;
                i.min(NZ - 1) * NPHI + j.min(NPHI - 1)
            }
            _ => cells,
        };
        count[bin] += 1;
    }
    let edge = |i: usize| i as f64 / NZ as f64 * 2.0 - 1.0;
    let turn = |j: usize| j as f64 / NPHI as f64 * TAU;
    let mut expected: Vec<f64> = (0..cells)
        .map(|c| {
            let (i, j) = (c / NPHI, c % NPHI);
            let f = |to| reference.pdf(from, to, dir);
            integrate(&f, (edge(i), edge(i + 1)), (turn(j), turn(j + 1)), 0) * f64::from(SAMPLES)
        })
        .collect();
    let sum: f64 = expected.iter().sum();
    let all = f64::from(SAMPLES);
    assert!(sum < all * (1.0 + 1e-3), "density of mass {}", sum / all);
    expected.push((all - sum).max(0.0));
    chi_square(&count, &expected)
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

fn family<const N: usize>(lobes: Vec<(String, Bsdf<N>)>, dirs: &[Transport]) {
    let n = lobes.len() * directions().len() * dirs.len();
    // Šidák: n independent tests at this level have one false alarm with probability FAMILY.
    let level = 1.0 - (1.0 - FAMILY).powf(1.0 / n as f64);
    for (name, bsdf) in &lobes {
        for from in directions() {
            for &dir in dirs {
                let p = p_value(bsdf, bsdf, from, dir);
                assert!(
                    p >= level,
                    "{name} from {from} {dir:?}: p = {p:e} < {level:e}"
                );
            }
        }
    }
}

#[test]
fn four_lanes_follow_their_density() {
    family(rough::<4>(), &BOTH);
}

#[test]
fn one_lane_follows_its_density() {
    family(rough::<1>(), &[Transport::FromEye]);
}

#[test]
fn smooth_coats_base_follows_its_density_and_the_mirror_its_probability() {
    let coated = |v: Vec<(String, Bsdf<4>)>| {
        v.into_iter()
            .filter(|(_, b)| b.has_non_specular())
            .collect()
    };
    family(coated(smooth()), &BOTH);
}

#[test]
fn a_density_five_per_cent_too_rough_is_found_out() {
    let make = |a: f32| {
        Bsdf::<1>::RoughConductor(RoughConductor {
            index: silver(),
            ggx: ggx((a, a)),
        })
    };
    let p = p_value(
        &make(0.3),
        &make(0.315),
        directions()[1],
        Transport::FromEye,
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
