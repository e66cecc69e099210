//! Files of rays with the geometry they were asked of.
//!
//! A file stands for itself, without the scene it came from: the eight bytes `MLXRAYS1`; the numbers of vertices,
//! triangles, quadrics and rays as four u64; then vertices (3 f32), triangles (3 u32), quadrics (8 f32: kind 0 sphere or
//! 1 disk, centre, radius, normal), rays (8 f32: o, d, t_max, kind 0 closest or 1 visibility). All little-endian.
//!
//! With instances it begins `MLXRAYS2`, and two more u64 number objects and instances. Before the rays then stand the
//! objects (vertices, triangles and quadrics as three u64; then those as above) and the instances (number of the object as
//! u32, then 14 f32: the map from the object to the world by columns, translation last, and the two bounds on its error).

use super::Ray;
use super::fit::validate;
use super::record::Kind;
use crate::scene::{Geometry, Instance, NONE, Quadric, Shape};
use glam::{Mat3, Vec3};
use std::io::{self, Read, Write};

const FLAT: &[u8; 8] = b"MLXRAYS1";
const INSTANCED: &[u8; 8] = b"MLXRAYS2";

/// Writes what answers rays of a geometry, and rays, which may come in several parts.
pub fn write(mut out: impl Write, geometry: &Geometry, rays: &[&[(Ray, Kind)]]) -> io::Result<()> {
    let g = geometry;
    let flat = g.instances.is_empty();
    out.write_all(if flat { FLAT } else { INSTANCED })?;
    let mut counts = sizes(g).to_vec();
    counts.push(rays.iter().map(|part| part.len()).sum());
    if !flat {
        counts.extend([g.objects.len(), g.instances.len()]);
    }
    numbers(&mut out, &counts)?;
    put_part(&mut out, g)?;
    if !flat {
        for object in &g.objects {
            numbers(&mut out, &sizes(object))?;
            put_part(&mut out, object)?;
        }
        for i in &g.instances {
            put(&mut out, &[f32::from_bits(i.object)])?;
            put(&mut out, &i.linear.to_cols_array())?;
            put(&mut out, &i.translation.to_array())?;
            put(&mut out, &[i.error, i.stretch])?;
        }
    }
    for (r, kind) in rays.iter().copied().flatten() {
        let k = *kind as u8 as f32;
        let values = [r.o.x, r.o.y, r.o.z, r.d.x, r.d.y, r.d.z, r.t_max, k];
        put(&mut out, &values)?;
    }
    out.flush()
}

/// Vertices, triangles, quadrics; the spare vertex is not written.
fn sizes(g: &Geometry) -> [usize; 3] {
    [
        g.positions.len().saturating_sub(1),
        g.triangles.len(),
        g.quadrics.len(),
    ]
}

fn numbers(out: &mut impl Write, counts: &[usize]) -> io::Result<()> {
    let mut each = counts.iter();
    each.try_for_each(|n| out.write_all(&(*n as u64).to_le_bytes()))
}

fn put_part(out: &mut impl Write, g: &Geometry) -> io::Result<()> {
    for p in &g.positions[..sizes(g)[0]] {
        put(out, &p.to_array())?;
    }
    for t in &g.triangles {
        // Bit patterns pass through unchanged.
        put(out, &t.map(f32::from_bits))?;
    }
    for q in &g.quadrics {
        let (kind, c, radius, n) = match *q {
            Quadric::Sphere { center, radius, .. } => (0.0, center, radius, Vec3::ZERO),
            Quadric::Disk {
                center,
                radius,
                normal,
                ..
            } => (1.0, center, radius, normal),
        };
        put(out, &[kind, c.x, c.y, c.z, radius, n.x, n.y, n.z])?;
    }
    Ok(())
}

fn put(out: &mut impl Write, values: &[f32]) -> io::Result<()> {
    values
        .iter()
        .try_for_each(|v| out.write_all(&v.to_le_bytes()))
}

