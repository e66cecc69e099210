//! PLY meshes: ASCII and binary, triangles and quads, optional normals and texture coordinates.

use super::error::{Location, Result, SceneError};
use super::mesh::Patches;
use super::place::Mesh;
use glam::{DVec3, Vec2};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    DefaultElement, ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult,
    PropertyType, ScalarType,
};
use std::fs::File;
use std::io::{BufReader, Seek};
use std::path::Path;

#[derive(Default)]
struct Vertex {
    p: DVec3,
    n: DVec3,
    uv: Vec2,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set_double(name, f64::from(value))
    }

    fn set_double(&mut self, name: &str, v: f64) -> PropertyAccessResult {
        match name {
            "x" => self.p.x = v,
            "y" => self.p.y = v,
            "z" => self.p.z = v,
            "nx" => self.n.x = v,
            "ny" => self.n.y = v,
            "nz" => self.n.z = v,
            _ if U_NAMES.contains(&name) => self.uv.x = v as f32,
            _ if V_NAMES.contains(&name) => self.uv.y = v as f32,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match property.to_f32_lossy() {
            Some(v) => self.set_double(name, f64::from(v)),
            None => PropertyAccessResult::Ignored,
        }
    }
}

const U_NAMES: [&str; 4] = ["u", "s", "texture_u", "texture_s"];
const V_NAMES: [&str; 4] = ["v", "t", "texture_v", "texture_t"];

#[derive(Default)]
struct Face {
    /// `None` where the list holds a negative number.
    corners: Option<Vec<u32>>,
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !matches!(name, "vertex_indices" | "vertex_index") {
            return PropertyAccessResult::Ignored;
        }
        self.corners = property.to_u32_list();
        PropertyAccessResult::Set
    }
}

/// Reads a PLY file: its triangles, and its quads apart, for they carry coordinates and normals of their own.
pub(super) fn read(path: &Path, at: &Location) -> Result<Vec<Mesh>> {
    parse(path)
        .map_err(|e| SceneError::file(at, format!("cannot read the mesh {}: {e}", path.display())))
}

fn parse(path: &Path) -> std::result::Result<Vec<Mesh>, String> {
    let file = File::open(path).map_err(|e| e.to_string())?;
    let size = file.metadata().map_err(|e| e.to_string())?.len();
    let mut reader = Reader::new(BufReader::with_capacity(1 << 16, file));
    let header = Parser::<Vertex>::new()
        .read_header(&mut reader)
        .map_err(|e| one_line(&e))?;
    let start = reader
        .get_mut()
        .stream_position()
        .map_err(|e| e.to_string())?;
    bound(
        header.elements.values(),
        header.encoding == Encoding::Ascii,
        size.saturating_sub(start),
    )?;
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    for (name, element) in &header.elements {
        let failed = |e| format!("element {name}: {}", one_line(&e));
        match name.as_str() {
            "vertex" => {
                vertices = Parser::<Vertex>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(failed)?;
            }
            "face" => {
                faces = Parser::<Face>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(failed)?;
            }
            _ => {
                Parser::<DefaultElement>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(failed)?;
            }
        }
    }
    let Some(definition) = header.elements.get("vertex") else {
        return Err("no element \"vertex\"".into());
    };
    assemble(definition, vertices, &faces)
}

/// The parser's message without its line breaks and the data it quotes at length.
fn one_line(e: &ply_rs_bw::parser::ParseError) -> String {
    let words: Vec<_> = e.to_string().split_whitespace().map(String::from).collect();
    format!("{:.160}", words.join(" "))
}

/// The header's counts fit into the file: a claim of 10⁹ vertices in a small file ends here.
fn bound<'a>(
    elements: impl Iterator<Item = &'a ElementDef>,
    ascii: bool,
    bytes: u64,
) -> std::result::Result<(), String> {
    let mut need = 0u64;
    for e in elements {
        let each: u64 = e
            .properties
            .values()
            .map(|p| match &p.data_type {
                // A digit and a separator.
                _ if ascii => 2,
                PropertyType::Scalar(t) | PropertyType::List(t, _) => width(t),
            })
            .sum();
        if each == 0 && e.count > 0 {
            return Err(format!("element {} without properties", e.name));
        }
        need = need.saturating_add(each.saturating_mul(e.count as u64));
    }
    // An ASCII file may end without its last separator.
    if need > bytes + u64::from(ascii) {
        return Err(format!(
            "the header claims at least {need} bytes of data, the file has {bytes}"
        ));
    }
    Ok(())
}

fn width(t: &ScalarType) -> u64 {
    match t {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

fn assemble(
    definition: &ElementDef,
    vertices: Vec<Vertex>,
    faces: &[Face],
) -> std::result::Result<Vec<Mesh>, String> {
    let has = |names: &[&str]| names.iter().any(|n| definition.properties.contains_key(*n));
    for axis in ["x", "y", "z"] {
        if !has(&[axis]) {
            return Err(format!("vertices without \"{axis}\""));
        }
    }
    let with_normals = has(&["nx"]) && has(&["ny"]) && has(&["nz"]);
    let with_uvs = has(&U_NAMES) && has(&V_NAMES);
    let mut from = Mesh::default();
    for (i, v) in vertices.into_iter().enumerate() {
        let finite = v.p.as_vec3().is_finite()
            && (!with_normals || v.n.as_vec3().is_finite())
            && (!with_uvs || v.uv.is_finite());
        if !finite {
            return Err(format!("vertex {i} is not finite"));
        }
        from.positions.push(v.p);
        if with_normals {
            from.normals.push(v.n);
        }
        if with_uvs {
            from.uvs.push(v.uv);
        }
    }
    let mut triangles = Vec::new();
    let mut patches = Patches::default();
    for (i, face) in faces.iter().enumerate() {
        let corners = face.corners.as_ref().ok_or(format!(
            "face {i} without a list \"vertex_indices\" of numbers from 0"
        ))?;
        let n = from.positions.len();
        if let Some(v) = corners.iter().find(|v| **v as usize >= n) {
            return Err(format!(
                "face {i} has vertex {v}, expected 0 to {}",
                n as i64 - 1
            ));
        }
        match corners[..] {
            [a, b, c] => triangles.push([a, b, c]),
            // Quads are bilinear patches, as in pbrt-v4, whose corners come row by row instead of around.
            [a, b, c, d] => patches.add(&from, [a, b, d, c], true),
            _ => {
                let k = corners.len();
                return Err(format!("face {i} has {k} corners, expected 3 or 4"));
            }
        }
    }
    let mut meshes = patches.into_meshes();
    if !triangles.is_empty() {
        from.triangles = triangles;
        meshes.insert(0, from);
    }
    Ok(meshes)
}
