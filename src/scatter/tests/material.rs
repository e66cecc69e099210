//! From material to lobe.

use super::*;
use crate::real::{Convert, Real, Vec2};
use crate::scatter::mix::resolve_in;
use crate::scatter::{Mode, shade_material};
use crate::scene::Material;
use crate::scene::material::{ConductorFresnel, Roughness};
use crate::scene::spectrum::{Curve, Lanes};
use crate::scene::texture::{FloatTexture, SpectrumTexture};
use std::sync::Arc;

fn lanes<const N: usize>() -> Lanes<N> {
    Lanes {
        u: 0.5,
        lambda: std::array::from_fn(|i| 450.0 + 60.0 * i as Real),
        xyz: [Spectrum::ZERO; 3],
        target: Spectrum::ZERO,
    }
}

fn roughness(u: f32, v: f32, remap: bool) -> Roughness {
    Roughness {
        u: FloatTexture::Constant(u),
        v: FloatTexture::Constant(v),
        remap,
    }
}

fn of(m: &Material) -> Bsdf<4> {
    shade_material(m, &[], Vec2::ZERO, &lanes())
}

/// f(λ) at 360, 361 … 830 nm.
fn table(f: impl Fn(Real) -> Real) -> Curve {
    Curve::Table {
        scale: 1.0,
        table: Arc::new((0..471).map(|i| f(360.0 + i as Real).single()).collect()),
    }
}

fn glass(eta: Curve, r: Roughness) -> Material {
    Material::Dielectric { eta, roughness: r }
}

#[test]
fn smooth_and_rough_part_at_the_threshold_on_alpha() {
    let at = |u, v, remap| of(&glass(Curve::Constant(1.5), roughness(u, v, remap)));
    assert!(matches!(at(0.0, 0.0, false), Bsdf::Dielectric(_)));
    assert!(matches!(at(9e-4, 9e-4, false), Bsdf::Dielectric(_)));
    assert!(matches!(at(9e-4, 0.1, false), Bsdf::RoughDielectric(_)));
    // α = √(9·10⁻⁴) = 0.03.
    match at(9e-4, 9e-4, true) {
        Bsdf::RoughDielectric(d) => assert!((d.ggx.ax - 0.03).abs() < 1e-7),
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_interface_of_index_one_passes_everything_whatever_its_roughness() {
    for eta in [0.0, 1.0] {
        match of(&glass(Curve::Constant(eta), roughness(0.5, 0.5, false))) {
            Bsdf::Dielectric(d) => assert_eq!(d.eta, 1.0),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn an_index_that_varies_disperses_and_lane_zero_bends() {
    let flint = table(|l| 1.7 - 1e-4 * (l - 360.0));
    for r in [0.0, 0.2] {
        let b = of(&glass(flint.clone(), roughness(r, r, false)));
        assert!(b.is_dispersive());
        let eta = match b {
            Bsdf::Dielectric(d) => d.eta,
            Bsdf::RoughDielectric(d) => d.eta,
            other => panic!("{other:?}"),
        };
        assert!((eta - 1.691).abs() < 1e-6);
        assert!(!of(&glass(Curve::Constant(1.5), roughness(r, r, false))).is_dispersive());
    }
    let sheet = of(&Material::ThinDielectric { eta: flint });
    assert!(!sheet.is_dispersive());
    let r = sheet.specular(Vec3::Z, Vec3::Z, Mode::Reflect).unwrap();
    assert!(r.value[3] < r.value[0]);
}

#[test]
fn metals_keep_their_lanes() {
    let m = Material::Conductor {
        fresnel: ConductorFresnel::EtaK {
            eta: table(|l| l / 1000.0),
            k: Curve::Constant(3.0),
        },
        roughness: roughness(0.0, 0.0, false),
    };
    let s = of(&m).specular(Vec3::Z, Vec3::Z, Mode::Reflect).unwrap();
    for (lane, l) in lanes::<4>().lambda.into_iter().enumerate() {
        let n = l / 1000.0;
        let want = ((n - 1.0).powi(2) + 9.0) / ((n + 1.0).powi(2) + 9.0);
        assert!((s.value[lane] - want).abs() < 1e-6);
    }
    assert_eq!((s.prob_e, s.prob_l), (1.0, 1.0));

    let m = Material::Conductor {
        fresnel: ConductorFresnel::Reflectance(SpectrumTexture::Constant(Curve::Constant(0.7))),
        roughness: roughness(0.0, 0.0, false),
    };
    let s = of(&m).specular(Vec3::Z, Vec3::Z, Mode::Reflect).unwrap();
    assert!((s.value[2] - 0.7).abs() < 1e-6);
}

#[test]
fn albedo_is_held_below_one() {
    let m = Material::Diffuse {
        reflectance: SpectrumTexture::Constant(Curve::Constant(1.5)),
    };
    let f = of(&m).eval(Vec3::Z, Vec3::Z)[0];
    assert_eq!(f, crate::real::consts::FRAC_1_PI);
}

#[test]
fn mixes_come_down_to_one_material_in_the_stated_share() {
    let diffuse = |r| Material::Diffuse {
        reflectance: SpectrumTexture::Constant(Curve::Constant(r)),
    };
    let mix = |amount, a, b| Material::Mix {
        amount: FloatTexture::Constant(amount),
        a,
        b,
    };
    // 3 chooses 1 with probability 0.25, else 2, which chooses 1 with probability 0.4.
    let materials = [diffuse(0.1), diffuse(0.9), mix(0.4, 0, 1), mix(0.25, 2, 1)];
    let n = 40_000;
    let mut ones = 0;
    for i in 0..n {
        let p = Vec3::new(i as Real * 0.01, 1.0, -2.0);
        let leaf = resolve_in(&materials, &[], 3, Vec2::ZERO, p);
        assert!(leaf < 2);
        assert_eq!(leaf, resolve_in(&materials, &[], 3, Vec2::ZERO, p));
        ones += leaf;
    }
    let p = 0.25 + 0.75 * 0.4;
    let se = (p * (1.0 - p) * f64::from(n)).sqrt();
    assert!((f64::from(ones) - p * f64::from(n)).abs() < 4.0 * se);

    let sure = [diffuse(0.1), diffuse(0.9), mix(0.0, 0, 1), mix(1.0, 0, 1)];
    assert_eq!(resolve_in(&sure, &[], 2, Vec2::ZERO, Vec3::ONE), 0);
    assert_eq!(resolve_in(&sure, &[], 3, Vec2::ZERO, Vec3::ONE), 1);
    assert_eq!(resolve_in(&sure, &[], 0, Vec2::ZERO, Vec3::ONE), 0);
    let circle = [mix(0.5, 0, 0)];
    assert_eq!(
        resolve_in(&circle, &[], 0, Vec2::ZERO, Vec3::ONE),
        crate::scene::NONE
    );
}
