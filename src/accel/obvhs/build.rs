//! How obvhs is asked to build: presets, spatial splits, the boxes it gets.

use super::super::fit::padded_bounds;
use crate::scene::Geometry;
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::PlocBuilder;
use obvhs::splits::split_aabbs_preset;
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use std::fmt;

/// Which hierarchy of obvhs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tree {
    /// Eight children a node, their boxes rounded outward to eight bits a coordinate (CWBVH).
    Wide,
    /// Two children a node.
    Binary,
}

/// Build presets of obvhs: how long it looks for a good tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// No optimisation at all.
    Fastest,
    /// Hardly any.
    VeryFast,
    /// Little.
    Fast,
    /// About as long as Embree takes, by its author's word.
    Medium,
    /// Long.
    Slow,
    /// Very long.
    VerySlow,
}

impl Preset {
    /// All of them, quickest first.
    pub const ALL: [Self; 6] = [
        Self::Fastest,
        Self::VeryFast,
        Self::Fast,
        Self::Medium,
        Self::Slow,
        Self::VerySlow,
    ];

    /// The crate's own parameters.
    pub(super) fn parameters(self) -> BvhBuildParams {
        match self {
            Self::Fastest => BvhBuildParams::fastest_build(),
            Self::VeryFast => BvhBuildParams::very_fast_build(),
            Self::Fast => BvhBuildParams::fast_build(),
            Self::Medium => BvhBuildParams::medium_build(),
            Self::Slow => BvhBuildParams::slow_build(),
            Self::VerySlow => BvhBuildParams::very_slow_build(),
        }
    }
}

/// What to build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObvhsOptions {
    /// The hierarchy.
    pub tree: Tree,
    /// The effort.
    pub preset: Preset,
    /// Large triangles are cut into several boxes before the build. Where a triangle is met at a grazing angle, the
    /// box of the wrong piece may then cut off a distance that only a rounding makes the nearest.
    pub splits: bool,
}

impl Default for ObvhsOptions {
    fn default() -> Self {
        Self {
            tree: Tree::Wide,
            preset: Preset::Medium,
            splits: false,
        }
    }
}

impl fmt::Display for ObvhsOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tree = match self.tree {
            Tree::Wide => "CWBVH",
            Tree::Binary => "BVH2",
        };
        let preset = match self.preset {
            Preset::Fastest => "fastest",
            Preset::VeryFast => "very fast",
            Preset::Fast => "fast",
            Preset::Medium => "medium",
            Preset::Slow => "slow",
            Preset::VerySlow => "very slow",
        };
        let splits = if self.splits { ", splits" } else { "" };
        write!(f, "{tree}, {preset}{splits}")
    }
}

/// What a hierarchy is built over: boxes, each of a primitive or of a piece of one.
pub struct Parts {
    /// The boxes.
    pub boxes: Vec<Aabb>,
    /// The primitive of each box.
    pub prims: Vec<u32>,
    /// Largest coordinate of anything.
    pub reach: f32,
}

impl Parts {
    /// Boxes of all primitives.
    pub fn new(geometry: &Geometry, splits: bool) -> Self {
        let count = geometry.prim_count() as u32;
        let bounds = |p: u32| {
            let (lo, hi) = padded_bounds(geometry, p);
            Aabb::new(Vec3A::from(lo), Vec3A::from(hi))
        };
        let (mut boxes, mut prims): (Vec<Aabb>, Vec<u32>);
        if splits {
            (boxes, prims) = pieces(geometry);
            let quadrics = geometry.triangles.len() as u32..count;
            boxes.extend(quadrics.clone().map(bounds));
            prims.extend(quadrics);
        } else {
            boxes = (0..count).into_par_iter().map(bounds).collect();
            prims = (0..count).collect();
        }
        let far = |b: &Aabb| b.min.abs().max(b.max.abs()).max_element();
        let reach = boxes.par_iter().map(far).reduce(|| 0.0, f32::max);
        Self {
            boxes,
            prims,
            reach,
        }
    }

    /// Boxes of the instances, numbered behind the primitives.
    pub fn add_instances(&mut self, geometry: &Geometry) {
        let objects: Vec<_> = geometry.objects.iter().map(object_bounds).collect();
        let count = geometry.prim_count() as u32;
        for (i, instance) in geometry.instances.iter().enumerate() {
            let Some(bounds) = objects[instance.object as usize] else {
                continue;
            };
            // What is met in the object's space may lie that far off in the world; f32 then rounds each face.
            let (lo, hi) = instance.bounds(bounds);
            let pad = lo.abs().max(hi.abs()) * f64::from(f32::EPSILON) + instance.error as f64;
            let (lo, hi) = ((lo - pad).as_vec3(), (hi + pad).as_vec3());
            self.boxes.push(Aabb::new(Vec3A::from(lo), Vec3A::from(hi)));
            self.prims.push(count + i as u32);
            let far = lo.abs().max(hi.abs()).max_element();
            self.reach = self.reach.max(far);
        }
    }

    /// A binary tree over the boxes, whose leaves hold one each.
    pub fn binary(&self, options: ObvhsOptions) -> Bvh2 {
        let p = options.preset.parameters();
        let mut bvh = PlocBuilder::with_capacity(self.boxes.len()).build(
            p.ploc_search_distance,
            &self.boxes,
            (0..self.boxes.len() as u32).collect(),
            p.sort_precision,
            p.search_depth_threshold,
        );
        bvh.uses_spatial_splits = options.splits;
        ReinsertionOptimizer::default().run(&mut bvh, p.reinsertion_batch_ratio, None);
        bvh
    }
}

/// A box around an object's padded primitives; `None` for one without any.
fn object_bounds(object: &Geometry) -> Option<(Vec3, Vec3)> {
    let all = (0..object.prim_count() as u32).map(|p| padded_bounds(object, p));
    all.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Boxes of triangles, large ones cut by the crate's own rule.
fn pieces(geometry: &Geometry) -> (Vec<Aabb>, Vec<u32>) {
    let numbers = 0..geometry.triangles.len() as u32;
    let triangle = |t: u32| {
        let [v0, v1, v2] = geometry.corners(t).map(Vec3A::from);
        Triangle { v0, v1, v2 }
    };
    let triangles: Vec<Triangle> = numbers.clone().into_par_iter().map(triangle).collect();
    let mut boxes: Vec<Aabb> = triangles.par_iter().map(Triangle::aabb).collect();
    let mut prims: Vec<u32> = numbers.collect();
    if boxes.is_empty() {
        return (boxes, prims);
    }
    let areas = || boxes.iter().map(Aabb::half_area);
    let (mean, largest) = (
        areas().sum::<f32>() / boxes.len() as f32,
        areas().fold(0.0, f32::max),
    );
    split_aabbs_preset(&mut boxes, &mut prims, &triangles, mean, largest);
    // A cut point is rounded three times, by no more than the triangle is large.
    for (b, prim) in boxes.iter_mut().zip(&prims) {
        let (lo, hi) = geometry.prim_bounds(*prim);
        let pad = Vec3A::from(lo.abs().max(hi.abs()) * (4.0 * f32::EPSILON));
        let (lo, hi): (Vec3A, Vec3A) = (Vec3::into(lo), Vec3::into(hi));
        *b = Aabb::new((b.min - pad).max(lo), (b.max + pad).min(hi));
    }
    (boxes, prims)
}
