//! No lobe makes light, and the light that single-scattering facets lose is stated.

use super::*;
use crate::real::Real;
use crate::sampling::Rng;
use crate::scatter::Mode;

/// Albedo in each lane of basic radiance from `from`, with standard errors, by sampling.
fn albedo<const N: usize>(
    bsdf: &Bsdf<N>,
    from: Vec3,
    dir: Transport,
    samples: u32,
) -> ([f64; N], [f64; N]) {
    let mut rng = Rng::new(5, 0, 0, 0);
    let (mut sum, mut squares) = ([0f64; N], [0f64; N]);
    for _ in 0..samples {
        let Some(s) = bsdf.sample(from, dir, rng.next_f32(), rng.next_vec2()) else {
            continue;
        };
        let (w_l, w_e) = ends(from, s.to, dir);
        // Per unit of the differential that the sample's end integrates over.
        let weight = match s.mode {
            Mode::NonSpecular => bsdf.eval(w_l, w_e) * (s.to.z.abs() / s.pdf),
            mode => {
                let d = bsdf.specular(w_l, w_e, mode).unwrap();
                let k = match dir {
                    Transport::FromEye => 1.0,
                    // Light carries c·(cos e·dω_e)/(cos l·dω_l).
                    Transport::FromLight => (w_e.z / w_l.z).abs() / d.jacobian,
                };
                d.value * (k / s.pdf)
            }
        };
        // What comes to the eye is counted as basic radiance; flux from a light needs no such factor.
        let weight = match dir {
            Transport::FromEye => weight * basic(bsdf, w_l, w_e),
            Transport::FromLight => weight,
        };
        for lane in 0..N {
            let v = f64::from(weight[lane]);
            sum[lane] += v;
            squares[lane] += v * v;
        }
    }
    let n = f64::from(samples);
    let mean = sum.map(|s| s / n);
    let se = std::array::from_fn(|i| ((squares[i] / n - mean[i] * mean[i]).max(0.0) / n).sqrt());
    (mean, se)
}

#[test]
fn no_lobe_reflects_more_than_it_gets_in_either_direction() {
    for (name, bsdf) in rough::<4>().iter().chain(&smooth::<4>()) {
        for from in directions() {
            let [(eye, se), (light, _)] = BOTH.map(|dir| albedo(bsdf, from, dir, 1 << 14));
            for lane in 0..4 {
                assert!(
                    eye[lane] <= 1.0 + 5.0 * se[lane] + 1e-5,
                    "{name} {from} {eye:?}"
                );
                assert!(eye[lane] > 0.01, "{name} {from}");
                // The same samples: only roundings differ.
                let d = (eye[lane] - light[lane]).abs();
                assert!(d < 1e-3 * eye[lane], "{name} {from} {eye:?} {light:?}");
            }
        }
    }
}

/// Albedo by the midpoint rule over directions, which knows nothing of sampling or densities.
fn quadrature(bsdf: &Bsdf<1>, from: Vec3) -> f64 {
    let (nz, nphi) = (1000, 500);
    let mut sum = 0.0;
    for i in 0..2 * nz {
        let z = (f64::from(i) + 0.5) / f64::from(nz) - 1.0;
        for j in 0..nphi {
            let phi = (f64::from(j) + 0.5) / f64::from(nphi) * std::f64::consts::TAU;
            let r = (1.0 - z * z).sqrt();
            let to = Vec3::new((r * phi.cos()) as Real, (r * phi.sin()) as Real, z as Real);
            sum += f64::from(bsdf.eval(from, to)[0]) * z.abs();
        }
    }
    sum * std::f64::consts::TAU / f64::from(nz * nphi)
}

#[test]
fn sampling_and_quadrature_agree_on_the_albedo() {
    for (name, bsdf) in rough::<1>() {
        // The midpoint rule cannot resolve a lobe narrower than its steps.
        if name.contains("0.02") {
            continue;
        }
        for from in [directions()[1], directions()[3]] {
            let (a, se) = albedo(&bsdf, from, Transport::FromLight, 1 << 16);
            let q = quadrature(&bsdf, from);
            assert!(
                (a[0] - q).abs() < 5.0 * se[0] + 1e-3,
                "{name} {from}: {a:?} ± {se:?}, {q}"
            );
        }
    }
}

/// Albedo of white rough lobes: α, |cos θ|, metal of reflectance 1, glass of index 1.5 from outside and from inside.
/// One minus these is what a furnace loses to light that would meet a second facet. The metal at α = 1 and normal
/// incidence has the closed form 1 − ln 2.
const FURNACE: [(Real, Real, [f64; 3]); 9] = [
    (0.1, 1.0, [0.988, 0.999, 0.989]),
    (0.1, 0.5, [0.969, 0.992, 0.963]),
    (0.1, 0.1, [0.884, 0.922, 0.864]),
    (0.5, 1.0, [0.688, 0.968, 0.754]),
    (0.5, 0.5, [0.699, 0.892, 0.659]),
    (0.5, 0.1, [0.861, 0.853, 0.689]),
    (1.0, 1.0, [0.308, 0.893, 0.418]),
    (1.0, 0.5, [0.451, 0.741, 0.512]),
    (1.0, 0.1, [0.761, 0.741, 0.509]),
];

#[test]
fn white_furnace_loses_the_stated_amounts() {
    let mut wrong = String::new();
    for (alpha, cos, want) in FURNACE {
        let ggx = ggx((alpha, alpha));
        let metal = Bsdf::<1>::RoughConductor(RoughConductor {
            // κ → ∞ reflects everything.
            index: Index {
                eta: [1.0],
                k: [1e6],
            },
            ggx,
        });
        let glass = Bsdf::<1>::RoughDielectric(RoughDielectric {
            eta: 1.5,
            ggx,
            dispersive: false,
        });
        let w = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
        let got = [(metal, w), (glass, w), (glass, -w)]
            .map(|(b, from)| albedo(&b, from, Transport::FromLight, 1 << 16));
        for ((a, se), want) in got.iter().zip(want) {
            // The stated figures are rounded to 0.001.
            if (a[0] - want).abs() > 5.0 * se[0] + 0.001 {
                wrong += &format!("α {alpha} cos {cos}: {} ± {}, not {want}\n", a[0], se[0]);
            }
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}
