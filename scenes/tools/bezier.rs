//! Cubic Bézier curves.

use std::ops::{Add, Mul};

/// Point at `t` of the cubic with control points `p`; exact at both ends.
pub fn point<V: Copy + Add<Output = V> + Mul<f64, Output = V>>(p: &[V; 4], t: f64) -> V {
    let u = 1.0 - t;
    p[0] * (u * u * u) + p[1] * (3.0 * u * u * t) + p[2] * (3.0 * u * t * t) + p[3] * (t * t * t)
}

/// First derivative at `t`.
pub fn derivative<V: Copy + Add<Output = V> + Mul<f64, Output = V>>(p: &[V; 4], t: f64) -> V {
    let u = 1.0 - t;
    p[0] * (-3.0 * u * u)
        + p[1] * (3.0 * u * u - 6.0 * u * t)
        + p[2] * (6.0 * u * t - 3.0 * t * t)
        + p[3] * (3.0 * t * t)
}
