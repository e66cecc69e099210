//! No lobe makes light, and the light that single-scattering facets lose is stated.

use super::*;
use crate::sampling::Rng;
use crate::scatter::Mode;

/// Albedo in each lane of basic radiance from `from`, with its standard error in lane 0, by sampling.
fn albedo<const N: usize>(
    bsdf: &Bsdf<N>,
    from: Vec3,
    dir: Transport,
    samples: u32,
) -> (Spectrum<N>, f32) {
    let mut rng = Rng::new(5, 0, 0, 0);
    let (mut sum, mut squares) = ([0f64; N], 0f64);
    for _ in 0..samples {
        let Some(s) = bsdf.sample(from, dir, rng.next_f32(), rng.next_vec2()) else {
            continue;
        };
        let (w_l, w_e) = ends(from, s.to, dir);
        let k = match s.mode {
            Mode::NonSpecular => bsdf.eval(w_l, w_e) * (s.to.z.abs() / s.pdf),
            mode => {
                let d = bsdf.specular(w_l, w_e, mode).unwrap();
                // Light carries c·(cos e·dω_e)/(cos l·dω_l).
                match dir {
                    Transport::FromEye => d.value * (1.0 / s.pdf),
                    Transport::FromLight => {
                        d.value * ((w_e.z / w_l.z).abs() / (d.jacobian * s.pdf))
                    }
                }
            }
        };
        // What comes to the eye is counted as basic radiance; flux from a light needs no such factor.
        let k = match dir {
            Transport::FromEye => k * basic(bsdf, w_l, w_e),
            Transport::FromLight => k,
        };
        for (s, v) in sum.iter_mut().zip(k.0) {
            *s += f64::from(v);
        }
        squares += f64::from(k[0]).powi(2);
    }
    let n = f64::from(samples);
    let mean = sum[0] / n;
    let se = ((squares / n - mean * mean).max(0.0) / n).sqrt();
    (Spectrum::from_fn(|i| (sum[i] / n) as f32), se as f32)
}

#[test]
fn no_lobe_reflects_more_than_it_gets_in_either_direction() {
    for (name, bsdf) in rough::<4>().iter().chain(&smooth::<4>()) {
        for from in directions() {
            let [(eye, se), (light, _)] = BOTH.map(|dir| albedo(bsdf, from, dir, 1 << 14));
            for lane in 0..4 {
                assert!(eye[lane] <= 1.0 + 5.0 * se + 1e-5, "{name} {from} {eye:?}");
                assert!(eye[lane] > 0.01, "{name} {from}");
                // The same samples: only roundings differ.
                let d = (eye[lane] - light[lane]).abs();
                assert!(d < 1e-3 * eye[lane], "{name} {from} {eye:?} {light:?}");
            }
        }
    }
}

/// Albedo by the midpoint rule over directions, which knows nothing of sampling or densities.
fn quadrature<const N: usize>(bsdf: &Bsdf<N>, from: Vec3) -> f32 {
    let (nz, nphi) = (1000, 500);
    let mut sum = 0.0;
    for i in 0..2 * nz {
        let z = (f64::from(i) + 0.5) / f64::from(nz) - 1.0;
        for j in 0..nphi {
            let phi = (f64::from(j) + 0.5) / f64::from(nphi) * std::f64::consts::TAU;
            let r = (1.0 - z * z).sqrt();
            let to = Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32);
            sum += f64::from(bsdf.eval(from, to)[0]) * z.abs();
        }
    }
    (sum * std::f64::consts::TAU / f64::from(nz * nphi)) as f32
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
                (a[0] - q).abs() < 5.0 * se + 1e-3,
                "{name} {from}: {a:?} ± {se}, {q}"
            );
        }
    }
}

/// Albedo of white rough lobes: α, |cos θ|, metal of reflectance 1, glass of index 1.5 from outside and from inside.
/// One minus these is what a furnace loses to light that would meet a second facet.
const FURNACE: [(f32, f32, [f32; 3]); 9] = [
    (0.1, 1.0, [0.0, 0.0, 0.0]),
    (0.1, 0.5, [0.0, 0.0, 0.0]),
    (0.1, 0.1, [0.0, 0.0, 0.0]),
    (0.5, 1.0, [0.0, 0.0, 0.0]),
    (0.5, 0.5, [0.0, 0.0, 0.0]),
    (0.5, 0.1, [0.0, 0.0, 0.0]),
    (1.0, 1.0, [0.0, 0.0, 0.0]),
    (1.0, 0.5, [0.0, 0.0, 0.0]),
    (1.0, 0.1, [0.0, 0.0, 0.0]),
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
            .map(|(b, from)| albedo(&b, from, Transport::FromLight, 1 << 18));
        for ((a, se), want) in got.iter().zip(want) {
            // The stated figures are rounded to 0.001.
            if (a[0] - want).abs() > 5.0 * se + 0.001 {
                wrong += &format!("α {alpha} cos {cos}: {} ± {se}, not {want}\n", a[0]);
            }
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}
