//! For a fixed x and regions A of path space, the mean of 1_A(y)·τ(y)/T(x→y) over proposals is ∫_A τ over what the
//! strategy can reach: a density that is wrong anywhere, also by a factor that cancels in every ratio, shows.

use super::scenes::{BOX, Cell, Contents, FAMILIES, GLASS, GLOSSY, Room, Seeds, copy, with_room};
use super::stats::{Compared, ENOUGH, Moments, Verdict};
use crate::integrator::{Paths, radiance};
use crate::mutation::{Bidirectional, Context, Strategy, Workspace};
use crate::path::{Ends, Heuristic, Palette, Path, Pool, Sampler, Tally};
use crate::sampling::Rng;
use crate::scatter::Mode;
use crate::scene::spectrum::{Lanes, Spectrum};
use std::collections::BTreeMap;

/// Sums by (family, cell), and the number of samples.
#[derive(Default)]
pub(super) struct Regions(BTreeMap<(usize, u32), Moments>, u64);

impl Regions {
    /// One sample: the weights of its paths, cell by cell.
    pub(super) fn add(&mut self, parts: &mut Vec<((usize, u32), f64)>) {
        self.1 += 1;
        parts.sort_by_key(|p| p.0);
        for group in parts.chunk_by(|a, b| a.0 == b.0) {
            let v = group.iter().map(|p| p.1).sum();
            self.0.entry(group[0].0).or_default().add(v);
        }
        parts.clear();
    }
}

pub(super) fn compared(
    what: &str,
    measured: &Regions,
    expected: &Regions,
    into: &mut Vec<Compared>,
) {
    let (n, m) = (measured.1 as f64, expected.1 as f64);
    for (key, e) in &expected.0 {
        let a = measured.0.get(key).copied().unwrap_or_default();
        if e.effective() < ENOUGH || a.effective() < ENOUGH {
            continue;
        }
        into.push(Compared {
            what: format!("{what}: {} {:b}", FAMILIES[key.0], key.1),
            difference: a.mean(n) - e.mean(m),
            error: (a.variance(n) + e.variance(m)).sqrt(),
            scale: e.mean(m),
        });
    }
}

fn parts(cell: Cell, weight: f64, into: &mut Vec<((usize, u32), f64)>) {
    into.extend(cell.0.into_iter().enumerate().map(|key| (key, weight)));
}

/// The first seed that `wanted` likes, in the workspace's pool.
pub(super) fn find<const N: usize>(
    world: &Room,
    ws: &mut Workspace<N>,
    mut wanted: impl FnMut(&mut Path<N>, &Pool<N>) -> bool,
) -> Path<N> {
    let mut seeds = Seeds::<N>::new(world, false);
    let mut rng = Rng::new(0x9e, 97, 0, 0);
    for i in 0..100_000 {
        rng.set_step(i);
        if seeds.draw(world, &mut rng) > 0.0 {
            let (path, pool) = seeds.sampler.joined();
            ws.pool.reset();
            let mut x = copy(path, pool, &mut ws.pool, world.max_edges);
            if wanted(&mut x, &ws.pool) {
                return x;
            }
        }
    }
    panic!("no such path in the room");
}

/// Calls `f` for each of `n` proposals from x; `None` where none was made.
pub(super) fn proposals<const N: usize>(
    world: &Room,
    strategy: Strategy,
    x: &mut Path<N>,
    ws: &mut Workspace<N>,
    n: u64,
    mut f: impl FnMut(Option<f64>, &Path<N>, &Workspace<N>, &Context<crate::accel::Embree>),
) {
    let mut rng = Rng::new(0x9e, 98, 0, 0);
    let mut tally = Tally::default();
    for i in 0..n {
        rng.set_step(i);
        let mut ctx = Context {
            world,
            rng: &mut rng,
            entries: None,
            tally: &mut tally,
            indirect_only: false,
            weigh_deletions: true,
        };
        ws.begin(x);
        let r = strategy.propose(x, ws, &mut ctx);
        f(r, x, ws, &ctx);
        ws.reject();
    }
    assert_eq!(tally.impossible(), 0);
}

