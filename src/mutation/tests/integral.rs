//! For a fixed x and regions A of path space, the mean of 1_A(y)·τ(y)/T(x→y) over proposals is ∫_A τ over what the
//! strategy can reach: a density that is wrong anywhere, also by a factor that cancels in every ratio, shows.

use super::scenes::{BOX, Cell, FAMILIES, GLASS, GLOSSY, Room, Seeds, copy, image_cell, with_room};
use super::stats::{Compared, ENOUGH, Moments, Verdict};
use super::{propose, suits};
use crate::integrator::{Paths, radiance};
use crate::mutation::{Bidirectional, Context, LensPerturbation, Strategy, Workspace};
use crate::path::{
    Emitters, Ends, Heuristic, Path, Pool, Sampler, Tally, Vertex, deflect, scatter_terms, trace,
};
use crate::sampling::Rng;
use crate::scatter::{Mode, Transport};
use crate::scene::spectrum::{Lanes, Spectrum};
use glam::Vec2;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Sums by (family, cell), and the number of samples.
#[derive(Default)]
struct Regions(BTreeMap<(usize, u32), Moments>, u64);

impl Regions {
    /// One sample: the weights of its paths, cell by cell.
    fn add(&mut self, parts: &mut Vec<((usize, u32), f64)>) {
        self.1 += 1;
        parts.sort_by_key(|p| p.0);
        for group in parts.chunk_by(|a, b| a.0 == b.0) {
            let v = group.iter().map(|p| p.1).sum();
            self.0.entry(group[0].0).or_default().add(v);
        }
        parts.clear();
    }
}

