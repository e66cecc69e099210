//! Handle and spout: bent tubes whose ends are cut along the pot's wall.

use super::bezier;
use super::mesh::Mesh;
use glam::DVec3;

/// Control points of half a tube, `[along][across]`; the other half is its mirror image in y = 0.
pub type HalfTube = [[DVec3; 4]; 4];

/// Half-tubes joined end to end; the parameter along runs over 0..n. Ends may be passed a little.
pub struct Tube<'a>(pub &'a [HalfTube]);

impl Tube<'_> {
    /// Point at `around` (in turns) and `along`.
    pub fn point(&self, around: f64, along: f64) -> DVec3 {
        let k = (along.floor().max(0.0) as usize).min(self.0.len() - 1);
        let half = &self.0[k];
        let across = if around <= 0.5 { around } else { 1.0 - around } * 2.0;
        let row = [0, 1, 2, 3].map(|i| bezier::point(&half[i], across));
        let p = bezier::point(&row, along - k as f64);
        if around <= 0.5 {
            p
        } else {
            DVec3::new(p.x, -p.y, p.z)
        }
    }

    /// The middle between the two points of the symmetry plane.
    pub fn centre(&self, along: f64) -> DVec3 {
        0.5 * (self.point(0.0, along) + self.point(0.5, along))
    }
}

/// Where a line that is outside at `from` meets the wall while going towards `towards`.
///
/// `outside` is positive outside the wall.
pub fn cut(
    line: impl Fn(f64) -> DVec3,
    outside: impl Fn(DVec3) -> f64,
    from: f64,
    towards: f64,
) -> f64 {
    let steps = 400;
    let at = |i: usize| from + (towards - from) * i as f64 / steps as f64;
    let first = (1..=steps).find(|i| outside(line(at(*i))) < 0.0);
    let first = first.expect("the line meets the wall");
    let (mut out, mut inside) = (at(first - 1), at(first));
    for _ in 0..60 {
        let middle = 0.5 * (out + inside);
        if outside(line(middle)) < 0.0 {
            inside = middle;
        } else {
            out = middle;
        }
    }
    out
}

/// Rings between two loops of equal length, `project`ed onto the wall; the given loops themselves stay.
pub fn bridge(
    a: &[DVec3],
    b: &[DVec3],
    rings: usize,
    project: impl Fn(DVec3) -> DVec3,
) -> Vec<Vec<DVec3>> {
    let mut rows = vec![a.to_vec()];
    for k in 1..rings {
        let t = k as f64 / rings as f64;
        let mix = |(p, q): (&DVec3, &DVec3)| project(p.lerp(*q, t));
        rows.push(a.iter().zip(b).map(mix).collect());
    }
    rows.push(b.to_vec());
    rows
}

/// Closes a loop with rings that shrink to one point.
pub fn lid(mesh: &mut Mesh, edge: &[DVec3], rings: usize, project: impl Fn(DVec3) -> DVec3) {
    let centre = edge.iter().sum::<DVec3>() / edge.len() as f64;
    let mut rows = bridge(edge, &vec![centre; edge.len()], rings, &project);
    *rows.last_mut().expect("rows") = vec![project(centre)];
    mesh.loops(&rows);
}
