//! Geometry without some of its primitives.

use super::geometry::Geometry;
use super::{Light, Scene};

/// Leaves only the primitives for which `which` holds.
pub(super) fn keep(g: &mut Geometry, which: impl Fn(usize) -> bool) {
    let mut prim = 0..;
    let mut next = || which(prim.next().expect("without end"));
    g.triangles.retain(|_| next());
    g.quadrics.retain(|_| next());
    for list in [&mut g.prim_shape, &mut g.prim_light] {
        let mut prim = 0..;
        list.retain(|_| which(prim.next().expect("without end")));
    }
}

/// Tells the lights the new numbers of their primitives.
pub(super) fn renumber(lights: &mut [Light], g: &Geometry) {
    for (prim, light) in g.prim_light.iter().enumerate() {
        if let Some(Light::Area { prim: p, .. }) = lights.get_mut(*light as usize) {
            *p = prim as u32;
        }
    }
}

/// Leaves out the primitives of the world's shapes for which `gone` holds; they must not be lamps.
pub fn leave_out(scene: &mut Scene, gone: &[bool]) {
    if !gone.contains(&true) {
        return;
    }
    let g = &mut scene.geometry;
    g.facets.take();
    let stays: Vec<bool> = g.prim_shape.iter().map(|s| !gone[*s as usize]).collect();
    keep(g, |prim| stays[prim]);
    renumber(&mut scene.lights, g);
}
