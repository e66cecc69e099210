//! What a render will hold in memory, estimated before it does.

use super::job::Job;
use crate::chain::MltOptions;
use crate::path::{Link, Vertex};
use crate::scene::texture::Texels;
use crate::scene::{Facet, Geometry, Instance, IntegratorKind, Light, Scene};
use crate::study::process::machine_bytes;

/// Bytes by what they are for.
pub struct Memory {
    /// Name and bytes of each part, in the order in which it is told.
    pub parts: Vec<(&'static str, u64)>,
}

/// Bytes of Embree's structure for a triangle: between 100 and 250 in the scenes here, with spatial splits.
const EMBREE_TRIANGLE: usize = 180;
/// Bytes of Embree's for an instance.
const EMBREE_INSTANCE: usize = 600;

/// Bytes of a pixel in the film: three 128-bit sums.
const FILM: usize = 48;
/// Bytes of a pixel in a thread's buffer of splats.
const SPLATS: usize = 32;
/// Bytes of a pixel and group.
const GROUP: usize = 8;
/// Bytes of a pixel in the sums of camera samples.
const CAMERA: usize = 56;

impl Memory {
    /// Of a job.
    pub fn of(scene: &Scene, job: &Job) -> Self {
        let g = &scene.geometry;
        let part = |g: &Geometry| {
            let vectors = 12 * (g.positions.len() + g.normals.len()) + 8 * g.uvs.len();
            let triangles = g.triangles.len() * (12 + size_of::<Facet>());
            vectors + triangles + 8 * g.prim_count() + 128 * g.quadrics.len()
        };
        let instances = g.instances.len();
        let geometry = g.parts().map(part).sum::<usize>() + size_of::<Instance>() * instances;
        let triangles = g.triangle_count();
        let texels = |t: &Texels| match t {
            Texels::Bytes { data, .. } => 4 * data.len(),
            Texels::Floats(data) => 12 * data.len(),
        };
        let images: usize = scene.images.iter().map(|i| texels(&i.texels)).sum();
        let lights = scene.lights.len() * (size_of::<Light>() + 32);
        let [x0, y0, x1, y1] = scene.camera.crop;
        let pixels = (x1 - x0) as usize * (y1 - y0) as usize;
        let threads = match job.threads {
            0 => std::thread::available_parallelism().map_or(1, |n| n.get()),
            n => n,
        };
        let bins = match (&job.plan.grey, job.bins) {
            (None, Some(b)) => b.count,
            _ => 0,
        };
        let options = MltOptions::default();
        let (film, chains) = match job.integrator {
            IntegratorKind::Pt => (CAMERA + 8 * bins, 0),
            IntegratorKind::Bdpt => (CAMERA + FILM + threads * FILM + 32 * bins, 0),
            IntegratorKind::Mlt => {
                let groups = options.groups as usize;
                let one = FILM + threads * SPLATS + groups * GROUP + CAMERA;
                (
                    one + bins * (16 + 8 * threads + 8),
                    groups * options.chains as usize * chain(job.plan.lanes, job.plan.max_edges),
                )
            }
        };
        let parts = [
            ("geometry", geometry),
            ("images", images),
            ("lights", lights),
            (
                "acceleration",
                EMBREE_TRIANGLE * triangles + EMBREE_INSTANCE * instances,
            ),
            ("film", film * pixels),
            ("chains", chains),
        ];
        Self {
            parts: parts.map(|(name, bytes)| (name, bytes as u64)).into(),
        }
    }

    /// Sum of all parts.
    pub fn total(&self) -> u64 {
        self.parts.iter().map(|p| p.1).sum()
    }

    /// What to say if this machine has no room for it: an allocation that fails ends the process, and so does a system
    /// that has run out.
    pub fn too_much(&self) -> Option<String> {
        let (needed, there) = (self.total(), machine_bytes());
        (there > 0 && needed > there).then(|| {
            let largest = self.parts.iter().max_by_key(|p| p.1).expect("parts");
            format!(
                "this render needs about {} of memory, most of it for {}: found a machine with {}",
                megabytes(needed),
                largest.0,
                megabytes(there)
            )
        })
    }
}

/// Bytes of a chain: its vertices, its path and its proposal with their tables.
fn chain(lanes: usize, edges: usize) -> usize {
    let (vertex, link) = match lanes {
        1 => (size_of::<Vertex<1>>(), size_of::<Link<1>>()),
        4 => (size_of::<Vertex<4>>(), size_of::<Link<4>>()),
        8 => (size_of::<Vertex<8>>(), size_of::<Link<8>>()),
        _ => (size_of::<Vertex<16>>(), size_of::<Link<16>>()),
    };
    (3 * edges + 9) * vertex + 2 * ((edges + 1) * link + 4 * 8 * (edges + 4))
}

/// Bytes for a person.
pub fn megabytes(bytes: u64) -> String {
    let mb = bytes as f64 / 1e6;
    match mb {
        m if m >= 10.0 => format!("{m:.0} MB"),
        m if m >= 0.1 => format!("{m:.1} MB"),
        m => format!("{:.1} kB", m * 1e3),
    }
}
