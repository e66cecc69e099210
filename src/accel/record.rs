//! Records the rays of a run, so that a benchmark can replay exactly them.
//!
//! File: the eight bytes `MLXRAYS1`, the number of rays as u64, then for each ray eight f32: o, d, t_max, kind
//! (0 closest, 1 visibility). All little-endian.

use super::{Accel, Ray};
use crate::scene::Geometry;
use glam::Vec3;
use std::cell::Cell;
use std::io::{self, Read, Write};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

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

/// Passes every query on and writes it down.
pub struct Recorder<A> {
    inner: A,
    shards: Vec<Mutex<Vec<(Ray, Kind)>>>,
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
        self.shards
            .iter()
            .flat_map(|s| s.lock().unwrap_or_else(PoisonError::into_inner).clone())
            .collect()
    }

    /// Writes the rays so far to a file.
    pub fn save(&self, path: &Path) -> io::Result<()> {
        write(
            io::BufWriter::new(std::fs::File::create(path)?),
            &self.rays(),
        )
    }

    fn push(&self, ray: &Ray, kind: Kind) {
        let shard = &self.shards[thread_number() % SHARDS];
        // Uncontended unless there are more threads than shards.
        let mut rays = shard.lock().unwrap_or_else(PoisonError::into_inner);
        if rays.len() < self.cap {
            rays.push((*ray, kind));
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

/// Writes rays in the file's format.
pub fn write(mut out: impl Write, rays: &[(Ray, Kind)]) -> io::Result<()> {
    out.write_all(MAGIC)?;
    out.write_all(&(rays.len() as u64).to_le_bytes())?;
    for (r, kind) in rays {
        let k = *kind as u8 as f32;
        let values = [r.o.x, r.o.y, r.o.z, r.d.x, r.d.y, r.d.z, r.t_max, k];
        for v in values {
            out.write_all(&v.to_le_bytes())?;
        }
    }
    out.flush()
}

/// Reads what `write` wrote.
pub fn read(mut input: impl Read) -> io::Result<Vec<(Ray, Kind)>> {
    let bad = |text| io::Error::new(io::ErrorKind::InvalidData, text);
    let mut head = [0u8; 16];
    input.read_exact(&mut head)?;
    if &head[..8] != MAGIC {
        return Err(bad("not a metrolux ray file"));
    }
    let mut count = [0u8; 8];
    count.copy_from_slice(&head[8..]);
    let count = u64::from_le_bytes(count);
    let mut rays = Vec::new();
    let mut record = [0u8; 32];
    for _ in 0..count {
        input.read_exact(&mut record)?;
        let f = |i: usize| {
            let mut b = [0u8; 4];
            b.copy_from_slice(&record[4 * i..4 * i + 4]);
            f32::from_le_bytes(b)
        };
        let kind = match f(7) {
            0.0 => Kind::Closest,
            1.0 => Kind::Any,
            _ => return Err(bad("a ray of unknown kind")),
        };
        let ray = Ray {
            o: Vec3::new(f(0), f(1), f(2)),
            d: Vec3::new(f(3), f(4), f(5)),
            t_max: f(6),
        };
        rays.push((ray, kind));
    }
    Ok(rays)
}

#[cfg(test)]
mod tests {
    use super::super::Obvhs;
    use super::super::testing::{Rng, soup};
    use super::*;

    #[test]
    fn rays_come_back_from_the_file_bit_for_bit() {
        let mut rng = Rng(4);
        let geometry = soup(&mut rng, 10);
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
        assert_eq!(rays.len(), 5);
        let mut file = Vec::new();
        write(&mut file, &rays).expect("memory");
        assert_eq!(read(file.as_slice()).expect("own format"), rays);
        assert!(read(&file[..file.len() - 1]).is_err());
        file[0] = b'X';
        assert!(read(file.as_slice()).is_err());
    }
}
