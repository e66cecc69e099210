//! A backend behind a pointer: for work that looks into a run beside it. Renders are compiled for each backend, and nothing they
//! call is shared with this.

use super::{Accel, Ray};
use crate::scene::{Geometry, PrimId};

/// Any backend.
#[derive(Clone, Copy)]
pub struct Asked<'a>(pub &'a dyn Accel);

impl Accel for Asked<'_> {
    fn geometry(&self) -> &Geometry {
        self.0.geometry()
    }

    fn nearest(&self, ray: &Ray) -> Option<PrimId> {
        self.0.nearest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.0.occluded(ray)
    }

    fn nearest_but(&self, ray: &Ray, but: [PrimId; 2]) -> Option<PrimId> {
        self.0.nearest_but(ray, but)
    }

    fn occluded_but(&self, ray: &Ray, but: [PrimId; 2]) -> bool {
        self.0.occluded_but(ray, but)
    }

    fn name(&self) -> String {
        self.0.name()
    }

    fn memory_bytes(&self) -> usize {
        self.0.memory_bytes()
    }
}
