//! `loopsubdiv`: Loop's subdivision surface (Loop 1987; limit positions and normals by Hoppe et al. 1994).

use super::error::{Result, SceneError};
use super::params::{Params, Type};
use super::place::Mesh;
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::PI;

/// Most triangles a subdivided mesh may have; each takes about 140 bytes on the way.
const MAX_TRIANGLES: usize = 1 << 26;
/// Most of them from few triangles, and most from each of many: a short text does not ask for gigabytes.
const FROM_FEW: usize = 1 << 20;
const FROM_EACH: usize = 1 << 8;

/// Reads a `loopsubdiv` shape and subdivides it.
pub(super) fn loop_subdivision(p: &Params) -> Result<Mesh> {
    let levels = p.integer("levels", 3, 0..=10)?;
    let positions = p.points("P", &[Type::Point3])?.unwrap_or_default();
    let list = p.integers("indices")?.unwrap_or_default();
    if list.is_empty() || list.len() % 3 != 0 {
        return Err(p
            .bad("indices")
            .found(format!("{} indices", list.len()))
            .expected("a multiple of 3"));
    }
    let indices = super::mesh::check_indices(&list, positions.len()).map_err(|(i, v)| {
        p.bad("indices")
            .found(format!("{v} as number {i}"))
            .expected(format!("0 to {}", positions.len() as i64 - 1))
    })?;
    let mut triangles: Vec<[u32; 3]> = indices
        .chunks_exact(3)
        .map(|c| [c[0], c[1], c[2]])
        .collect();
    let most = MAX_TRIANGLES.min(FROM_FEW.max(FROM_EACH * triangles.len()));
    if triangles.len() << (2 * levels) > most {
        return Err(p
            .bad("levels")
            .found(format!("{} triangles", triangles.len() << (2 * levels)))
            .expected(format!("at most {most}")));
    }
    let mut positions = positions;
    for _ in 0..levels {
        let rings = rings(&triangles, positions.len(), p)?;
        (positions, triangles) = subdivide(&positions, &triangles, &rings);
    }
    let rings = rings(&triangles, positions.len(), p)?;
    let limit = |weight: &dyn Fn(&Ring) -> f64, border: f64| -> Vec<DVec3> {
        moved(&positions, &rings, weight, border)
    };
    // Weight of each neighbour that leads straight to the limit surface; 1/5 on a border.
    let limit_positions = limit(
        &|r| {
            let n = r.vertices.len() as f64;
            1.0 / (n + 3.0 / (8.0 * beta(r.vertices.len())))
        },
        1.0 / 5.0,
    );
    let normals = rings
        .iter()
        .enumerate()
        .map(|(v, r)| normal(&limit_positions, v, r))
        .collect();
    Ok(Mesh {
        positions: limit_positions,
        normals,
        triangles,
        ..Mesh::default()
    })
}

/// The neighbours of a vertex in the order of its triangles; open on a border.
struct Ring {
    vertices: Vec<u32>,
    border: bool,
}

/// Weight of each of `n` neighbours of an inner vertex: 3/16 for 3, else 3/(8n).
fn beta(n: usize) -> f64 {
    if n == 3 {
        3.0 / 16.0
    } else {
        3.0 / (8.0 * n as f64)
    }
}

/// Walks around every vertex.
fn rings(triangles: &[[u32; 3]], vertices: usize, p: &Params) -> Result<Vec<Ring>> {
    let broken = |v: usize| {
        SceneError::value(&p.at, "the control mesh is not a manifold")
            .found(format!("vertex {v}"))
            .expected("consistently turned triangles around each vertex, in one fan")
    };
    // For each vertex from one neighbour to the next, triangle by triangle: those of vertex v from start[v] on.
    let mut start = vec![0; vertices + 1];
    for &v in triangles.iter().flatten() {
        start[v as usize + 1] += 1;
    }
    for v in 0..vertices {
        start[v + 1] += start[v];
    }
    let mut free = start.clone();
    let mut next = vec![(0, 0); 3 * triangles.len()];
    for t in triangles {
        for k in 0..3 {
            let at = &mut free[t[k] as usize];
            next[*at] = (t[(k + 1) % 3], t[(k + 2) % 3]);
            *at += 1;
        }
    }
    let mut rings = Vec::with_capacity(vertices);
    let mut ends = Vec::new();
    for v in 0..vertices {
        let next = &mut next[start[v]..start[v + 1]];
        next.sort_unstable();
        if next.windows(2).any(|w| w[0].0 == w[1].0) {
            return Err(broken(v));
        }
        let follow = |a: u32| Some(next[next.binary_search_by_key(&a, |n| n.0).ok()?].1);
        ends.clear();
        ends.extend(next.iter().map(|n| n.1));
        ends.sort_unstable();
        let open = next.iter().find(|n| ends.binary_search(&n.0).is_err());
        let border = open.is_some();
        let Some(&(first, _)) = open.or(next.first()) else {
            rings.push(Ring {
                vertices: Vec::new(),
                border: false,
            });
            continue;
        };
        let mut ring = vec![first];
        let mut at = first;
        while let Some(to) = follow(at) {
            if to == first {
                break;
            }
            ring.push(to);
            at = to;
            if ring.len() > next.len() + 1 {
                return Err(broken(v));
            }
        }
        if ring.len() != next.len() + usize::from(border) {
            return Err(broken(v));
        }
        rings.push(Ring {
            vertices: ring,
            border,
        });
    }
    Ok(rings)
}

