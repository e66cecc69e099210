//! Rooms carved out of a solid: the boundary of a set of cells of a rectangular grid.
//!
//! Neighbouring faces share whole edges with equal end points, so the rooms are closed to the last bit.

use super::mesh::Mesh;
use glam::DVec3;

/// Coordinates of the planes of the grid along x, y and z, ascending.
pub struct Planes(pub [Vec<f64>; 3]);

/// Sends each face between a solid and an empty cell to one of `count` meshes.
///
/// `empty` is asked with the centre of a cell; outside the grid all is empty. `sort` is given the centre of a face
/// and its normal, which points into the empty cell, and names the mesh.
pub fn carve(
    planes: &Planes,
    empty: impl Fn(DVec3) -> bool,
    sort: impl Fn(DVec3, DVec3) -> usize,
    count: usize,
) -> Vec<Mesh> {
    let p = &planes.0;
    let mut meshes = vec![Mesh::default(); count];
    let mid = |axis: usize, i: usize| 0.5 * (p[axis][i] + p[axis][i + 1]);
    let is_empty = |cell: [isize; 3]| {
        let inside = (0..3).all(|a| cell[a] >= 0 && (cell[a] as usize) < p[a].len() - 1);
        !inside
            || empty(DVec3::from_array(
                [0, 1, 2].map(|a| mid(a, cell[a] as usize)),
            ))
    };
    for i in 0..p[0].len() - 1 {
        for j in 0..p[1].len() - 1 {
            for k in 0..p[2].len() - 1 {
                let cell = [i as isize, j as isize, k as isize];
                if is_empty(cell) {
                    continue;
                }
                for axis in 0..3 {
                    for side in [0, 1] {
                        let mut next = cell;
                        next[axis] += 2 * side - 1;
                        if !is_empty(next) {
                            continue;
                        }
                        let corners = face(p, [i, j, k], axis, side as usize);
                        let mut normal = [0.0; 3];
                        normal[axis] = (2 * side - 1) as f64;
                        let centre = 0.5 * (corners[0] + corners[2]);
                        meshes[sort(centre, DVec3::from_array(normal))].quad(corners);
                    }
                }
            }
        }
    }
    meshes
}

/// Corners of one face of a cell, counter-clockwise seen from outside the cell.
fn face(p: &[Vec<f64>; 3], cell: [usize; 3], axis: usize, side: usize) -> [DVec3; 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let corner = |du: usize, dv: usize| {
        let mut c = [0.0; 3];
        c[axis] = p[axis][cell[axis] + side];
        c[u] = p[u][cell[u] + du];
        c[v] = p[v][cell[v] + dv];
        DVec3::from_array(c)
    };
    let front = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
    if side == 1 {
        front
    } else {
        [front[0], front[3], front[2], front[1]]
    }
}
