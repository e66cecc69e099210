//! The rays that backends are timed with: what a renderer asks of a scene, from the most orderly to the least.

use crate::accel::record::{Kind, Recorder};
use crate::accel::{Accel, Ray, Surface, closest, surface, visible};
use crate::chain::{MltOptions, Shares};
use crate::integrator::{Budget, Quiet, mlt};
use crate::path::{Kind as Place, LightPoint, Palette, Tally, Vertex, World};
use crate::real::{Convert, Real, Vec2};
use crate::sampling::{Rng, warp};
use crate::scatter::Frame;
use crate::scene::Scene;
use rayon::prelude::*;

/// Stage of the random streams, apart from those of a render.
const STAGE: u32 = 100;
/// Side of the squares in which pixels are visited.
const TILE: usize = 8;
/// Pieces that a recorded render is cut down to.
const PIECES: usize = 64;
/// Least and most rounds of the recorded render; one is 16 384 mutations.
const ROUNDS: [u64; 2] = [4, 64];
/// Rays wanted for each round: about as many as a round asks.
const PER_ROUND: usize = 120_000;
/// Its seeding samples in each group.
const SEEDS: u32 = 256;

/// Rays of one kind.
pub struct RaySet {
    /// primary, shadow, bounce, mlt, recorded.
    pub name: String,
    /// What they ask for.
    pub kind: Kind,
    /// The rays, in the order they are asked in.
    pub rays: Vec<Ray>,
}

impl RaySet {
    /// Name with the kind.
    pub fn title(&self) -> String {
        let kind = match self.kind {
            Kind::Closest => "closest",
            Kind::Any => "any",
        };
        format!("{}-{kind}", self.name)
    }

    /// Rays of both kinds told apart, each in its order.
    pub fn split(name: &str, rays: &[(Ray, Kind)]) -> Vec<Self> {
        let of = |kind| Self {
            name: name.to_owned(),
            kind,
            rays: rays.iter().filter(|r| r.1 == kind).map(|r| r.0).collect(),
        };
        let both = [of(Kind::Closest), of(Kind::Any)];
        both.into_iter().filter(|s| !s.rays.is_empty()).collect()
    }
}

/// Rays of a scene, about `count` of each set. Depends on the scene and `count` alone.
pub fn of_scene<A: Accel>(scene: &Scene, accel: &A, count: usize) -> Vec<RaySet> {
    let world = World::new(scene, accel, scene.settings.max_depth);
    let primary = primary(&world, count);
    let hits: Vec<Surface> = primary
        .par_iter()
        .map(Ray::own)
        .filter_map(|r| Some(surface(&scene.geometry, &closest(accel, &r)?, &r)))
        .collect();
    let set = |name: &str, kind, rays| RaySet {
        name: name.to_owned(),
        kind,
        rays,
    };
    let shadow = shadow(&world, &hits);
    let bounce = hits.iter().enumerate().map(|(i, s)| {
        let mut rng = Rng::new(1, STAGE, 2, i as u32);
        // Seen from the camera's side or not: half the rays of a closed room would leave it otherwise.
        let side = (scene.camera.position.real() - s.p).dot(s.ng);
        let n = s.ng * (1.0 as Real).copysign(side);
        let d = Frame::from_normal(n).to_world(warp::cosine_hemisphere(rng.next_vec2()));
        s.ray(d).single()
    });
    let bounce = bounce.collect();
    let mut sets = vec![
        set("primary", Kind::Closest, primary),
        set("bounce", Kind::Closest, bounce),
        set("shadow", Kind::Any, shadow),
    ];
    sets.extend(RaySet::split("mlt", &metropolis(scene, accel, 2 * count)));
    sets.retain(|s| !s.rays.is_empty());
    sets
}

/// Camera rays, one through each cell of a grid of about `count` over the image, square by square. Anywhere in the cell:
/// on the grid itself they would run along edges of scenes that are as regular.
fn primary<A: Accel>(world: &World<A>, count: usize) -> Vec<Ray> {
    let size = world.lens.hi - world.lens.lo;
    let step = (size.element_product() / count as Real).sqrt();
    let [w, h] = [size.x, size.y].map(|s| ((s / step) as usize).max(1));
    let mut rays = Vec::with_capacity(w * h);
    for tile in 0..w.div_ceil(TILE) * h.div_ceil(TILE) {
        let (tx, ty) = (
            tile % w.div_ceil(TILE) * TILE,
            tile / w.div_ceil(TILE) * TILE,
        );
        for i in 0..TILE * TILE {
            let (x, y) = (tx + i % TILE, ty + i / TILE);
            if x >= w || y >= h {
                continue;
            }
            let mut rng = Rng::new(1, STAGE, 0, (y * w + x) as u32);
            let lens: Vertex<1> = world.lens.sample_vertex(rng.next_vec2());
            let at = Vec2::new(x as Real, y as Real) + rng.next_vec2();
            let at = at / Vec2::new(w as Real, h as Real);
            let d = world.lens.direction(lens.p, world.lens.sample_raster(at));
            rays.push(Ray {
                o: lens.p.single(),
                d: d.single(),
                t_max: f32::INFINITY,
            });
        }
    }
    rays
}

/// A ray from each surface point to a point of a light, chosen as a render chooses.
fn shadow<A: Accel>(world: &World<A>, hits: &[Surface]) -> Vec<Ray> {
    let recorder = Recorder::new(world.accel, usize::MAX);
    for (i, s) in hits.iter().enumerate() {
        let mut rng = Rng::new(1, STAGE, 1, i as u32);
        let palette = Palette::<1>::new(world.lanes(rng.next_f32()));
        let Some(x0) =
            world
                .emitters
                .sample_point(world.scene, &palette, LightPoint::new(&mut rng))
        else {
            break;
        };
        if x0.kind == Place::Infinite {
            recorder.occluded(&s.ray(x0.p).single());
        } else {
            visible(&recorder, s.p, s.error, s.ng, x0.p, x0.error, x0.normal());
        }
    }
    recorder.rays().into_iter().map(|r| r.0).collect()
}

/// About `count` rays of a Metropolis render on one thread, in pieces evenly taken from all of it.
fn metropolis<A: Accel>(scene: &Scene, accel: &A, count: usize) -> Vec<(Ray, Kind)> {
    let recorder = Recorder::new(accel, usize::MAX);
    let world = World::new(scene, &recorder, scene.settings.max_depth);
    let options = MltOptions {
        shares: Shares::for_scene(scene),
        // Seeding is a hundredth of a long render's rays and would be most of so short a one's.
        seeds: SEEDS,
        ..MltOptions::default()
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.expect("a thread starts").install(|| {
        let rounds = ((count / PER_ROUND) as u64).clamp(ROUNDS[0], ROUNDS[1]);
        let (budget, mut tally) = (Budget::Rounds(rounds), Tally::default());
        mlt::<4, _>(&world, &options, budget, 1, &Quiet, &mut tally)
    });
    let rays = recorder.rays();
    let piece = count / PIECES;
    let stride = rays.len() / PIECES;
    if stride <= piece {
        return rays;
    }
    let starts = (0..PIECES).map(|i| i * stride);
    starts.flat_map(|i| rays[i..i + piece].to_vec()).collect()
}
