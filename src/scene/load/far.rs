//! How far a scene may reach: squares of lengths, and the backends, need room in 32-bit floats.

use super::error::{Location, Result, SceneError};
use super::place::World;
use glam::DVec3;

/// The largest coordinate beside the stored origin. Embree ends the process on a ray that begins beyond 1.8·10¹⁸, and rays
/// of lights at infinity begin a few radii of the scene from it.
pub(super) const FARTHEST: f64 = 1e17;

/// Refuses a point too far from the stored origin.
pub(super) fn within(p: DVec3, at: &Location) -> Result<()> {
    if p.abs().max_element() <= FARTHEST {
        return Ok(());
    }
    let e = SceneError::value(at, "this lies too far from the rest of the scene");
    Err(e
        .found(format!("{:e} units", p.abs().max_element()))
        .expected(format!("at most {FARTHEST:e}")))
}

/// Refuses shapes of the world that reach too far.
pub(super) fn reaches(world: &World, origin: DVec3) -> Result<()> {
    let at = |owner: &(u32, u32)| &world.shape_places[owner.0 as usize].1;
    for (corners, owner) in world.triangles.iter().zip(&world.triangle_owner) {
        for i in corners {
            within(world.positions[*i as usize] - origin, at(owner))?;
        }
    }
    for (q, owner) in world.quadrics.iter().zip(&world.quadric_owner) {
        let (c, r) = q.bounds();
        within((c - origin).abs() + r, at(owner))?;
    }
    Ok(())
}
