//! The perspective camera: pinhole or thin lens.

use glam::{Mat3, Vec3};

/// A perspective camera. Camera space: x right, y up, z forward (pbrt).
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Lens centre in stored world coordinates.
    pub position: Vec3,
    /// Columns are the unit camera axes in world space (right, up, forward); may be left- or right-handed.
    pub axes: Mat3,
    /// Full image size in pixels.
    pub resolution: [u32; 2],
    /// Pixel rectangle that is rendered: x0, y0, x1, y1 (exclusive end).
    pub crop: [u32; 4],
    /// Window on the plane z = 1 that the full image shows: x_min, x_max, y_min, y_max (pbrt's screen window × tan(fov/2)).
    pub screen: [f32; 4],
    /// Lens radius, 0 for a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane in focus.
    pub focal_distance: f32,
}
