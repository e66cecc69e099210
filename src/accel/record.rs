//! Records the rays of a run, so that a benchmark can replay exactly them.

pub use super::ray_file::{read, write};
use super::{Accel, Ray};
use crate::scene::{Geometry, PrimId};
use std::cell::Cell;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

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

    fn nearest(&self, ray: &Ray) -> Option<PrimId> {
        self.push(ray, Kind::Closest);
        self.inner.nearest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.push(ray, Kind::Any);
        self.inner.occluded(ray)
    }

    // The file does not say what was left out.
    fn nearest_but(&self, ray: &Ray, but: [PrimId; 2]) -> Option<PrimId> {
        self.push(ray, Kind::Closest);
        self.inner.nearest_but(ray, but)
    }

    fn occluded_but(&self, ray: &Ray, but: [PrimId; 2]) -> bool {
        self.push(ray, Kind::Any);
        self.inner.occluded_but(ray, but)
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
