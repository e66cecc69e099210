//! Lobes at the ends of their parameters: roughness from 1 to 10⁻⁵ and 0, indices of 1 and a rounding beside it, the
//! critical angle, directions at the horizon, normals bent below it.

use super::common::scene::{embree, of_text};
use super::common::stats::{Pair, agree};
use super::{all_images, by_length, images_on, scene_of};
use glam::{Vec2, Vec3};
use metrolux::accel::Obvhs;
use metrolux::path::World;
use metrolux::sampling::{Rng, warp};
use metrolux::scatter::{Bsdf, Mode, Transport, shade_material};
use metrolux::scene::material::{ConductorFresnel, Material, Roughness};
use metrolux::scene::spectrum::{Curve, Lanes};
use metrolux::scene::texture::{FloatTexture, SpectrumTexture};

const ALPHAS: [f32; 9] = [1.0, 0.3, 0.05, 0.01, 2e-3, 1.001e-3, 0.999e-3, 1e-5, 0.0];
const INDICES: [f32; 11] = [
    1.0,
    1.0 + 1e-6,
    1.0 - 1e-6,
    1.0 + 1e-4,
    1.01,
    0.99,
    1.33,
    1.5,
    1.0 / 1.5,
    2.4,
    10.0,
];

fn even(alpha: f32) -> Roughness {
    Roughness {
        u: FloatTexture::Constant(alpha),
        v: FloatTexture::Constant(alpha),
        remap: false,
    }
}

fn glass(eta: f32, alpha: f32) -> Bsdf<1> {
    shade(&Material::Dielectric {
        eta: Curve::Constant(eta),
        roughness: even(alpha),
    })
}

fn metal(reflectance: f32, alpha: f32) -> Bsdf<1> {
    shade(&Material::Conductor {
        fresnel: ConductorFresnel::Reflectance(SpectrumTexture::Constant(Curve::Constant(
            reflectance,
        ))),
        roughness: even(alpha),
    })
}

fn shade(m: &Material) -> Bsdf<1> {
    shade_material(m, &[], Vec2::ZERO, &Lanes::new(0.5))
}

/// Every lobe, with the index inside over outside.
fn lobes() -> Vec<(String, f32, Bsdf<1>)> {
    let mut all = Vec::new();
    for a in ALPHAS {
        for r in [0.0, 0.5, 1.0] {
            all.push((format!("metal {r} of roughness {a}"), 1.0, metal(r, a)));
        }
        for eta in INDICES {
            all.push((format!("glass {eta} of roughness {a}"), eta, glass(eta, a)));
            let coat = shade(&Material::CoatedDiffuse {
                reflectance: SpectrumTexture::Constant(Curve::Constant(1.0)),
                eta: Curve::Constant(eta),
                roughness: even(a),
            });
            all.push((format!("coat {eta} of roughness {a}"), 1.0, coat));
        }
    }
    let thin = |eta: f32| {
        shade(&Material::ThinDielectric {
            eta: Curve::Constant(eta),
        })
    };
    all.extend(INDICES.map(|eta| (format!("sheet {eta}"), 1.0, thin(eta))));
    all
}

/// Directions of any elevation, both sides, down to 10⁻³⁰ above the horizon, and around the critical angles.
fn direction(rng: &mut Rng, i: usize) -> Vec3 {
    let side = if rng.next_f32() < 0.5 { 1.0 } else { -1.0 };
    let z = match i % 4 {
        0 => rng.next_f32(),
        1 => 10f32.powf(-8.0 * rng.next_f32()),
        2 => 10f32.powf(-30.0 * rng.next_f32()),
        _ => {
            // sin θ = 1/η of some index, to a few roundings.
            let sin = 1.0 / (1.0 + rng.next_f32().powi(4));
            ((1.0 - sin * sin).max(0.0).sqrt() + 1e-6 * (rng.next_f32() - 0.5)).max(1e-20)
        }
    };
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (s, c) = (std::f32::consts::TAU * rng.next_f32()).sin_cos();
    Vec3::new(r * c, r * s, z * side).normalize()
}

