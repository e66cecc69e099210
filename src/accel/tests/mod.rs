//! The promises of the room, kept by both backends.

mod agreement;
mod checking;
mod edges;
mod instances;
mod leaving;
mod leaving_out;
mod library;

use super::testing::Rng;
use super::{Embree, EmbreeOptions, Ray};
use crate::scene::{Geometry, PrimId};
use glam::Vec3;

fn embree(geometry: &Geometry) -> Embree<'_> {
    Embree::new(geometry, EmbreeOptions::default()).expect("builds")
}

fn to_infinity(o: Vec3, d: Vec3) -> Ray {
    Ray {
        o,
        d,
        t_max: f32::INFINITY,
    }
}

/// A ray from in or around the unit cube into it.
fn random_ray(rng: &mut Rng) -> Ray {
    let (o, target) = (rng.vec3() * 2.0 - 0.5, rng.vec3());
    to_infinity(o, target - o)
}
