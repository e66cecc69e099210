//! `trianglemesh` and `bilinearmesh`.

use super::error::{Result, SceneError};
use super::params::{Params, Type};
use super::place::Mesh;
use glam::{DVec2, DVec3, Vec2};

/// Most cells along a side of a curved patch.
const PATCH_STEPS: u32 = 16;

/// Reads a `trianglemesh`.
pub(super) fn triangle_mesh(p: &Params) -> Result<Mesh> {
    let mut mesh = vertices(p)?;
    let indices = indices(p, mesh.positions.len(), 3)?;
    mesh.triangles = indices
        .chunks_exact(3)
        .map(|c| [c[0], c[1], c[2]])
        .collect();
    Ok(mesh)
}

/// Reads a `bilinearmesh`: patches of four corners p00, p10, p01, p11.
pub(super) fn bilinear_mesh(p: &Params) -> Result<Vec<Mesh>> {
    let corners = vertices(p)?;
    let indices = indices(p, corners.positions.len(), 4)?;
    let mut patches = Patches::default();
    for c in indices.chunks_exact(4) {
        patches.add(&corners, [c[0], c[1], c[2], c[3]], false);
    }
    Ok(patches.into_meshes())
}

fn vertices(p: &Params) -> Result<Mesh> {
    let Some(positions) = p.points("P", &[Type::Point3])? else {
        return Err(
            SceneError::value(&p.at, format!("{} needs vertex positions", p.owner))
                .expected("\"point3 P\""),
        );
    };
    let normals = p
        .points("N", &[Type::Normal, Type::Vector3])?
        .unwrap_or_default();
    // Files older than pbrt-v4 call them st.
    let name = if p.get("uv").is_some() { "uv" } else { "st" };
    let uvs = p.pairs(name)?.unwrap_or_default();
    for (name, n) in [("N", normals.len()), (name, uvs.len())] {
        if n != 0 && n != positions.len() {
            return Err(p
                .bad(name)
                .found(format!("{n} values"))
                .expected(format!("{}, one for each vertex", positions.len())));
        }
    }
    Ok(Mesh {
        positions,
        normals,
        uvs,
        ..Mesh::default()
    })
}

fn indices(p: &Params, vertices: usize, corners: usize) -> Result<Vec<u32>> {
    let Some(list) = p.integers("indices")? else {
        // As in pbrt: a single triangle or patch needs none.
        if vertices == corners {
            return Ok((0..corners as u32).collect());
        }
        return Err(
            SceneError::value(&p.at, format!("{} needs \"indices\"", p.owner))
                .found(format!("{vertices} vertices")),
        );
    };
    if list.is_empty() || list.len() % corners != 0 {
        return Err(p
            .bad("indices")
            .found(format!("{} indices", list.len()))
            .expected(format!("a multiple of {corners}")));
    }
    check_indices(&list, vertices).map_err(|(i, v)| {
        p.bad("indices")
            .found(format!("{v} as number {i}"))
            .expected(format!("0 to {}", vertices as i64 - 1))
    })
}

/// Indices as u32, or the place and value of the first that names no vertex.
pub(super) fn check_indices(
    list: &[i64],
    vertices: usize,
) -> std::result::Result<Vec<u32>, (usize, i64)> {
    match list.iter().position(|&i| i < 0 || i as usize >= vertices) {
        Some(at) => Err((at, list[at])),
        None => Ok(list.iter().map(|&i| i as u32).collect()),
    }
}

/// Tessellated patches: those that two triangles show exactly, and those that got normals of their own.
#[derive(Default)]
pub(super) struct Patches {
    flat: Mesh,
    curved: Mesh,
}

impl Patches {
    /// The meshes that hold anything.
    pub(super) fn into_meshes(self) -> Vec<Mesh> {
        let mut all = vec![self.flat, self.curved];
        all.retain(|m| !m.triangles.is_empty());
        all
    }

    /// Adds the bilinear patch over `quad` (p00, p10, p01, p11) of `from`. `by_shape`: coordinates may run
    /// linearly over each half of a plane quad, as the faces of a mesh file mean them.
    pub(super) fn add(&mut self, from: &Mesh, quad: [u32; 4], by_shape: bool) {
        let p = quad.map(|i| from.positions[i as usize]);
        let steps = steps(p, by_shape);
        let curved = steps > 1;
        let mesh = if curved {
            &mut self.curved
        } else {
            &mut self.flat
        };
        let base = mesh.positions.len() as u32;
        let part = mesh.parts.last().map_or(0, |last| last + 1);
        for j in 0..=steps {
            for i in 0..=steps {
                let n = f64::from(steps);
                add_vertex(mesh, from, quad, f64::from(i) / n, f64::from(j) / n, curved);
            }
        }
        let row = steps + 1;
        for j in 0..steps {
            for i in 0..steps {
                let a = base + j * row + i;
                mesh.triangles.push([a, a + 1, a + row + 1]);
                mesh.triangles.push([a, a + row + 1, a + row]);
                mesh.parts.extend([part; 2]);
            }
        }
    }
}

/// Cells along a side that keep the grid within 10⁻⁴ of the patch's size from it.
fn steps(p: [DVec3; 4], by_shape: bool) -> u32 {
    let (du, dv) = (p[1] - p[0], p[2] - p[0]);
    let size = du.length().max(dv.length());
    // Half way, the diagonal of the quad misses the patch by a quarter of the twist, and n² less with n cells.
    let twist = p[0] + p[3] - p[1] - p[2];
    let miss = 0.25
        * match du.cross(dv).try_normalize() {
            Some(n) if by_shape => twist.dot(n).abs(),
            _ => twist.length(),
        };
    let n = (miss / (1e-4 * size)).sqrt().ceil();
    if n.is_finite() {
        (n as u32).clamp(1, PATCH_STEPS)
    } else {
        1
    }
}

fn add_vertex(mesh: &mut Mesh, from: &Mesh, quad: [u32; 4], u: f64, v: f64, curved: bool) {
    let w = [(1. - u) * (1. - v), u * (1. - v), (1. - u) * v, u * v];
    let blend = |a: &[DVec3]| -> DVec3 { (0..4).map(|k| a[quad[k] as usize] * w[k]).sum() };
    let unit = |n: DVec3| n.try_normalize().unwrap_or(DVec3::ZERO);
    mesh.positions.push(blend(&from.positions));
    if !from.normals.is_empty() {
        mesh.normals.push(unit(blend(&from.normals)));
    } else if curved {
        // The patch's own normal, so that the facets of the grid do not show.
        let p = quad.map(|i| from.positions[i as usize]);
        let du = (p[1] - p[0]) * (1.0 - v) + (p[3] - p[2]) * v;
        let dv = (p[2] - p[0]) * (1.0 - u) + (p[3] - p[1]) * u;
        mesh.normals.push(unit(du.cross(dv)));
    }
    mesh.uvs.push(if from.uvs.is_empty() {
        DVec2::new(u, v).as_vec2()
    } else {
        let part = |k: usize| from.uvs[quad[k] as usize] * w[k] as f32;
        (0..4).map(part).sum::<Vec2>()
    });
}
