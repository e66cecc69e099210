//! What stats.json says of objects that stand in several places.

use crate::scene::Geometry;
use serde::Serialize;

/// Objects that stand in several places.
#[derive(Clone, Debug, Serialize)]
pub struct Instancing {
    objects: usize,
    instances: usize,
    primitives_flattened: u64,
}

impl Instancing {
    /// Of a scene's geometry, if there are any.
    pub fn of(g: &Geometry) -> Option<Self> {
        (!g.instances.is_empty()).then(|| Self {
            objects: g.objects.len(),
            instances: g.instances.len(),
            primitives_flattened: g.flat_count(),
        })
    }
}
