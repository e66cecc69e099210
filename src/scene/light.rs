//! Emitters as data.

use super::spectrum::Curve;
use glam::{Mat3, Vec3};

/// One emitter. Radiance in W·m⁻²·sr⁻¹·nm⁻¹, intensity in W·sr⁻¹·nm⁻¹, scaled as pbrt-v4 scales them.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Diffuse emission from one primitive.
    Area {
        /// Primitive index.
        prim: u32,
        /// Emits on both sides.
        two_sided: bool,
        /// Radiance.
        radiance: Curve,
    },
    /// Isotropic point.
    Point {
        /// Position.
        position: Vec3,
        /// Radiant intensity.
        intensity: Curve,
    },
    /// Point with a cone; falls off smoothly (pbrt-v4's smoothstep of the cosine).
    Spot {
        /// Position.
        position: Vec3,
        /// Unit axis.
        direction: Vec3,
        /// Cosine where the falloff begins.
        cos_start: f32,
        /// Cosine of the cone's edge.
        cos_end: f32,
        /// Radiant intensity on the axis.
        intensity: Curve,
    },
    /// Parallel light.
    Distant {
        /// Unit direction the light travels.
        direction: Vec3,
        /// Radiance coefficient of the delta: irradiance on a facing plane.
        irradiance: Curve,
    },
    /// The same radiance from every direction at infinity.
    InfiniteConstant {
        /// Radiance.
        radiance: Curve,
    },
    /// Radiance from an equal-area octahedral map.
    InfiniteImage {
        /// Index into `Scene::images` (square, RGB illuminants).
        image: u32,
        /// Rotation light space → world.
        to_world: Mat3,
        /// Radiance = scale · RGB on the illuminant's shape.
        illuminant: Curve,
    },
}
