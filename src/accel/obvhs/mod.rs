//! A backend in safe Rust, to check Embree with: the hierarchy is built by the crate obvhs, the traversal is here,
//! because it has to keep a promise that none of the crate's own makes: no box is passed over whose primitive the
//! shared routine would hit.

mod binary;
mod build;
mod leaf;
mod level;
mod node;
mod place;
mod wide;

pub use build::{ObvhsOptions, Preset, Tree};

use super::{Accel, Ray};
use crate::scene::{Geometry, PrimId};
use build::Parts;
use level::Level;
use place::Place;
use std::time::{Duration, Instant};

/// A bounding-volume hierarchy over a geometry, and one over each of its objects.
pub struct Obvhs<'a> {
    geometry: &'a Geometry,
    /// Its leaves hold primitives and, numbered behind them, instances.
    world: Level<'a>,
    objects: Vec<Level<'a>>,
    /// Parallel to [`Geometry::instances`].
    places: Vec<Place>,
    options: ObvhsOptions,
    build_time: Duration,
}

impl<'a> Obvhs<'a> {
    /// Builds over all primitives of `geometry` as is best for rendering.
    pub fn new(geometry: &'a Geometry) -> Self {
        Self::with_options(geometry, ObvhsOptions::default())
    }

    /// Builds in the rayon pool that it is called in; the tree is the same for any number of threads.
    pub fn with_options(geometry: &'a Geometry, options: ObvhsOptions) -> Self {
        super::surface::prepare(geometry);
        let start = Instant::now();
        let level = |part: &'a Geometry, parts: Parts| Level::build(part, &parts, options);
        let objects = geometry.objects.iter();
        let objects = objects.map(|o| level(o, Parts::new(o, options.splits)));
        let objects = objects.collect();
        let mut parts = Parts::new(geometry, options.splits);
        parts.add_instances(geometry);
        Self {
            geometry,
            world: level(geometry, parts),
            objects,
            places: geometry.instances.iter().map(Place::new).collect(),
            options,
            build_time: start.elapsed(),
        }
    }

    /// Wall time of the build.
    pub fn build_time(&self) -> Duration {
        self.build_time
    }

    /// Number of leaf entries: primitives, or pieces of them, and instances.
    pub fn entries(&self) -> usize {
        let levels = std::iter::once(&self.world).chain(&self.objects);
        levels.map(Level::entries).sum()
    }

    /// The object that stands as an instance, and the ray in its space.
    #[inline]
    fn enter(&self, instance: u32, ray: &Ray) -> (&Level<'a>, Ray) {
        let place = &self.places[instance as usize];
        (&self.objects[place.object as usize], place.carry(ray))
    }

    /// The nearest of the primitives that count.
    #[inline(always)]
    fn nearest_by(&self, ray: &Ray, counts: impl Fn(PrimId) -> bool) -> Option<PrimId> {
        let world = |prim| Some(PrimId::of(prim)).filter(|id| counts(*id));
        self.world.nearest(ray, world, |instance, ray| {
            let (object, ray) = self.enter(instance, ray);
            let id = |prim| Some(PrimId::through(instance, prim)).filter(|id| counts(*id));
            // Objects hold no objects.
            object.nearest_of(&ray, id, |_, _| None)
        })
    }

    /// One of the primitives that count lies on the ray.
    #[inline(always)]
    fn occluded_by(&self, ray: &Ray, counts: impl Fn(PrimId) -> bool) -> bool {
        let world = |prim| counts(PrimId::of(prim));
        self.world.occluded(ray, world, |instance, ray| {
            let (object, ray) = self.enter(instance, ray);
            let inside = |prim| counts(PrimId::through(instance, prim));
            object.occluded(&ray, inside, |_, _| false)
        })
    }

    /// It is none of two, or no triangle.
    fn counts(&self, id: PrimId, but: [PrimId; 2]) -> bool {
        !but.contains(&id) || !self.geometry.is_triangle(id)
    }
}

impl Accel for Obvhs<'_> {
    fn geometry(&self) -> &Geometry {
        self.geometry
    }

    #[inline]
    fn nearest(&self, ray: &Ray) -> Option<PrimId> {
        self.nearest_by(ray, |_| true)
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_by(ray, |_| true)
    }

    fn nearest_but(&self, ray: &Ray, but: [PrimId; 2]) -> Option<PrimId> {
        self.nearest_by(ray, |id| self.counts(id, but))
    }

    fn occluded_but(&self, ray: &Ray, but: [PrimId; 2]) -> bool {
        self.occluded_by(ray, |id| self.counts(id, but))
    }

    fn name(&self) -> String {
        format!("obvhs {}", self.options)
    }

    fn memory_bytes(&self) -> usize {
        let levels = std::iter::once(&self.world).chain(&self.objects);
        let levels: usize = levels.map(Level::memory_bytes).sum();
        levels + size_of_val(self.places.as_slice())
    }
}
