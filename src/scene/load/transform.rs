//! pbrt's transforms in double precision, so that a scene far from the origin keeps its digits.

use glam::{DMat3, DMat4, DVec3};

/// `LookAt`: world → camera. The camera looks along +z, with x to the right: left-handed, as in pbrt.
/// `None` where eye and target coincide or `up` is parallel to the line of sight.
pub(super) fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> Option<DMat4> {
    let forward = (target - eye).try_normalize()?;
    let up = up.try_normalize()?;
    let right = up.cross(forward);
    // Same bound as `singular`: below it the direction of `right` is noise.
    if right.length_squared() < 1e-24 {
        return None;
    }
    let right = right.normalize();
    let up = forward.cross(right);
    let to_world = DMat4::from_cols(
        right.extend(0.0),
        up.extend(0.0),
        forward.extend(0.0),
        eye.extend(1.0),
    );
    Some(to_world.inverse())
}

/// `Rotate angle x y z`, angle in degrees.
pub(super) fn rotate(degrees: f64, axis: DVec3) -> Option<DMat4> {
    Some(DMat4::from_axis_angle(
        axis.try_normalize()?,
        degrees.to_radians(),
    ))
}

/// The columns span no volume: |det| is rounding noise beside the product of the column lengths.
pub(super) fn singular(m: &DMat4) -> bool {
    let m = DMat3::from_mat4(*m);
    let lengths = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    let det = m.determinant().abs();
    !(det.is_finite() && det > 1e-12 * lengths)
}

/// Not an affine map: the last row is not 0 0 0 1.
pub(super) fn projective(m: &DMat4) -> bool {
    m.row(3) != glam::DVec4::W
}

/// The map mirrors.
pub(super) fn mirrors(m: &DMat4) -> bool {
    DMat3::from_mat4(*m).determinant() < 0.0
}

/// Inverse transpose of the linear part: how normals go.
pub(super) fn normal_matrix(m: &DMat4) -> DMat3 {
    DMat3::from_mat4(*m).inverse().transpose()
}

/// The factor, if the linear part is a rotation or reflection times one factor.
///
/// Scene files write rotations with 6 to 7 digits, so 10⁻⁵ is what "the same length" can mean.
pub(in crate::scene) fn uniform_scale(m: &DMat4) -> Option<f64> {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.truncate());
    let s = (x.length() + y.length() + z.length()) / 3.0;
    let same = |v: f64| (v - s).abs() <= 1e-5 * s;
    let right = |a: DVec3, b: DVec3| a.dot(b).abs() <= 1e-5 * s * s;
    (same(x.length())
        && same(y.length())
        && same(z.length())
        && right(x, y)
        && right(y, z)
        && right(z, x))
    .then_some(s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn look_at_puts_the_eye_at_the_origin_and_the_target_ahead() {
        let m = look_at(
            DVec3::new(1.0, 2.0, 3.0),
            DVec3::new(1.0, 2.0, 8.0),
            DVec3::Y,
        )
        .unwrap();
        assert!(m.transform_point3(DVec3::new(1.0, 2.0, 3.0)).length() < 1e-12);
        let ahead = m.transform_point3(DVec3::new(1.0, 2.0, 8.0));
        assert!((ahead - DVec3::new(0.0, 0.0, 5.0)).length() < 1e-12);
        // Looking along +z with y up, x is to the right: this is the left-handed convention.
        let right = m.transform_vector3(DVec3::X);
        assert!((right - DVec3::X).length() < 1e-12);
        assert!(look_at(DVec3::ZERO, DVec3::Y, DVec3::Y).is_none());
    }

    #[test]
    fn scale_of_a_rotation_is_found_and_shear_is_not() {
        let r = rotate(30.0, DVec3::new(1.0, 2.0, -1.0)).unwrap();
        let m = r * DMat4::from_scale(DVec3::splat(2.5));
        assert!((uniform_scale(&m).unwrap() - 2.5).abs() < 1e-12);
        assert!(uniform_scale(&(m * DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)))).is_some());
        assert!(uniform_scale(&DMat4::from_scale(DVec3::new(1.0, 1.0, 1.01))).is_none());
        assert!(singular(&DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0))));
        assert!(!singular(&DMat4::from_scale(DVec3::splat(1e-9))));
    }
}
