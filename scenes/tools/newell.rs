//! Martin Newell's control points of the Utah teapot (1975), as published with 32 bicubic patches.
//!
//! Rim, body, lid and bottom are given by the profile they are turned from; of handle and spout there is one half
//! (y ≤ 0), the other being its mirror image.

/// A cubic profile as (radius, height).
pub type Cubic = [(f64, f64); 4];
/// Control points of a patch, `[along][across]`.
pub type Patch = [[[f64; 3]; 4]; 4];

/// Bottom, from the axis outward.
pub const BOTTOM: Cubic = [(0.0, 0.0), (1.425, 0.0), (1.5, 0.075), (1.5, 0.15)];
/// Lower half of the body, upward.
pub const BODY_LOWER: Cubic = [(1.5, 0.15), (1.5, 0.225), (2.0, 0.45), (2.0, 0.9)];
/// Upper half of the body, upward.
pub const BODY_UPPER: Cubic = [(2.0, 0.9), (2.0, 1.35), (1.75, 1.875), (1.5, 2.4)];
/// Rim, from the outside to the inside.
pub const RIM: Cubic = [(1.5, 2.4), (1.4375, 2.53125), (1.3375, 2.53125), (1.4, 2.4)];
/// Lid, from its edge to the knob.
pub const LID: Cubic = [(1.3, 2.4), (1.3, 2.55), (0.4, 2.55), (0.2, 2.7)];
/// Knob, from the lid to the tip.
pub const KNOB: Cubic = [(0.2, 2.7), (0.0, 2.85), (0.8, 3.15), (0.0, 3.15)];

/// Handle, from the upper end.
pub const HANDLE_UPPER: Patch = [
    [
        [-1.6, 0.0, 2.025],
        [-1.6, -0.3, 2.025],
        [-1.5, -0.3, 2.25],
        [-1.5, 0.0, 2.25],
    ],
    [
        [-2.3, 0.0, 2.025],
        [-2.3, -0.3, 2.025],
        [-2.5, -0.3, 2.25],
        [-2.5, 0.0, 2.25],
    ],
    [
        [-2.7, 0.0, 2.025],
        [-2.7, -0.3, 2.025],
        [-3.0, -0.3, 2.25],
        [-3.0, 0.0, 2.25],
    ],
    [
        [-2.7, 0.0, 1.8],
        [-2.7, -0.3, 1.8],
        [-3.0, -0.3, 1.8],
        [-3.0, 0.0, 1.8],
    ],
];
/// Handle, to the lower end.
pub const HANDLE_LOWER: Patch = [
    [
        [-2.7, 0.0, 1.8],
        [-2.7, -0.3, 1.8],
        [-3.0, -0.3, 1.8],
        [-3.0, 0.0, 1.8],
    ],
    [
        [-2.7, 0.0, 1.575],
        [-2.7, -0.3, 1.575],
        [-3.0, -0.3, 1.35],
        [-3.0, 0.0, 1.35],
    ],
    [
        [-2.5, 0.0, 1.125],
        [-2.5, -0.3, 1.125],
        [-2.65, -0.3, 0.9375],
        [-2.65, 0.0, 0.9375],
    ],
    [
        [-2.0, 0.0, 0.9],
        [-2.0, -0.3, 0.9],
        [-1.9, -0.3, 0.6],
        [-1.9, 0.0, 0.6],
    ],
];
/// Spout, from the body.
pub const SPOUT_LOWER: Patch = [
    [
        [1.7, 0.0, 1.425],
        [1.7, -0.66, 1.425],
        [1.7, -0.66, 0.6],
        [1.7, 0.0, 0.6],
    ],
    [
        [2.6, 0.0, 1.425],
        [2.6, -0.66, 1.425],
        [3.1, -0.66, 0.825],
        [3.1, 0.0, 0.825],
    ],
    [
        [2.3, 0.0, 2.1],
        [2.3, -0.25, 2.1],
        [2.4, -0.25, 2.025],
        [2.4, 0.0, 2.025],
    ],
    [
        [2.7, 0.0, 2.4],
        [2.7, -0.25, 2.4],
        [3.3, -0.25, 2.4],
        [3.3, 0.0, 2.4],
    ],
];
/// Lip of the spout.
pub const SPOUT_LIP: Patch = [
    [
        [2.7, 0.0, 2.4],
        [2.7, -0.25, 2.4],
        [3.3, -0.25, 2.4],
        [3.3, 0.0, 2.4],
    ],
    [
        [2.8, 0.0, 2.475],
        [2.8, -0.25, 2.475],
        [3.525, -0.25, 2.49375],
        [3.525, 0.0, 2.49375],
    ],
    [
        [2.9, 0.0, 2.475],
        [2.9, -0.15, 2.475],
        [3.45, -0.15, 2.5125],
        [3.45, 0.0, 2.5125],
    ],
    [
        [2.8, 0.0, 2.4],
        [2.8, -0.15, 2.4],
        [3.2, -0.15, 2.4],
        [3.2, 0.0, 2.4],
    ],
];