/// Every vertex moved towards its ring: `weight` a neighbour inside, `border` for the two on a border.
fn moved(
    positions: &[DVec3],
    rings: &[Ring],
    weight: &dyn Fn(&Ring) -> f64,
    border: f64,
) -> Vec<DVec3> {
    let one = |(v, r): (usize, &Ring)| {
        let p = positions[v];
        let at = |i: u32| positions[i as usize];
        match r.vertices[..] {
            [] => p,
            [first, .., last] if r.border => {
                p * (1.0 - 2.0 * border) + (at(first) + at(last)) * border
            }
            _ => {
                let w = weight(r);
                let sum: DVec3 = r.vertices.iter().map(|&i| at(i)).sum();
                p * (1.0 - r.vertices.len() as f64 * w) + sum * w
            }
        }
    };
    rings.iter().enumerate().map(one).collect()
}

fn subdivide(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    rings: &[Ring],
) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut out = moved(positions, rings, &|r| beta(r.vertices.len()), 1.0 / 8.0);
    // The third corners of the triangles at each edge.
    let mut opposite: HashMap<(u32, u32), (u32, Option<u32>)> = HashMap::new();
    for t in triangles {
        for k in 0..3 {
            let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
            opposite
                .entry((a.min(b), a.max(b)))
                .and_modify(|o| o.1 = Some(c))
                .or_insert((c, None));
        }
    }
    let mut middle: HashMap<(u32, u32), u32> = HashMap::new();
    let mut split = |a: u32, b: u32| -> u32 {
        let key = (a.min(b), a.max(b));
        *middle.entry(key).or_insert_with(|| {
            let at = |i: u32| positions[i as usize];
            let ends = at(key.0) + at(key.1);
            out.push(match opposite[&key] {
                (c, Some(d)) => ends * 0.375 + (at(c) + at(d)) * 0.125,
                (_, None) => ends * 0.5,
            });
            (out.len() - 1) as u32
        })
    };
    let mut fine = Vec::with_capacity(4 * triangles.len());
    for &[a, b, c] in triangles {
        let (ab, bc, ca) = (split(a, b), split(b, c), split(c, a));
        fine.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    (out, fine)
}

/// Limit normal from the two tangents of the surface.
fn normal(positions: &[DVec3], v: usize, ring: &Ring) -> DVec3 {
    let n = ring.vertices.len();
    let at = |i: usize| positions[ring.vertices[i] as usize];
    if n < 2 {
        return DVec3::ZERO;
    }
    let (s, t) = if ring.border {
        let along = at(n - 1) - at(0);
        let p = positions[v];
        let across = match n {
            2 => at(0) + at(1) - 2.0 * p,
            3 => at(1) - p,
            // A regular border vertex.
            4 => 2.0 * at(1) + 2.0 * at(2) - at(0) - at(3) - 2.0 * p,
            _ => {
                let step = PI / (n - 1) as f64;
                let mut sum = step.sin() * (at(0) + at(n - 1));
                for k in 1..n - 1 {
                    sum += (2.0 * step.cos() - 2.0) * (k as f64 * step).sin() * at(k);
                }
                -sum
            }
        };
        (across, along)
    } else {
        let mut s = DVec3::ZERO;
        let mut t = DVec3::ZERO;
        for k in 0..n {
            let angle = 2.0 * PI * k as f64 / n as f64;
            s += angle.cos() * at(k);
            t += angle.sin() * at(k);
        }
        (s, t)
    };
    s.cross(t).normalize_or_zero()
}
