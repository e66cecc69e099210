//! Delta lobes: values, probabilities, the pairing of directions, the Jacobian; and rough lobes as they get smooth.

use super::*;
use crate::real::{Real, Vec2};
use crate::sampling::{Rng, warp};
use crate::scatter::{Mode, fresnel};

const MODES: [Mode; 2] = [Mode::Reflect, Mode::Transmit];

#[test]
fn deflecting_twice_returns() {
    let mut rng = Rng::new(1, 0, 0, 0);
    for (name, bsdf) in smooth::<4>() {
        let mut seen = 0;
        for _ in 0..10_000 {
            let w = warp::sphere(rng.next_vec2());
            for mode in MODES {
                for dir in BOTH {
                    let Some(t) = bsdf.deflect(w, mode, dir) else {
                        continue;
                    };
                    // sin θ is exact to ε; the angle loses 1/cos of either side.
                    let tolerance = 4.0 * Real::EPSILON / w.z.abs().min(t.z.abs());
                    let Some(back) = bsdf.deflect(t, mode, dir) else {
                        assert!(w.z.abs() < 2e-3 || t.z.abs() < 2e-3, "{name} {w}");
                        continue;
                    };
                    assert!((back - w).length() < tolerance, "{name} {mode:?} {w}");
                    assert_eq!(mode == Mode::Reflect, t.z * w.z > 0.0);
                    seen += 1;
                }
            }
        }
        assert!(seen > 5000, "{name}");
        assert_eq!(bsdf.deflect(Vec3::Z, Mode::NonSpecular, BOTH[0]), None);
    }
}

#[test]
fn interface_shares_light_by_fresnel() {
    for eta in ETAS {
        let bsdf = Bsdf::<4>::Dielectric(Dielectric {
            eta,
            dispersive: false,
        });
        for w_e in directions() {
            let r = fresnel::dielectric(w_e.z, eta);
            let up = bsdf.deflect(w_e, Mode::Reflect, BOTH[0]).unwrap();
            let mirror = bsdf.specular(up, w_e, Mode::Reflect).unwrap();
            assert_eq!((mirror.prob_e, mirror.prob_l), (r, r));
            assert_eq!(mirror.value, Spectrum::splat(r));
            assert_eq!(mirror.jacobian, 1.0);
            let Some(w_l) = bsdf.deflect(w_e, Mode::Transmit, BOTH[0]) else {
                assert_eq!(r, 1.0);
                continue;
            };
            let through = bsdf.specular(w_l, w_e, Mode::Transmit).unwrap();
            let basic_value = through.value[0] * basic(&bsdf, w_l, w_e);
            assert!((basic_value + r - 1.0).abs() < 1e-6);
            assert_eq!(through.prob_e, 1.0 - r);
            assert!((through.prob_l - through.prob_e).abs() < 1e-6);
            // Radiance is larger on the denser side.
            let denser_e = (w_e.z < 0.0) == (eta > 1.0);
            assert_eq!(denser_e, through.value[0] > 1.0 - r);
        }
    }
}

#[test]
fn pass_through_and_sheets() {
    let none = Bsdf::<4>::Dielectric(Dielectric {
        eta: 1.0,
        dispersive: false,
    });
    for w in directions() {
        let s = none.sample(w, BOTH[0], 0.0, Vec2::ZERO).unwrap();
        assert_eq!((s.to, s.mode, s.pdf), (-w, Mode::Transmit, 1.0));
        let t = none.specular(-w, w, Mode::Transmit).unwrap();
        assert_eq!((t.value, t.jacobian), (Spectrum::ONE, 1.0));
        assert_eq!(none.deflect(w, Mode::Reflect, BOTH[0]), None);
        assert!(none.specular(w, w, Mode::Reflect).is_none());
    }
    let sheet = Bsdf::<4>::ThinDielectric(ThinDielectric {
        eta: ramp(1.5, 0.02).0,
    });
    let r = sheet.specular(Vec3::Z, Vec3::Z, Mode::Reflect).unwrap();
    // 2R/(1+R) with R = 0.04 in lane 0, and growing with the index.
    assert!((r.value[0] - 0.08 / 1.04).abs() < 1e-6);
    assert!(r.value[1] > r.value[0]);
    assert_eq!(r.prob_e, r.value[0]);
}

