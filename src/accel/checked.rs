//! Asks two backends the same and counts where they disagree beyond what rounding explains.

use super::canonical::recompute;
use super::surface::ROUNDOFF;
use super::{Accel, Hit, Ray, surface};
use crate::scene::Geometry;
use std::sync::atomic::{AtomicU64, Ordering};

/// How often two backends were asked and disagreed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Disagreement {
    /// Rays asked, of both kinds.
    pub rays: u64,
    /// Closest hits that name different primitives at the same place: edges, corners, coincident faces.
    pub ties: u64,
    /// Closest hits at different places, or one hit and one miss.
    pub nearest: u64,
    /// Different answers about visibility.
    pub occluded: u64,
}

/// Answers as `A`, compares with `B`.
pub struct Checked<A, B> {
    first: A,
    second: B,
    rays: AtomicU64,
    ties: AtomicU64,
    nearest: AtomicU64,
    occluded: AtomicU64,
}

impl<A: Accel, B: Accel> Checked<A, B> {
    /// Both must be built over the same geometry.
    pub fn new(first: A, second: B) -> Self {
        Self {
            first,
            second,
            rays: AtomicU64::new(0),
            ties: AtomicU64::new(0),
            nearest: AtomicU64::new(0),
            occluded: AtomicU64::new(0),
        }
    }

    /// The counts so far.
    pub fn disagreement(&self) -> Disagreement {
        let get = |c: &AtomicU64| c.load(Ordering::Relaxed);
        Disagreement {
            rays: get(&self.rays),
            ties: get(&self.ties),
            nearest: get(&self.nearest),
            occluded: get(&self.occluded),
        }
    }
}

impl<A: Accel, B: Accel> Accel for Checked<A, B> {
    fn geometry(&self) -> &Geometry {
        self.first.geometry()
    }

    fn nearest(&self, ray: &Ray) -> Option<u32> {
        let (a, b) = (self.first.nearest(ray), self.second.nearest(ray));
        self.rays.fetch_add(1, Ordering::Relaxed);
        if a != b {
            let same_place = match (a, b) {
                (Some(a), Some(b)) => same_place(self.geometry(), a, b, ray),
                _ => false,
            };
            let counter = if same_place {
                &self.ties
            } else {
                &self.nearest
            };
            counter.fetch_add(1, Ordering::Relaxed);
        }
        a
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let (a, b) = (self.first.occluded(ray), self.second.occluded(ray));
        self.rays.fetch_add(1, Ordering::Relaxed);
        if a != b {
            self.occluded.fetch_add(1, Ordering::Relaxed);
        }
        a
    }

    fn name(&self) -> String {
        format!("{} checked by {}", self.first.name(), self.second.name())
    }

    fn memory_bytes(&self) -> usize {
        self.first.memory_bytes() + self.second.memory_bytes()
    }
}

/// The canonical hits on two primitives lie within what rounding may move each along the ray.
pub fn same_place(geometry: &Geometry, a: u32, b: u32, ray: &Ray) -> bool {
    let (a, b) = (recompute(geometry, a, ray), recompute(geometry, b, ray));
    let slack = |h: &Hit| {
        let s = surface(geometry, h, ray);
        // A plane displaced by `error` moves the hit along the ray by that over the cosine; t itself is rounded too.
        let away = 2.0 * s.error + 16.0 * ROUNDOFF * (ray.o.abs().max_element() + s.error);
        away / s.ng.dot(ray.d).abs() + 16.0 * ROUNDOFF * h.t.abs()
    };
    (a.t - b.t).abs() <= slack(&a) + slack(&b)
}
