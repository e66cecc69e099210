//! What a backend may take for granted about geometry, and the boxes it may build with.

use super::Ray;
use crate::scene::instance::MOST_INSTANCES;
use crate::scene::{Geometry, Quadric};
use glam::{DVec3, Vec3};

/// Refuses what a C library would read out of bounds or silently leave out; says what that is.
pub(super) fn validate(geometry: &Geometry) -> Result<(), String> {
    validate_part(geometry)?;
    for (i, object) in geometry.objects.iter().enumerate() {
        validate_part(object).map_err(|e| format!("object {i}: {e}"))?;
        if !object.objects.is_empty() || !object.instances.is_empty() {
            return Err(format!("object {i} holds objects"));
        }
    }
    // Primitives and instances are numbered together in 32 bits.
    let instances = geometry.instances.len();
    let numbers = geometry.prim_count() + instances;
    if numbers >= u32::MAX as usize || instances > MOST_INSTANCES as usize {
        return Err(format!("{instances} instances"));
    }
    let boxes: Vec<_> = geometry.objects.iter().map(Geometry::bounds).collect();
    for (i, instance) in geometry.instances.iter().enumerate() {
        let Some(bounds) = boxes.get(instance.object as usize) else {
            return Err(format!("instance {i} is of object {}", instance.object));
        };
        let whole = instance.linear.is_finite() && instance.translation.is_finite();
        let (_, det) = instance.cofactors();
        let inside = bounds.is_none_or(|b| {
            let (lo, hi) = instance.bounds(b);
            sane(lo.as_vec3()) && sane(hi.as_vec3())
        });
        if !whole || det == 0.0 || !inside {
            return Err(format!(
                "instance {i} has the transform {:?}",
                instance.to_world()
            ));
        }
    }
    Ok(())
}

/// Embree drops triangles beyond this magnitude (its FLT_LARGE) without a word.
fn sane(p: Vec3) -> bool {
    p.is_finite() && p.abs().max_element() < 1.8e18
}

/// Embree ends the process on others.
pub(super) fn is_fit(ray: &Ray) -> bool {
    sane(ray.o) && sane(ray.d) && ray.d != Vec3::ZERO && !ray.t_max.is_nan()
}

fn validate_part(geometry: &Geometry) -> Result<(), String> {
    // The last position is the spare one.
    let usable = geometry.positions.len().saturating_sub(1);
    for (i, t) in geometry.triangles.iter().enumerate() {
        if let Some(v) = t.iter().find(|v| **v as usize >= usable) {
            return Err(format!(
                "triangle {i} names vertex {v} of {usable} (beside one spare)"
            ));
        }
    }
    if u32::try_from(geometry.prim_count()).is_err() || geometry.prim_count() == u32::MAX as usize {
        return Err(format!("{} primitives", geometry.prim_count()));
    }
    if let Some(i) = geometry.positions.iter().position(|p| !sane(*p)) {
        return Err(format!("vertex {i} is {}", geometry.positions[i]));
    }
    for (i, q) in geometry.quadrics.iter().enumerate() {
        let (Quadric::Sphere { center, radius, .. } | Quadric::Disk { center, radius, .. }) = q;
        if !sane(*center) || !sane(Vec3::splat(*radius)) {
            return Err(format!("quadric {i} at {center} has radius {radius}"));
        }
    }
    Ok(())
}

/// Bounds that hold the primitive although they were rounded.
pub(super) fn padded_bounds(geometry: &Geometry, prim: u32) -> (Vec3, Vec3) {
    let (lo, hi) = match geometry.quadric(prim) {
        None => return geometry.prim_bounds(prim),
        Some(Quadric::Sphere { .. }) => geometry.prim_bounds(prim),
        Some(Quadric::Disk {
            center,
            normal,
            radius,
            ..
        }) => {
            // √(1 − n²) of a nearly axis-parallel normal loses the tilt; the other two components keep it.
            let n = normal.as_dvec3();
            let across = DVec3::new(n.y.hypot(n.z), n.z.hypot(n.x), n.x.hypot(n.y));
            let e = (across * (*radius as f64 / n.length())).as_vec3();
            (*center - e, *center + e)
        }
    };
    // Two roundings of numbers no larger than this: of the half width, and of centre ± half width.
    let pad = lo.abs().max(hi.abs()) * (2.0 * f32::EPSILON);
    (lo - pad, hi + pad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::testing::geometry;

    #[test]
    fn the_box_of_a_slightly_tilted_disk_holds_its_rim() {
        // A tilt of 10⁻⁴ is lost in 1 − n_z², which rounds to 0.
        let normal = Vec3::new(1e-4, 0.0, 1.0);
        let disk = Quadric::Disk {
            center: Vec3::ZERO,
            normal,
            tangent: Vec3::Y,
            radius: 1.0,
        };
        let (_, hi) = padded_bounds(&geometry(vec![], vec![], vec![disk]), 0);
        assert!(hi.z >= 1e-4 * (1.0 - 1e-7) && hi.z < 1.1e-4, "{hi}");
    }
}