/// Reads what `write` wrote: a geometry that answers rays the same (materials and lights are not in it), and the rays.
pub fn read(mut input: impl Read) -> io::Result<(Geometry, Vec<(Ray, Kind)>)> {
    let mut magic = [0u8; 8];
    input.read_exact(&mut magic)?;
    let flat = match &magic {
        FLAT => true,
        INSTANCED => false,
        _ => return Err(bad("not a metrolux ray file")),
    };
    let [vertices, triangles, quadrics, count] = counts(&mut input)?;
    let [objects, instances] = if flat { [0; 2] } else { counts(&mut input)? };
    // Vectors grow as data arrives: a wrong count ends in "unexpected end of file", not in a huge allocation.
    let mut g = read_part(&mut input, [vertices, triangles, quadrics])?;
    for _ in 0..objects {
        let sizes = counts(&mut input)?;
        g.objects.push(read_part(&mut input, sizes)?);
    }
    for _ in 0..instances {
        let [object] = words(&mut input)?;
        let linear = Mat3::from_cols_array(&words(&mut input)?);
        let translation = Vec3::from_array(words(&mut input)?);
        let [error, stretch] = words(&mut input)?;
        g.instances.push(Instance {
            object: object.to_bits(),
            linear,
            translation,
            error,
            stretch,
        });
    }
    let mut rays = Vec::new();
    for i in 0..count {
        let [ox, oy, oz, dx, dy, dz, t_max, kind] = words(&mut input)?;
        let kind = match kind {
            0.0 => Kind::Closest,
            1.0 => Kind::Any,
            _ => return Err(bad("a ray of unknown kind")),
        };
        let (o, d) = (Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz));
        let ray = Ray { o, d, t_max };
        if !ray.is_fit() {
            return Err(bad(&format!("ray {i} cannot be asked: {ray:?}")));
        }
        rays.push((ray, kind));
    }
    validate(&g).map_err(|e| bad(&e))?;
    Ok((g, rays))
}

fn bad(text: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, text)
}

fn counts<const N: usize>(input: &mut impl Read) -> io::Result<[u64; N]> {
    let mut all = [0u64; N];
    for n in &mut all {
        let mut bytes = [0u8; 8];
        input.read_exact(&mut bytes)?;
        *n = u64::from_le_bytes(bytes);
    }
    Ok(all)
}

fn read_part(
    input: &mut impl Read,
    [vertices, triangles, quadrics]: [u64; 3],
) -> io::Result<Geometry> {
    let mut g = Geometry::default();
    for _ in 0..vertices {
        g.positions.push(Vec3::from_array(words(input)?));
    }
    g.positions.push(Vec3::ZERO);
    for _ in 0..triangles {
        g.triangles.push(words(input)?.map(f32::to_bits));
    }
    for _ in 0..quadrics {
        let [kind, x, y, z, radius, nx, ny, nz] = words(input)?;
        let (center, normal) = (Vec3::new(x, y, z), Vec3::new(nx, ny, nz));
        g.quadrics.push(if kind == 0.0 {
            Quadric::Sphere {
                center,
                radius,
                to_object: Mat3::IDENTITY,
                inward: false,
            }
        } else {
            Quadric::Disk {
                center,
                normal,
                tangent: normal.any_orthogonal_vector(),
                radius,
            }
        });
    }
    g.shapes.push(Shape {
        material: NONE,
        has_normals: false,
        has_uvs: false,
    });
    g.prim_shape = vec![0; g.prim_count()];
    g.prim_light = vec![NONE; g.prim_count()];
    Ok(g)
}

/// The next N words of a file as floats.
fn words<const N: usize>(input: &mut impl Read) -> io::Result<[f32; N]> {
    let mut values = [0f32; N];
    for v in &mut values {
        let mut bytes = [0u8; 4];
        input.read_exact(&mut bytes)?;
        *v = f32::from_le_bytes(bytes);
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::super::record::Recorder;
    use super::super::testing::{Rng, mixed};
    use super::super::{Accel, Obvhs};
    use super::*;

    #[test]
    fn rays_come_back_from_the_file_bit_for_bit() {
        let mut rng = Rng(4);
        let geometry = mixed(&mut rng, 10, 2);
        let recorder = Recorder::new(Obvhs::new(&geometry), 5);
        for i in 0..8 {
            let ray = Ray {
                o: rng.vec3(),
                d: rng.direction(),
                t_max: f32::INFINITY,
            };
            if i % 2 == 0 {
                recorder.nearest(&ray);
            } else {
                recorder.occluded(&ray);
            }
        }
        let rays = recorder.rays();
        assert_eq!((rays.len(), recorder.missed()), (5, 3));
        let mut file = Vec::new();
        write(&mut file, &geometry, &[&rays[..2], &rays[2..]]).expect("memory");
        let (g, again) = read(file.as_slice()).expect("own format");
        assert_eq!(again, rays);
        assert_eq!(g.positions, geometry.positions);
        assert_eq!(g.triangles, geometry.triangles);
        let boxes = |g: &Geometry| [10, 11].map(|q| g.prim_bounds(q));
        assert_eq!(boxes(&g), boxes(&geometry));
        assert!(read(&file[..file.len() - 1]).is_err());
        // The last ray's origin, and the first triangle's first corner.
        let nowhere = f32::NAN.to_le_bytes();
        let no_vertex = u32::MAX.to_le_bytes();
        let triangle = 8 + 4 * 8 + 12 * (g.positions.len() - 1);
        for (at, bytes) in [(file.len() - 32, nowhere), (triangle, no_vertex)] {
            let mut wrong = file.clone();
            wrong[at..at + 4].copy_from_slice(&bytes);
            assert!(read(wrong.as_slice()).is_err(), "{at}");
        }
        file[0] = b'X';
        assert!(read(file.as_slice()).is_err());
    }
}
