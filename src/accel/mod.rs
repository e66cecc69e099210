//! Who answers rays. A backend names the primitive; distance and barycentrics are recomputed by one routine that all
//! backends share, so they give the same bits wherever they name the same primitive.

mod asked;
pub mod canonical;
pub mod checked;
mod edge;
pub mod embree;
mod fit;
mod levels;
mod monitor;
mod normal;
pub mod obvhs;
mod options;
mod posed;
pub mod quadric;
mod ray_file;
pub mod record;
pub mod referee;
pub mod spawn;
pub mod surface;
#[cfg(test)]
#[cfg_attr(feature = "double", allow(dead_code))]
mod testing;
// Of tracing, which is f32 in either build.
#[cfg(all(test, not(feature = "double")))]
mod tests;
pub mod triangle;

pub use self::obvhs::{Obvhs, ObvhsOptions};
pub use asked::Asked;
pub use canonical::{closest, closest_but};
pub use checked::{Checked, Disagreement};
pub use embree::Embree;
pub use options::{EmbreeError, EmbreeOptions, Quality};
pub use record::Recorder;
pub use spawn::{offset_origin, visible, visible_but};
pub use surface::{Surface, dpdu, surface};

use crate::real::{Convert, Real, Vec3};
use crate::scene::{Geometry, PrimId};

/// A ray o + t·d, 0 < t < t_max. `d` need not be of unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Ray<V = glam::Vec3, T = f32> {
    /// Origin, already moved off its surface.
    pub o: V,
    /// Direction.
    pub d: V,
    /// Far end, in units of |d|; may be infinite.
    pub t_max: T,
}

/// A ray as transport has it; a backend is asked of it in f32.
pub type OwnRay = Ray<Vec3, Real>;

impl OwnRay {
    /// As a backend is asked.
    #[inline(always)]
    pub fn single(&self) -> Ray {
        Ray {
            o: self.o.single(),
            d: self.d.single(),
            t_max: self.t_max.single(),
        }
    }
}

impl Ray {
    /// A backend can be asked of it: a direction that is not 0, and numbers that are no larger than Embree takes.
    pub fn is_fit(&self) -> bool {
        fit::is_fit(self)
    }

    /// As transport has it.
    pub fn own(&self) -> OwnRay {
        Ray {
            o: self.o.real(),
            d: self.d.real(),
            t_max: self.t_max.real(),
        }
    }
}

/// A canonical hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Primitive.
    pub prim: PrimId,
    /// Distance in units of |d|.
    pub t: Real,
    /// Barycentric weight of corner 1 (0 for quadrics).
    pub b1: Real,
    /// Barycentric weight of corner 2 (0 for quadrics).
    pub b2: Real,
    /// The backend named a primitive that the shared routine misses by a rounding; this is its nearest point.
    pub clamped: bool,
}

/// A ray-tracing backend over a scene's geometry.
pub trait Accel: Sync {
    /// The geometry this was built over.
    fn geometry(&self) -> &Geometry;
    /// The nearest primitive along the ray.
    fn nearest(&self, ray: &Ray) -> Option<PrimId>;
    /// Something lies in 0 < t < t_max.
    fn occluded(&self, ray: &Ray) -> bool;
    /// As [`Self::nearest`] as if there were not these two triangles: the slivers that the ray leaves and, perhaps, goes
    /// to. A flat thing is not met again by a line that begins on it, whatever the roundings. Quadrics are not left out.
    /// Only where [`Geometry::leave_out`] was set before the build.
    fn nearest_but(&self, ray: &Ray, but: [PrimId; 2]) -> Option<PrimId>;
    /// The same of [`Self::occluded`].
    fn occluded_but(&self, ray: &Ray, but: [PrimId; 2]) -> bool;
    /// Name and version, for reports.
    fn name(&self) -> String;
    /// Bytes the acceleration structure holds beside the geometry.
    fn memory_bytes(&self) -> usize;
}

impl<A: Accel + ?Sized> Accel for &A {
    fn geometry(&self) -> &Geometry {
        (**self).geometry()
    }
    #[inline]
    fn nearest(&self, ray: &Ray) -> Option<PrimId> {
        (**self).nearest(ray)
    }
    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        (**self).occluded(ray)
    }
    fn nearest_but(&self, ray: &Ray, but: [PrimId; 2]) -> Option<PrimId> {
        (**self).nearest_but(ray, but)
    }
    fn occluded_but(&self, ray: &Ray, but: [PrimId; 2]) -> bool {
        (**self).occluded_but(ray, but)
    }
    fn name(&self) -> String {
        (**self).name()
    }
    fn memory_bytes(&self) -> usize {
        (**self).memory_bytes()
    }
}
