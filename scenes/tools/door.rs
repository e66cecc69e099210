//! The door: a leaf on the left jamb, a little open towards the camera, with frame, knobs and hinges.

use super::lathe::{Piece, revolve};
use super::mesh::Mesh;
use super::trig::cos_sin_turns;
use glam::{DAffine3, DMat3, DVec2, DVec3};

/// Left side of the doorway; the hinges are at (LEFT, 0).
pub const LEFT: f64 = 0.9;
/// Right side of the doorway, where the slit is.
pub const RIGHT: f64 = 1.8;
/// Height of the doorway.
pub const HEIGHT: f64 = 2.05;
/// Thickness of the leaf.
const THICKNESS: f64 = 0.04;
/// How far the door is open, in turns.
const OPEN_TURNS: f64 = 9.0 / 360.0;

/// From the leaf's frame (x along the leaf, y through it, away from the camera, z up) to the world.
fn placement() -> DAffine3 {
    let (c, s) = cos_sin_turns(OPEN_TURNS);
    let rotate = DMat3::from_cols(DVec3::new(c, -s, 0.0), DVec3::new(s, c, 0.0), DVec3::Z);
    DAffine3::from_mat3_translation(rotate, DVec3::new(LEFT, -0.001, 0.0))
}

/// The far edge of the leaf that bounds the slit, on the floor.
fn slit_edge() -> DVec3 {
    placement().transform_point3(DVec3::new(0.896, THICKNESS, 0.0))
}

/// On the camera's side of the plane of the leaf's near face.
#[cfg(test)]
pub fn in_front(p: DVec3) -> bool {
    placement().inverse().transform_point3(p).y < 0.0
}

/// The leaf with raised panels on the near side. Its hinge edge, foot and head reach a little into jamb, floor and
/// lintel: only the slit and the wedge above it let light through.
pub fn leaf() -> Mesh {
    let mut leaf = Mesh::default();
    leaf.block([-0.004, 0.0, -0.005], [0.896, THICKNESS, HEIGHT + 0.002]);
    for (z0, z1) in [(0.16, 0.82), (1.06, 1.9)] {
        for (x0, x1) in [(0.11, 0.415), (0.48, 0.785)] {
            leaf.block([x0, -0.008, z0], [x1, 0.01, z1]);
            leaf.block([x0 + 0.03, -0.014, z0 + 0.03], [x1 - 0.03, 0.01, z1 - 0.03]);
        }
    }
    leaf.moved(&placement())
}

/// Casing around the doorway on the near side and skirting boards left and right of it.
pub fn frame(room_left: f64, room_right: f64) -> Mesh {
    let mut m = Mesh::default();
    let (w, d) = (0.075, 0.016);
    m.block(
        [LEFT - 0.008 - w, -d, -0.01],
        [LEFT - 0.008, 0.02, HEIGHT + 0.01],
    );
    m.block(
        [RIGHT + 0.008, -d, -0.01],
        [RIGHT + 0.008 + w, 0.02, HEIGHT + 0.01],
    );
    m.block(
        [LEFT - 0.008 - w, -d, HEIGHT + 0.01],
        [RIGHT + 0.008 + w, 0.02, HEIGHT + 0.01 + w],
    );
    m.block(
        [room_left - 0.01, -0.012, -0.01],
        [LEFT - 0.02 - w, 0.02, 0.09],
    );
    m.block(
        [RIGHT + 0.02 + w, -0.012, -0.01],
        [room_right + 0.01, 0.02, 0.09],
    );
    m
}

/// A knob on either side of the leaf and three hinges.
pub fn fittings() -> Mesh {
    let p = |r: f64, z: f64| DVec2::new(r, z);
    // Along the axis away from the leaf: rosette, neck, ball.
    let knob = revolve(
        &[
            Piece::Line(p(0.0, -0.004), p(0.03, -0.004)),
            Piece::Line(p(0.03, -0.004), p(0.03, 0.005)),
            Piece::Line(p(0.03, 0.005), p(0.011, 0.008)),
            Piece::Curve(
                [
                    p(0.011, 0.008),
                    p(0.009, 0.02),
                    p(0.009, 0.026),
                    p(0.016, 0.032),
                ],
                8,
            ),
            Piece::Curve(
                [
                    p(0.016, 0.032),
                    p(0.034, 0.038),
                    p(0.034, 0.066),
                    p(0.0, 0.068),
                ],
                16,
            ),
        ],
        48,
    );
    let mut m = Mesh::default();
    let near = DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y);
    let far = DMat3::from_cols(DVec3::X, -DVec3::Z, DVec3::Y);
    for (turn, y) in [(near, 0.0), (far, THICKNESS)] {
        let on_leaf = DAffine3::from_mat3_translation(turn, DVec3::new(0.835, y, 0.98));
        m.append(&knob.moved(&(placement() * on_leaf)));
    }
    let barrel = revolve(
        &[
            Piece::Line(p(0.0, 0.0), p(0.007, 0.0)),
            Piece::Line(p(0.007, 0.0), p(0.007, 0.1)),
            Piece::Line(p(0.007, 0.1), p(0.0, 0.1)),
        ],
        24,
    );
    for z in [0.2, 0.98, 1.76] {
        let at = DVec3::new(LEFT - 0.002, -0.006, z);
        m.append(&barrel.moved(&DAffine3::from_translation(at)));
    }
    m
}

/// What closes the opening for measuring: the upright slit and the wedge under the lintel, facing the far room.
pub fn opening() -> Mesh {
    let edge = slit_edge();
    let up = DVec3::Z * HEIGHT;
    let jamb = DVec3::new(RIGHT, 0.0, 0.0);
    let (c, s) = cos_sin_turns(OPEN_TURNS);
    // Where the far face of the leaf leaves the doorway.
    let leaves = DVec3::new(
        LEFT + (THICKNESS * c - 0.001) * c / s + THICKNESS * s,
        0.0,
        0.0,
    );
    let mut m = Mesh::default();
    m.quad([edge, edge + up, jamb + up, jamb]);
    let base = m.positions.len() as u32;
    m.positions.extend([edge + up, leaves + up, jamb + up]);
    m.triangles.push([base, base + 1, base + 2]);
    m
}
