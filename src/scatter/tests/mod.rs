//! Properties every lobe must have, each over the same set of lobes.

mod chi_square;
mod coat;
mod energy;
mod material;
mod reciprocity;
mod specular;

use super::coated::CoatedDiffuse;
use super::conductor::{Conductor, Index, RoughConductor};
use super::dielectric::Dielectric;
use super::diffuse::Diffuse;
use super::ggx::Ggx;
use super::rough_dielectric::RoughDielectric;
use super::thin_dielectric::ThinDielectric;
use super::{Bsdf, Transport};
use crate::real::{Real, Vec3};
use crate::scene::spectrum::Spectrum;

/// Both ends a sub-path may come from.
const BOTH: [Transport; 2] = [Transport::FromEye, Transport::FromLight];

/// α pairs of the rough lobes, from nearly smooth to the end of the range.
const ALPHAS: [(Real, Real); 5] = [
    (0.02, 0.02),
    (0.1, 0.1),
    (0.3, 0.3),
    (0.08, 0.4),
    (0.9, 0.9),
];

/// Indices of the dielectrics, one with the denser medium outside.
const ETAS: [Real; 3] = [1.5, 1.0 / 1.5, 2.4];

fn ggx((x, y): (Real, Real)) -> Ggx {
    Ggx::new(x, y).expect("rough")
}

/// Lanes that differ, so that a lane taken for another shows.
fn ramp<const N: usize>(first: Real, step: Real) -> Spectrum<N> {
    Spectrum::from_fn(|i| first + step * i as Real)
}

fn silver<const N: usize>() -> Index<N> {
    Index {
        eta: ramp(0.05, 0.03).0,
        k: ramp(2.0, 0.7).0,
    }
}

/// Lobes without a delta, with names for messages.
fn rough<const N: usize>() -> Vec<(String, Bsdf<N>)> {
    let mut v = vec![(
        "diffuse".to_string(),
        Bsdf::Diffuse(Diffuse::new(ramp(0.5, 0.1))),
    )];
    for a in ALPHAS {
        v.push((
            format!("conductor {a:?}"),
            Bsdf::RoughConductor(RoughConductor {
                index: silver(),
                ggx: ggx(a),
            }),
        ));
        for eta in ETAS {
            v.push((
                format!("dielectric {a:?} {eta}"),
                Bsdf::RoughDielectric(RoughDielectric {
                    eta,
                    ggx: ggx(a),
                    dispersive: false,
                }),
            ));
        }
        v.push((
            format!("coated {a:?}"),
            Bsdf::CoatedDiffuse(CoatedDiffuse::new(ramp(0.2, 0.2), 1.5, Some(ggx(a)), false)),
        ));
    }
    v
}

/// Lobes with a delta.
fn smooth<const N: usize>() -> Vec<(String, Bsdf<N>)> {
    let mut v = vec![
        (
            "conductor".to_string(),
            Bsdf::Conductor(Conductor { index: silver() }),
        ),
        (
            "thin".to_string(),
            Bsdf::ThinDielectric(ThinDielectric {
                eta: ramp(1.5, 0.02).0,
            }),
        ),
        (
            "coated".to_string(),
            Bsdf::CoatedDiffuse(CoatedDiffuse::new(ramp(0.2, 0.2), 1.5, None, false)),
        ),
        (
            "no interface".to_string(),
            Bsdf::Dielectric(Dielectric {
                eta: 1.0,
                dispersive: false,
            }),
        ),
    ];
    for eta in ETAS {
        v.push((
            format!("dielectric {eta}"),
            Bsdf::Dielectric(Dielectric {
                eta,
                dispersive: false,
            }),
        ));
    }
    v
}

/// Directions from normal to grazing incidence, on both sides.
fn directions() -> [Vec3; 5] {
    [
        (1.0, 0.0),
        (0.7, 0.4),
        (0.2, 2.0),
        (-0.55, 1.0),
        (-0.97, 4.0),
    ]
    .map(|(z, phi): (Real, Real)| {
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    })
}

/// (n_l/n_e)² of a pair: turns f_s for radiance into f_s for basic radiance L/n².
fn basic<const N: usize>(bsdf: &Bsdf<N>, w_l: Vec3, w_e: Vec3) -> Real {
    let eta = match bsdf {
        Bsdf::Dielectric(d) => d.eta,
        Bsdf::RoughDielectric(d) => d.eta,
        _ => 1.0,
    };
    let n = |w: Vec3| if w.z > 0.0 { 1.0 } else { eta };
    (n(w_l) / n(w_e)).powi(2)
}

/// (w_l, w_e) of a sampled pair.
fn ends(from: Vec3, to: Vec3, dir: Transport) -> (Vec3, Vec3) {
    match dir {
        Transport::FromEye => (to, from),
        Transport::FromLight => (from, to),
    }
}
