//! Records the rays of a run, so that a benchmark can replay exactly them.
//!
//! A file stands for itself, without the scene it came from: the eight bytes `MLXRAYS1`; the numbers of vertices,
//! triangles, quadrics and rays as four u64; then vertices (3 f32), triangles (3 u32), quadrics (8 f32: kind 0 sphere or
//! 1 disk, centre, radius, normal), rays (8 f32: o, d, t_max, kind 0 closest or 1 visibility). All little-endian.

use super::{Accel, Ray};
use crate::scene::{Geometry, NONE, Quadric, Shape};
use glam::{Mat3, Vec3};
use std::cell::Cell;
use std::io::{self, Read, Write};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

const MAGIC: &[u8; 8] = b"MLXRAYS1";
/// Buffers; threads beyond share them.
const SHARDS: usize = 64;

/// What a ray asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// The closest hit.
    Closest = 0,
    /// Visibility.
    Any = 1,
}

/// The rays of one thread.
#[derive(Default)]
struct Shard {
    kept: Vec<(Ray, Kind)>,
    missed: u64,
}

/// Passes every query on and writes it down.
pub struct Recorder<A> {
    inner: A,
    shards: Vec<Mutex<Shard>>,
    cap: usize,
}

impl<A: Accel> Recorder<A> {
    /// Keeps at most the first `cap` rays of each thread.
    pub fn new(inner: A, cap: usize) -> Self {
        Self {
            inner,
            shards: (0..SHARDS).map(|_| Mutex::default()).collect(),
            cap,
        }
    }

    /// The rays so far, thread by thread, each thread's in order.
    pub fn rays(&self) -> Vec<(Ray, Kind)> {
        self.locked()
            .iter()
            .flat_map(|s| &s.kept)
            .copied()
            .collect()
    }

    /// Rays that were not kept, because their thread had as many as it may.
    pub fn missed(&self) -> u64 {
        self.locked().iter().map(|s| s.missed).sum()
    }

    /// Writes the geometry and the rays so far to a file.
    pub fn save(&self, path: &Path) -> io::Result<()> {
        let out = io::BufWriter::new(std::fs::File::create(path)?);
        let shards = self.locked();
        let parts: Vec<&[(Ray, Kind)]> = shards.iter().map(|s| s.kept.as_slice()).collect();
        write(out, self.geometry(), &parts)
    }

    fn locked(&self) -> Vec<MutexGuard<'_, Shard>> {
        self.shards.iter().map(lock).collect()
    }

    fn push(&self, ray: &Ray, kind: Kind) {
        // Uncontended unless there are more threads than shards.
        let mut shard = lock(&self.shards[thread_number() % SHARDS]);
        if shard.kept.len() < self.cap {
            shard.kept.push((*ray, kind));
        } else {
            shard.missed += 1;
        }
    }
}

impl<A: Accel> Accel for Recorder<A> {
    fn geometry(&self) -> &Geometry {
        self.inner.geometry()
    }

    fn nearest(&self, ray: &Ray) -> Option<u32> {
        self.push(ray, Kind::Closest);
        self.inner.nearest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.push(ray, Kind::Any);
        self.inner.occluded(ray)
    }

    fn name(&self) -> String {
        format!("{} recorded", self.inner.name())
    }

    fn memory_bytes(&self) -> usize {
        self.inner.memory_bytes()
    }
}

fn lock(shard: &Mutex<Shard>) -> MutexGuard<'_, Shard> {
    shard.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A small number of this thread's own.
fn thread_number() -> usize {
    static NEXT: AtomicUsize = AtomicUsize::new(0);
    thread_local!(static MINE: Cell<Option<usize>> = const { Cell::new(None) });
    MINE.with(|mine| {
        mine.get().unwrap_or_else(|| {
            let n = NEXT.fetch_add(1, Ordering::Relaxed);
            mine.set(Some(n));
            n
        })
    })
}

/// Writes what answers rays of a geometry, and rays, which may come in several parts.
pub fn write(mut out: impl Write, geometry: &Geometry, rays: &[&[(Ray, Kind)]]) -> io::Result<()> {
    let g = geometry;
    out.write_all(MAGIC)?;
    // The spare vertex is not written.
    let vertices = &g.positions[..g.positions.len().saturating_sub(1)];
    for n in [
        vertices.len(),
        g.triangles.len(),
        g.quadrics.len(),
        rays.iter().map(|part| part.len()).sum(),
    ] {
        out.write_all(&(n as u64).to_le_bytes())?;
    }
    for p in vertices {
        put(&mut out, &p.to_array())?;
    }
    for t in &g.triangles {
        // Bit patterns pass through unchanged.
        put(&mut out, &t.map(f32::from_bits))?;
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
        put(&mut out, &[kind, c.x, c.y, c.z, radius, n.x, n.y, n.z])?;
    }
    for (r, kind) in rays.iter().copied().flatten() {
        let k = *kind as u8 as f32;
        let values = [r.o.x, r.o.y, r.o.z, r.d.x, r.d.y, r.d.z, r.t_max, k];
        put(&mut out, &values)?;
    }
    out.flush()
}

fn put(out: &mut impl Write, values: &[f32]) -> io::Result<()> {
    values
        .iter()
        .try_for_each(|v| out.write_all(&v.to_le_bytes()))
}

/// Reads what `write` wrote: a geometry that answers rays the same (materials and lights are not in it), and the rays.
pub fn read(mut input: impl Read) -> io::Result<(Geometry, Vec<(Ray, Kind)>)> {
    let bad = |text| io::Error::new(io::ErrorKind::InvalidData, text);
    let mut magic = [0u8; 8];
    input.read_exact(&mut magic)?;
    if &magic != MAGIC {
        return Err(bad("not a metrolux ray file"));
    }
    let mut counts = [0u64; 4];
    for n in &mut counts {
        let mut bytes = [0u8; 8];
        input.read_exact(&mut bytes)?;
        *n = u64::from_le_bytes(bytes);
    }
    // Vectors grow as data arrives: a wrong count ends in "unexpected end of file", not in a huge allocation.
    let mut g = Geometry::default();
    for _ in 0..counts[0] {
        g.positions.push(Vec3::from_array(words(&mut input)?));
    }
    g.positions.push(Vec3::ZERO);
    for _ in 0..counts[1] {
        g.triangles.push(words(&mut input)?.map(f32::to_bits));
    }
    for _ in 0..counts[2] {
        let [kind, x, y, z, radius, nx, ny, nz] = words(&mut input)?;
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
    let mut rays = Vec::new();
    for _ in 0..counts[3] {
        let [ox, oy, oz, dx, dy, dz, t_max, kind] = words(&mut input)?;
        let kind = match kind {
            0.0 => Kind::Closest,
            1.0 => Kind::Any,
            _ => return Err(bad("a ray of unknown kind")),
        };
        let (o, d) = (Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz));
        rays.push((Ray { o, d, t_max }, kind));
    }
    Ok((g, rays))
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
    use super::super::Obvhs;
    use super::super::testing::{Rng, mixed};
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
        file[0] = b'X';
        assert!(read(file.as_slice()).is_err());
    }
}