/// Of every lobe, for any pair of directions: values and densities are finite and ≥ 0; a sampled direction is a unit
/// vector whose density is the one stated, to the bit, and is given back a value; and the mean of what sampling returns,
/// the albedo, is not above 1.
#[test]
fn values_and_densities_are_finite_and_agree() {
    for (name, eta, bsdf) in lobes() {
        let mut rng = Rng::new(41, 1000, 0, 0);
        let n_of = |w: Vec3| if w.z > 0.0 { 1.0 } else { eta };
        for i in 0..4000 {
            let from = direction(&mut rng, i);
            let any = direction(&mut rng, i / 4);
            for (l, e) in [(from, any), (any, from)] {
                let v = bsdf.eval(l, e)[0];
                assert!((0.0..f32::INFINITY).contains(&v), "{name}: {l} {e} {v}");
                let p = bsdf.pdf(l, e, Transport::FromLight);
                assert!((0.0..f32::INFINITY).contains(&p), "{name}: {l} {e} {p}");
                for mode in [Mode::Reflect, Mode::Transmit] {
                    if let Some(s) = bsdf.specular(l, e, mode) {
                        let all = [s.value[0], s.prob_e, s.prob_l, s.jacobian];
                        let fine = all.iter().all(|v| (0.0..f32::INFINITY).contains(v));
                        assert!(fine, "{name}: {l} {e} {s:?}");
                    }
                }
            }
            let dir = Transport::FromEye;
            let (uc, u) = (rng.next_f32(), rng.next_vec2());
            let Some(s) = bsdf.sample(from, dir, uc, u) else {
                continue;
            };
            assert!((s.to.length() - 1.0).abs() < 1e-5, "{name}: {from} {s:?}");
            assert!(s.pdf > 0.0 && s.pdf.is_finite(), "{name}: {from} {s:?}");
            if s.mode == Mode::NonSpecular {
                assert_eq!(s.pdf, bsdf.pdf(from, s.to, dir), "{name}: {from} {s:?}");
            } else if let Some(d) = bsdf.specular(s.to, from, s.mode) {
                assert_eq!(s.pdf, d.prob_e, "{name}: {from} {s:?}");
                // Radiance over n² never grows.
                let basic = d.value[0] * (n_of(s.to) / n_of(from)).powi(2) / d.prob_e;
                assert!(basic <= 1.0 + 1e-5, "{name}: {from} {s:?} {basic}");
            }
        }
        for z in [1.0f32, 0.6, 0.05, -0.6, -1e-3] {
            let from = Vec3::new((1.0 - z * z).sqrt(), 0.0, z);
            let (mut sum, mut square) = (0.0, 0.0);
            let n = 4000;
            for _ in 0..n {
                let (uc, u) = (rng.next_f32(), rng.next_vec2());
                let Some(s) = bsdf.sample(from, Transport::FromEye, uc, u) else {
                    continue;
                };
                let value = match s.mode {
                    Mode::NonSpecular => bsdf.eval(s.to, from)[0] * s.to.z.abs(),
                    mode => bsdf.specular(s.to, from, mode).map_or(0.0, |d| d.value[0]),
                };
                let v = f64::from(value / s.pdf * (n_of(s.to) / n_of(from)).powi(2));
                sum += v;
                square += v * v;
            }
            let n = f64::from(n);
            let error = ((square / n - (sum / n).powi(2)).max(0.0) / n).sqrt();
            // 6 standard errors, for some 10³ means, and roundings of the weights.
            assert!(
                sum / n <= 1.0 + 6.0 * error + 1e-3,
                "{name} from {z}: {} ± {error}",
                sum / n
            );
        }
    }
}

