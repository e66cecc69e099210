//! Whether a pinhole lies on a surface: what it would see there is at distance 0, where no geometry term is finite.

use super::{Start, Tally, World, follow};
use crate::accel::{Accel, surface};
use crate::real::{Real, Vec2};
use crate::scene::PrimId;

/// Rays through so many columns and rows of the image look for it.
const LOOKS: u32 = 32;
/// Roundings of the eye's coordinates that may lie between it and the surface, beside the error of the surface's.
const ROUNDINGS: Real = 4.0;

/// The surface that the eye lies on and looks through, if there is one. A lens with an area has no such point: its own are
/// on a surface with probability 0.
pub fn eye_on_surface<A: Accel>(world: &World<A>, tally: &mut Tally) -> Option<PrimId> {
    let lens = &world.lens;
    if lens.has_aperture() {
        return None;
    }
    let eye = lens.sample_vertex::<1>(Vec2::ZERO).p;
    let within = ROUNDINGS * f32::EPSILON as Real * eye.abs().max_element();
    let all = (0..LOOKS * LOOKS).map(|i| {
        let at = Vec2::new((i % LOOKS) as Real + 0.5, (i / LOOKS) as Real + 0.5);
        lens.direction(eye, lens.sample_raster(at / LOOKS as Real))
    });
    let mut near = all.filter_map(|w| {
        tally.rays_closest += 1;
        let (ray, hit) = follow(world, Start::at(eye), w);
        let hit = hit?;
        let s = surface(&world.scene.geometry, &hit, &ray);
        let apart = (s.p - eye).abs().max_element();
        (apart <= within + s.error).then_some(hit.prim)
    });
    near.next()
}