/// ∫τ over each cell at fixed wavelengths, by bidirectional sampling.
fn all_paths<const N: usize>(world: &Room, lanes: &Lanes<N>, n: u64) -> Regions {
    let mut sampler = Sampler::<N>::new(world.max_edges);
    let (mut sums, mut tally, mut now) = (Regions::default(), Tally::default(), Vec::new());
    let mut rng = Rng::new(0x9e, 99, 0, 0);
    for i in 0..n {
        rng.set_step(i);
        let raster = world.lens.sample_raster(rng.next_vec2());
        sampler.sample(world, lanes, raster, &mut rng, &mut tally);
        sampler.join(world, Heuristic::Balance, false, &mut tally, |j, _| {
            parts(Cell::of(world, j.path), j.weight, &mut now)
        });
        sums.add(&mut now);
    }
    sums
}

/// ∫τ over the paths of each length seen at x's raster point, by path tracing, which knows nothing of links.
fn seen_at<const N: usize>(world: &Room, x: &Path<N>, n: u64) -> Regions {
    let (mut sums, mut tally, mut now) = (Regions::default(), Tally::default(), Vec::new());
    let mut rng = Rng::new(0x9e, 100, 0, 0);
    let palette = Palette::new(x.lanes);
    for i in 0..n {
        rng.set_step(i);
        let lens = world.lens.sample_vertex(rng.next_vec2());
        let w = world.lens.direction(lens.p, x.raster);
        let f = |k: usize, c: Spectrum<N>| {
            let tau = c.dot(x.lanes.target) as f64;
            now.push(((0, k as u32), tau * world.lens.raster_area));
        };
        radiance(
            world,
            &palette,
            &lens,
            w,
            Paths::All,
            None,
            &mut rng,
            &mut tally,
            f,
        );
        sums.add(&mut now);
    }
    sums
}

/// What the bidirectional mutation keeps here: nothing; the pinhole; the pinhole and the vertex seen through it. All of
/// these reach every path, or every path seen at the same raster point.
fn bidirectional<const N: usize>(contents: Contents, k: usize, least: f64) {
    with_room(contents, 0.0, 5, |world| {
        let mut ws = Workspace::<N>::new(world.max_edges);
        let mut x = find(world, &mut ws, |x, _| {
            x.k() == k && x.links[k - 1].mode == Mode::NonSpecular
        });
        let mut sums = [(); 3].map(|_| Regions::default());
        let mut now = Vec::new();
        proposals(
            world,
            Strategy::Bidirectional,
            &mut x,
            &mut ws,
            600_000,
            |r, x, ws, ctx| {
                for (eye, s) in sums.iter_mut().enumerate() {
                    if r.is_some() && ws.ends == (Ends { light: 0, eye }) {
                        let there = Bidirectional::transition(x, &ws.y, ws.ends, ctx);
                        let cell = Cell::of(world, &ws.y);
                        parts(cell, 1.0 / there, &mut now);
                        if eye == 2 {
                            now.retain(|p| p.0.0 == 0);
                        }
                    }
                    s.add(&mut now);
                }
            },
        );
        let everything = all_paths(world, &x.lanes, 200_000);
        let here = seen_at(world, &x, 200_000);
        let mut all = Vec::new();
        compared("nothing kept", &sums[0], &everything, &mut all);
        compared("lens kept", &sums[1], &everything, &mut all);
        compared("lens and vertex kept", &sums[2], &here, &mut all);
        let v = Verdict::new(all);
        println!("{}", v.report());
        assert!(v.passes(), "{}", v.report());
        for what in ["nothing", "lens kept", "lens and"] {
            println!("{what}: detects {}", v.detects(what));
            assert!(v.detects(what) < least, "{what}: {}", v.detects(what));
        }
    });
}

#[test]
fn bidirectional_mutations_integrate_a_diffuse_box() {
    bidirectional::<4>(BOX, 3, 0.2);
}

#[test]
fn bidirectional_mutations_integrate_specular_paths() {
    bidirectional::<1>(GLASS, 3, 0.25);
}

#[test]
fn bidirectional_mutations_integrate_glossy_paths() {
    bidirectional::<4>(GLOSSY, 2, 0.2);
}