fn compared(what: &str, measured: &Regions, expected: &Regions, into: &mut Vec<Compared>) {
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
fn find<const N: usize>(
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
fn proposals<const N: usize>(
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
            tally: &mut tally,
            indirect_only: false,
            weigh_deletions: true,
        };
        ws.begin();
        let r = propose(strategy, x, ws, &mut ctx);
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
            &x.lanes,
            &lens,
            w,
            Paths::All,
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
fn bidirectional<const N: usize>(inside: &str, k: usize, least: f64) {
    with_room(inside, 0.0, 5, |world| {
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

/// τ of what is seen at `raster` through the specular chain of x and lit by x's kept part, formed as a path tracer does.
fn through_chain<const N: usize>(
    world: &Room,
    x: &Path<N>,
    pool: &Pool<N>,
    first: usize,
    raster: Vec2,
    tally: &mut Tally,
) -> Option<f64> {
    let k = x.k();
    let mut cur: Vertex<N> = *pool.get(x.slots[k]);
    let mut w = world.lens.direction(cur.p, raster);
    let mut f = Spectrum::ONE;
    let mut dispersive = x.slots[..first]
        .iter()
        .any(|&s| pool.get(s).bsdf.is_dispersive());
    for i in (first..k).rev() {
        let next = trace(world, &cur, w, &x.lanes, tally)?;
        dispersive |= next.bsdf.is_dispersive();
        let back = -w;
        if i > first {
            w = deflect(&next, back, x.links[i].mode, Transport::FromEye)?;
            let t = scatter_terms(&next, x.links[i].mode, w, back);
            f *= t.fs * next.cos(w) as f32;
        } else if first == 0 {
            f *= world.emitters.radiance(world.scene, &x.lanes, &next, back);
        } else {
            let from = pool.get(x.slots[first - 1]);
            let (to_light, d2) = next.towards(from);
            f *= scatter_terms(&next, Mode::NonSpecular, to_light, back).fs;
            f *= if first == 1 {
                world
                    .emitters
                    .radiance(world.scene, &x.lanes, from, -to_light)
            } else {
                let w_l = -x.links[first - 2].dir;
                scatter_terms(from, Mode::NonSpecular, w_l, -to_light).fs
            };
            f = f * (next.cos(to_light) * from.cos(to_light) / d2) as f32;
            if !world.visible(&next, from, tally) {
                return None;
            }
        }
        cur = next;
    }
    for j in 0..first.saturating_sub(1) {
        f *= x.links[j].fs;
    }
    if dispersive && N > 1 {
        f = Spectrum::from_fn(|i| if i == 0 { f[0] * N as f32 } else { 0.0 });
    }
    Some(f.dot(x.lanes.target) as f64).filter(|_| first > 0 || Emitters::can_be_hit(&cur))
}

/// The lens perturbation over the ring of raster points that it reaches.
fn lens<const N: usize>(inside: &str, aperture: f32, specular: usize, least: f64) {
    with_room(inside, aperture, 6, |world| {
        let mut ws = Workspace::<N>::new(world.max_edges);
        let mut x = find(world, &mut ws, |x, pool| {
            let Some(first) = LensPerturbation::suits(x, pool) else {
                return false;
            };
            let inner = x.k() - 1 - first;
            let middle = 0.5 * (world.lens.lo + world.lens.hi);
            inner == specular && first >= 2 && (x.raster - middle).abs().max_element() < 8.0
        });
        let first = LensPerturbation::suits(&x, &ws.pool).expect("found");
        let r2 = world.lens.perturbation as f64;
        let spread = world.lens.perturbation_range as f64;
        let (mut sums, mut expected) = (Regions::default(), Regions::default());
        let mut now = Vec::new();
        let cell = |r: Vec2| [(2, image_cell(world, r)), (0, 0)];
        let at = x.raster;
        proposals(
            world,
            Strategy::Lens,
            &mut x,
            &mut ws,
            200_000,
            |r, _, ws, _| {
                if let Some(r) = r {
                    // The density of y in the raster measure.
                    let d2 = (ws.y.raster - at).as_dvec2().length_squared();
                    let density = 1.0 / (2.0 * PI * d2 * spread);
                    now.extend(cell(ws.y.raster).map(|c| (c, r / density)));
                }
                sums.add(&mut now);
            },
        );
        let mut tally = Tally::default();
        let here = through_chain(world, &x, &ws.pool, first, at, &mut tally).expect("x itself");
        let mut rng = Rng::new(0x9e, 101, 0, 0);
        let (inner, outer) = ((r2 * (-spread).exp()).powi(2), r2 * r2);
        for i in 0..300_000 {
            rng.set_step(i);
            let r = (inner + (outer - inner) * rng.next_f64()).sqrt() as f32;
            let raster = at + Vec2::from_angle(2.0 * PI as f32 * rng.next_f32()) * r;
            if world.lens.contains(raster)
                && let Some(t) = through_chain(world, &x, &ws.pool, first, raster, &mut tally)
                && t > 0.0
            {
                let v = t / here * PI * (outer - inner);
                now.extend(cell(raster).map(|c| (c, v)));
            }
            expected.add(&mut now);
        }
        let mut all = Vec::new();
        compared("ring", &sums, &expected, &mut all);
        let v = Verdict::new(all);
        println!("{}", v.report());
        assert!(v.passes(), "{}", v.report());
        println!("detects {}", v.detects("ring"));
        assert!(v.detects("ring") < least, "{}", v.detects("ring"));
    });
}

#[test]
fn lens_perturbations_integrate_what_is_seen_around() {
    lens::<4>(BOX, 0.0, 0, 0.03);
    lens::<4>(GLOSSY, 0.03, 0, 0.03);
}

#[test]
fn lens_perturbations_integrate_what_is_seen_through_specular_chains() {
    lens::<4>(GLASS, 0.0, 1, 0.03);
    lens::<4>(GLASS, 0.0, 2, 0.03);
    lens::<1>(GLASS, 0.02, 2, 0.03);
}

#[test]
fn wavelength_mutations_integrate_the_spectrum() {
    with_room(GLOSSY, 0.0, 6, |world| {
        let mut ws = Workspace::<1>::new(world.max_edges);
        let mut x = find(world, &mut ws, |x, pool| {
            x.k() == 4 && suits(Strategy::Wavelength, x, pool)
        });
        let (mut sums, mut expected, mut now) =
            (Regions::default(), Regions::default(), Vec::new());
        let cell = |u: f32| [(3, (u * 8.0) as u32)];
        proposals(
            world,
            Strategy::Wavelength,
            &mut x,
            &mut ws,
            100_000,
            |r, _, ws, _| {
                now.extend(r.iter().flat_map(|r| cell(ws.y.lanes.u).map(|c| (c, *r))));
                sums.add(&mut now);
            },
        );
        let n = 100_000;
        for i in 0..n {
            let lanes = Lanes::new((i as f32 + 0.5) / n as f32);
            let mut f = Spectrum::ONE;
            for j in 0..x.k() {
                let v = ws.pool.get(x.slots[j]).at_wavelengths(world.scene, &lanes);
                f *= if j == 0 {
                    world
                        .emitters
                        .radiance(world.scene, &lanes, &v, x.links[0].dir)
                } else {
                    let (from, to) = (-x.links[j - 1].dir, x.links[j].dir);
                    scatter_terms(&v, x.links[j].mode, from, to).fs
                };
            }
            let lens = x.links[x.k()].fs.dot(lanes.target) as f64;
            let tau = f[0] as f64 * lens / (x.shape_tau * 2f64.powi(x.shape_exp));
            now.extend(cell(lanes.u).map(|c| (c, tau)));
            expected.add(&mut now);
        }
        let mut all = Vec::new();
        compared("spectrum", &sums, &expected, &mut all);
        let v = Verdict::new(all);
        println!("{}", v.report());
        assert!(v.passes(), "{}", v.report());
        assert!(v.detects("spectrum") < 0.06, "{}", v.detects("spectrum"));
    });
}
