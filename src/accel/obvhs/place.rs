//! Where an object stands, as rays are carried into its space.

use super::super::Ray;
use crate::scene::Instance;
use glam::{Mat3, Vec3};

/// The inverse of an instance's map in f32.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Index of the object.
    pub object: u32,
    inverse: Mat3,
    translation: Vec3,
}

impl Place {
    /// Of an instance.
    pub fn new(instance: &Instance) -> Self {
        Self {
            object: instance.object,
            inverse: instance.linear.as_dmat3().inverse().as_mat3(),
            translation: instance.translation,
        }
    }

    /// The ray in the object's space; distances along it stay. It errs less than [`Instance::new`] allows: the inverse is
    /// rounded once, and what is far from the world's origin cancels before it is multiplied.
    #[inline(always)]
    pub fn carry(&self, ray: &Ray) -> Ray {
        Ray {
            o: self.inverse * (ray.o - self.translation),
            d: self.inverse * ray.d,
            t_max: ray.t_max,
        }
    }
}