#[test]
fn jacobian_is_the_ratio_of_solid_angles() {
    for (name, bsdf) in smooth::<4>() {
        for w_e in directions() {
            for mode in MODES {
                let Some(w_l) = bsdf.deflect(w_e, mode, BOTH[0]) else {
                    continue;
                };
                let want = bsdf.specular(w_l, w_e, mode).unwrap().jacobian;
                // Area of the image of a small square around w_e, by central differences in a tangent frame.
                let frame = crate::scatter::Frame::from_normal(w_e);
                let h = 1e-2;
                let at = |x: Real, y: Real| {
                    let w = (w_e + frame.x * x + frame.y * y).normalize();
                    bsdf.deflect(w, mode, BOTH[0]).unwrap()
                };
                let dx = (at(h, 0.0) - at(-h, 0.0)) / (2.0 * h);
                let dy = (at(0.0, h) - at(0.0, -h)) / (2.0 * h);
                let got = dx.cross(dy).length();
                // Truncation h²·(third derivatives, about 1/cos⁴ of either ray); rounding ε/h.
                let c = w_e.z.abs().min(w_l.z.abs());
                let tolerance = h * h * (1.0 + 1.0 / c.powi(4)) + 4.0 * Real::EPSILON / h;
                assert!(
                    (got / want - 1.0).abs() < tolerance,
                    "{name} {mode:?} {w_e}: {got} {want}"
                );
            }
        }
    }
}

/// Mean weight and mean direction of the non-specular samples that go to the side of `to`.
fn towards<const N: usize>(bsdf: &Bsdf<N>, from: Vec3, to: Vec3) -> (Real, Vec3) {
    let mut rng = Rng::new(4, 0, 0, 0);
    let n = 20_000;
    let (mut sum, mut mean) = (0.0, Vec3::ZERO);
    for _ in 0..n {
        let Some(s) = bsdf.sample(from, BOTH[0], rng.next_f32(), rng.next_vec2()) else {
            continue;
        };
        if s.to.z * to.z > 0.0 {
            sum += bsdf.eval(s.to, from)[0] * s.to.z.abs() / s.pdf;
            mean += s.to;
        }
    }
    (sum / n as Real, mean.normalize())
}

#[test]
fn rough_lobes_become_the_smooth_ones() {
    let a = ggx((1e-3, 1e-3));
    let metal = (
        Bsdf::<1>::Conductor(Conductor { index: silver() }),
        Bsdf::<1>::RoughConductor(RoughConductor {
            index: silver(),
            ggx: a,
        }),
    );
    let mut pairs = vec![metal];
    for eta in ETAS {
        pairs.push((
            Bsdf::Dielectric(Dielectric {
                eta,
                dispersive: false,
            }),
            Bsdf::RoughDielectric(RoughDielectric {
                eta,
                ggx: a,
                dispersive: false,
            }),
        ));
    }
    for (smooth, rough) in pairs {
        for from in directions() {
            for mode in MODES {
                let Some(to) = smooth.deflect(from, mode, BOTH[0]) else {
                    continue;
                };
                let want = smooth.specular(to, from, mode).unwrap().value[0];
                let (got, mean) = towards(&rough, from, to);
                let p = smooth.specular(to, from, mode).unwrap().prob_e;
                // The weight is value/prob on a share p of the samples: binomial noise, 5 standard errors; the lobe's
                // width 10⁻³ moves R by less than 10⁻³ per radian times 10 at these angles.
                let noise = want / p * (p * (1.0 - p) / 20_000.0).sqrt();
                assert!(
                    (got - want).abs() < 5.0 * noise + 0.01 * want,
                    "{from} {got} {want}"
                );
                // GGX's tail has mean slope ~ α·ln; refraction at these angles magnifies by less than 5.
                assert!((mean - to).length() < 0.02, "{from} {mode:?} {mean} {to}");
            }
        }
    }
}