/// Where roughness runs out, nothing jumps: just above the threshold of smoothness a lobe returns the light that a mirror
/// or pane returns, into nearly its direction. At α = 10⁻³ normals turn by some 10⁻³, and what a second facet would catch
/// is of that order over the cosine.
#[test]
fn roughness_runs_out_without_a_jump() {
    let make: [(&str, &dyn Fn(f32) -> Bsdf<1>); 4] = [
        ("metal", &|a| metal(0.7, a)),
        ("glass", &|a| glass(1.5, a)),
        ("dense glass", &|a| glass(2.4, a)),
        ("bubble", &|a| glass(1.0 / 1.5, a)),
    ];
    for (name, lobe) in make {
        let (rough, smooth) = (lobe(1.001e-3), lobe(0.0));
        assert!(rough.has_non_specular() && !smooth.has_non_specular());
        for z in [1.0f32, 0.8, 0.5, -0.9] {
            let from = Vec3::new((1.0 - z * z).sqrt(), 0.0, z);
            let mut rng = Rng::new(42, 1000, 0, 0);
            let mut flux = [[0.0f64; 2]; 2];
            let n = 20_000;
            for _ in 0..n {
                let (uc, u) = (rng.next_f32(), rng.next_vec2());
                for (i, b) in [&rough, &smooth].into_iter().enumerate() {
                    // Flux from a light has no factor of the index.
                    let Some(s) = b.sample(from, Transport::FromLight, uc, u) else {
                        continue;
                    };
                    let v = match s.mode {
                        Mode::NonSpecular => b.eval(from, s.to)[0] * s.to.z.abs() / s.pdf,
                        mode => b.specular(from, s.to, mode).map_or(0.0, |d| {
                            d.value[0] * (s.to.z / from.z).abs() / d.jacobian / s.pdf
                        }),
                    };
                    flux[i][(s.to.z * from.z < 0.0) as usize] += f64::from(v) / f64::from(n);
                    let deflected = smooth.deflect(
                        from,
                        if s.to.z * from.z > 0.0 {
                            Mode::Reflect
                        } else {
                            Mode::Transmit
                        },
                        Transport::FromLight,
                    );
                    // GGX has long tails; only most of the light is near.
                    if let Some(d) = deflected
                        && u.x < 0.9
                    {
                        assert!((s.to - d).length() < 0.05, "{name} {z}: {s:?} {d}");
                    }
                }
            }
            for k in 0..2 {
                let d = (flux[0][k] - flux[1][k]).abs();
                // The same choices by `uc`; Fresnel's factor turns with the normal.
                assert!(d < 0.01, "{name} {z}: {flux:?}");
            }
        }
    }
}

/// A sphere of index 1, or a rounding beside it, rough or smooth, is not there: the image is the one without it.
#[test]
fn an_index_of_one_is_no_surface() {
    let scene = |ball: &str| {
        scene_of(&format!(
            r#"Film "rgb" "integer xresolution" 8 "integer yresolution" 8
            Integrator "path" "integer maxdepth" 8
            LookAt 0 -3 1.2  0 0 0.6  0 0 1
            Camera "perspective" "float fov" 40
            WorldBegin
            LightSource "infinite" "rgb L" [ 1 1 1 ]
            {ball}"#
        ))
    };
    for (eta, roughness) in [
        (1.0, 0.0),
        (1.0, 0.5),
        (1.0 + 1e-6, 0.0),
        (1.0 - 1e-6, 0.5),
        (1.0 + 1e-6, 1.0),
        (1.0 + 1e-5, 0.02),
    ] {
        let s = scene(&format!(
            "Translate 0 0 0.6 Material \"dielectric\" \"float eta\" {eta} \"float roughness\" {roughness} \
             Shape \"sphere\" \"float radius\" 0.6"
        ));
        for (name, image) in all_images(&s, 64) {
            if name == "pt" {
                // A constant sky of 1, and radiance over n² keeps to 1 on every path.
                for p in &image {
                    assert!((p[1] - 1.0).abs() < 0.02, "{name} {eta} {roughness}: {p:?}");
                }
            }
        }
    }
}

