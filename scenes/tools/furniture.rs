//! Table and picture of the near room.

use super::mesh::Mesh;

/// Height of the table top.
pub const TABLE_HEIGHT: f64 = 0.74;
/// Table top: left, right, near and far edge. The far edge leaves a gap of 7 cm to the wall.
pub const TABLE: [f64; 4] = [-1.62, 0.42, -0.98, -0.07];

/// The table, in pieces that reach into each other.
pub fn table() -> Mesh {
    let [x0, x1, y0, y1] = TABLE;
    let mut m = Mesh::default();
    m.block([x0, y0, TABLE_HEIGHT - 0.035], [x1, y1, TABLE_HEIGHT]);
    let (leg, inset) = (0.065, 0.05);
    for x in [x0 + inset, x1 - inset - leg] {
        for y in [y0 + inset, y1 - inset - leg] {
            m.block([x, y, -0.004], [x + leg, y + leg, TABLE_HEIGHT - 0.01]);
        }
    }
    let (z0, z1, t) = (TABLE_HEIGHT - 0.125, TABLE_HEIGHT - 0.012, 0.022);
    let (ax0, ax1) = (x0 + inset + 0.02, x1 - inset - 0.02);
    let (ay0, ay1) = (y0 + inset + 0.02, y1 - inset - 0.02);
    m.block([ax0, ay0, z0], [ax1, ay0 + t, z1]);
    m.block([ax0, ay1 - t, z0], [ax1, ay1, z1]);
    m.block(
        [ax0, ay0 + 0.01, z0 + 0.002],
        [ax0 + t, ay1 - 0.01, z1 + 0.002],
    );
    m.block(
        [ax1 - t, ay0 + 0.01, z0 + 0.002],
        [ax1, ay1 - 0.01, z1 + 0.002],
    );
    m
}

/// Picture frame on the wall y = 0.
pub fn picture_frame() -> Mesh {
    let [x0, x1, z0, z1] = PICTURE;
    let (w, d) = (0.045, 0.03);
    let mut m = Mesh::default();
    m.block([x0 - w, -d, z0 - w], [x0, 0.01, z1 + w]);
    m.block([x1, -d, z0 - w], [x1 + w, 0.01, z1 + w]);
    m.block([x0 - 0.005, -d + 0.001, z0 - w], [x1 + 0.005, 0.01, z0]);
    m.block([x0 - 0.005, -d + 0.001, z1], [x1 + 0.005, 0.01, z1 + w]);
    m
}

/// Inside of the picture frame.
const PICTURE: [f64; 4] = [-1.12, -0.08, 1.3, 1.85];

/// The picture is a relief of painted wooden blocks: ground, and one mesh a colour.
pub fn picture() -> [Mesh; 4] {
    let [x0, x1, z0, z1] = PICTURE;
    let mut colours: [Mesh; 4] = Default::default();
    colours[0].block([x0 - 0.01, -0.006, z0 - 0.01], [x1 + 0.01, 0.01, z1 + 0.01]);
    // In hundredths of the picture's width and height: left, right, bottom, top; colour; depth in millimetres.
    let blocks = [
        (6.0, 30.0, 10.0, 90.0, 1, 14.0),
        (33.0, 62.0, 54.0, 90.0, 2, 17.0),
        (33.0, 47.0, 10.0, 50.0, 3, 12.0),
        (49.5, 62.0, 10.0, 50.0, 1, 19.0),
        (65.0, 94.0, 70.0, 90.0, 3, 15.0),
        (65.0, 94.0, 10.0, 65.5, 2, 11.0),
    ];
    for (left, right, bottom, top, colour, depth) in blocks {
        let x = |percent: f64| x0 + (x1 - x0) * percent / 100.0;
        let z = |percent: f64| z0 + (z1 - z0) * percent / 100.0;
        colours[colour].block(
            [x(left), -depth / 1000.0, z(bottom)],
            [x(right), 0.01, z(top)],
        );
    }
    colours
}