/// A glass ball with a bubble, with a drop of denser glass in it, surfaces that touch, in a constant sky: clear glass keeps
/// radiance, so that every pixel is 1 but for paths longer than 64.
#[test]
fn nested_glass_keeps_radiance() {
    let scene = scene_of(
        r#"Film "rgb" "integer xresolution" 12 "integer yresolution" 12
        Integrator "path" "integer maxdepth" 64
        LookAt 0 -3 0.2  0 0 0  0 0 1
        Camera "perspective" "float fov" 44
        WorldBegin
        LightSource "infinite" "rgb L" [ 1 1 1 ]
        Material "dielectric" "float eta" 1.5
        Shape "sphere" "float radius" 1
        AttributeBegin
        Translate 0 0 0.5
        Material "dielectric" "float eta" 0.6666667
        Shape "sphere" "float radius" 0.5
        Material "dielectric" "float eta" 2.4
        Shape "sphere" "float radius" 0.25
        AttributeEnd
        Translate 0 0 -0.5
        Material "dielectric" "float eta" 1.2
        Shape "sphere" "float radius" 0.5"#,
    );
    for (name, image) in all_images(&scene, 256) {
        if name == "pt" {
            let mean = image.iter().map(|p| p[1]).sum::<f64>() / image.len() as f64;
            // Every sample brings 1, or 0 where it goes round for more than 64 events; wavelengths stratify to 1 %.
            assert!((mean - 1.0).abs() < 0.01, "{name}: {mean}");
        }
    }
}

/// Interpolated normals bent by up to 100° from the face, below the horizon for many directions: integrators agree.
#[test]
fn bent_normals_lose_nothing_between_integrators() {
    let world = r#"LightSource "point" "rgb I" [ 3 3 3 ] "point3 from" [ -1 -1 1.5 ]
        AreaLightSource "diffuse" "rgb L" [ 2 2 2 ]
        Shape "trianglemesh" "point3 P" [ -0.5 -0.5 2  -0.5 0.5 2  0.5 0.5 2  0.5 -0.5 2 ] "integer indices" [ 0 1 2 0 2 3 ]
        AreaLightSource "diffuse" "rgb L" [ 0 0 0 ]
        Material "diffuse" "rgb reflectance" [ 0.6 0.6 0.6 ]
        Shape "trianglemesh" "point3 P" [ -2 -2 0  2 -2 0  2 2 0  -2 2 0 ] "integer indices" [ 0 1 2 0 2 3 ]
            "normal N" [ -0.98 0 -0.17  0.98 0 -0.17  0 0.9 0.4  0 -0.2 1 ]
        Material "conductor" "rgb reflectance" [ 0.7 0.7 0.7 ] "float roughness" 0.3
        Shape "trianglemesh" "point3 P" [ -2 1 0  2 1 0  2 1 2  -2 1 2 ] "integer indices" [ 0 1 2 0 2 3 ]
            "normal N" [ -0.98 -0.17 0  0.98 -0.17 0  0 -1 0  0 0.17 0.98 ]"#;
    let camera = "LookAt 0.5 -3 1.25  0 0 0.5  0 0 1\nCamera \"perspective\" \"float fov\" 40";
    let scene = of_text(4, camera, world);
    let runs = by_length(&scene, 3, 8);
    let mut pairs = Vec::new();
    for k in 2..=4 {
        for (name, run) in &runs[1..] {
            pairs.push(Pair {
                name: format!("{k} edges, {name} against pt"),
                found: run.length(k..=k),
                reference: runs[0].1.length(k..=k),
                limit: 0.8,
            });
        }
    }
    agree("bent normals", &pairs);
    images_on(&scene, &Obvhs::new(&scene.geometry), 4);
    let accel = embree(&scene);
    assert!(World::new(&scene, &accel, 3).emitters.any);
    let _ = warp::SPHERE_PDF;
}
