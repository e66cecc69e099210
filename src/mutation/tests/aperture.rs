//! The suite under an aperture so wide that growing the light end as far as the lens (t = 0) has its part in everything,
//! and the integral over all paths that share the light end they keep.

use super::flux::{balanced, mixed};
use super::integral::{Regions, compared, find, proposals};
use super::scenes::{BOX, Contents, GLASS, Room, image_cell, with_room};
use super::stats::Verdict;
use super::steps::proposals_agree;
use crate::chain::Direct;
use crate::integrator::{Paths, radiance};
use crate::mutation::{Bidirectional, Strategy, Workspace};
use crate::path::{Ends, Kind, Palette, Path, Pool, Tally, Vertex, scatter, scatter_terms, trace};
use crate::real::{Real, Vec2};
use crate::sampling::Rng;
use crate::scatter::{Mode, Transport};
use crate::scene::spectrum::Spectrum;

/// Radius of the aperture in a room of side 1: a tenth of the light that falls on the wall behind it passes it.
const WIDE: Real = 0.35;

fn cells(world: &Room, k: usize, raster: Vec2, weight: f64) -> [((usize, u32), f64); 2] {
    [
        ((0, k as u32), weight),
        ((2, image_cell(world, raster)), weight),
    ]
}

/// Calls `f` for `n` random lens points and raster points.
fn views<const N: usize>(
    world: &Room,
    n: u64,
    mut f: impl FnMut(&Vertex<N>, Vec2, &mut Rng, &mut Vec<((usize, u32), f64)>),
) -> Regions {
    let (mut sums, mut now) = (Regions::default(), Vec::new());
    let mut rng = Rng::new(0xa9, 101, 0, 0);
    for i in 0..n {
        rng.set_step(i);
        let lens = world.lens.sample_vertex(rng.next_vec2());
        let raster = world.lens.sample_raster(rng.next_vec2());
        f(&lens, raster, &mut rng, &mut now);
        sums.add(&mut now);
    }
    sums
}

/// ∫τ over all paths, by path tracing.
fn all_paths<const N: usize>(world: &Room, x: &Path<N>, n: u64) -> Regions {
    let (mut tally, palette) = (Tally::default(), Palette::new(x.lanes));
    views::<N>(world, n, |lens, raster, rng, now| {
        let w = world.lens.direction(lens.p, raster);
        let f = |k: usize, c: Spectrum<N>| {
            let tau = c.dot(x.lanes.target) as f64 * world.lens.raster_area;
            now.extend(cells(world, k, raster, tau));
        };
        radiance(
            world,
            &palette,
            lens,
            w,
            Paths::All,
            None,
            rng,
            &mut tally,
            f,
        );
    })
}

/// ∫τ over all paths that begin with x0 … x_{a−1} of x, by walks from the eye that are connected to x_{a−1}. Formed
/// without links: f_s, G and W_e stand here as a path tracer has them.
fn from_kept<const N: usize>(
    world: &Room,
    x: &Path<N>,
    pool: &Pool<N>,
    a: usize,
    n: u64,
) -> Regions {
    let (mut tally, palette) = (Tally::default(), Palette::new(x.lanes));
    let z = pool.get(x.links[a - 1].slot);
    // Le·G and f_s of what is kept before z; towards w it leaves z as `before`·`leaving(w)`.
    let x0 = pool.get(x.links[0].slot);
    let (before, from) = match a {
        1 => (Spectrum::ONE, None),
        2 => {
            let (dir, inv_d2) = x0.towards(z);
            let le = world.emitters.radiance(world.scene, x0, dir);
            (le * (x0.cos(dir) * z.cos(dir) * inv_d2) as Real, Some(-dir))
        }
        _ => panic!("one or two vertices are kept"),
    };
    let leaving = |w| match from {
        None => world.emitters.radiance(world.scene, z, w),
        Some(l) => scatter_terms(z, Mode::NonSpecular, l, w).fs,
    };
    views::<N>(world, n, |lens, raster, rng, now| {
        let mut add = |k, raster, c: Spectrum<N>, scale: f64| {
            let tau = (before * c).dot(x.lanes.target) as f64 * scale;
            now.extend(cells(world, k, raster, tau));
        };
        // Straight from the lens point: its density cancels with the aperture's part of W_e.
        let (w, inv_d2) = lens.towards(z);
        if let Some(seen) = world.lens.raster(lens.p, w)
            && world.lens.contains(seen)
            && world.visible(lens, z, &mut tally)
        {
            let cos = lens.cos(w);
            let scale = world.lens.raster_per_solid_angle(cos) * z.cos(w) * inv_d2;
            add(a, seen, leaving(-w), scale);
        }
        let mut w = world.lens.direction(lens.p, raster);
        let (mut cur, mut beta) = (*lens, Spectrum::<N>::ONE);
        for edges in 1..=world.max_edges - a {
            let Some(v) = trace(world, &cur, w, &palette, &mut tally) else {
                return;
            };
            if v.kind != Kind::Surface {
                return;
            }
            let (to, inv_d2) = v.towards(z);
            let t = scatter_terms(&v, Mode::NonSpecular, to, -w);
            if !t.fs.is_black() && world.visible(&v, z, &mut tally) {
                let g = v.cos(to) * z.cos(to) * inv_d2;
                let c = beta * t.fs * leaving(-to);
                add(edges + a, raster, c, g * world.lens.raster_area);
            }
            let Some((next, mode)) = scatter(&v, -w, Transport::FromEye, rng) else {
                return;
            };
            let t = scatter_terms(&v, mode, next, -w);
            beta *= t.fs * (v.cos(next) / t.pdf_e) as Real;
            cur = v;
            w = next;
        }
    })
}

/// What the bidirectional mutation keeps here: nothing; x0; x0 and x1.
fn bidirectional<const N: usize>(contents: Contents, k: usize) {
    with_room(contents, WIDE, 4, |world| {
        let mut ws = Workspace::<N>::new(world.max_edges);
        // x1 near the lens, which then covers much of what it lights.
        let mut x = find(world, &mut ws, |x, pool| {
            x.k() == k && pool.get(x.links[1].slot).p.z < 0.7
        });
        let mut sums = [(); 3].map(|_| Regions::default());
        // Of those, what was made by growing the light end as far as the lens, taken for the only way.
        let mut on_lens = [(); 3].map(|_| Regions::default());
        let mut now = Vec::new();
        proposals(
            world,
            Strategy::Bidirectional,
            &mut x,
            &mut ws,
            5_000_000,
            |r, x, ws, ctx| {
                for light in 0..3 {
                    let (y, mut grown) = (&ws.y, Vec::new());
                    if r.is_some() && ws.ends == (Ends { light, eye: 0 }) {
                        let kept: f64 = x.links[..light].iter().map(|l| l.pl).product();
                        let there = Bidirectional::transition(x, y, ws.ends, ctx) / kept;
                        now.extend(cells(world, y.k(), y.raster, 1.0 / there));
                        if ws.from_eye.is_empty() {
                            let part = y.rho[y.k() + 1] / (y.rho_sum() - y.sum[light]);
                            grown.extend(cells(world, y.k(), y.raster, 1.0 / (there * part)));
                        }
                    }
                    sums[light].add(&mut now);
                    on_lens[light].add(&mut grown);
                }
            },
        );
        let mut all = Vec::new();
        let n = 200_000;
        for (a, what) in ["nothing", "x0", "x0 and x1"].into_iter().enumerate() {
            let expected = match a {
                0 => all_paths(world, &x, n),
                _ => from_kept(world, &x, &ws.pool, a, n),
            };
            compared(&format!("{what} kept"), &sums[a], &expected, &mut all);
            let alone = format!("{what} kept, onto the lens");
            compared(&alone, &on_lens[a], &expected, &mut all);
        }
        let v = Verdict::new(all);
        println!("{}", v.report());
        assert!(v.passes(), "{}", v.report());
        for what in ["nothing kept", "x0 kept", "x0 and x1 kept"] {
            for (what, least) in [(format!("{what}:"), 0.1), (format!("{what}, onto"), 0.3)] {
                println!("{what} detects {:.4}", v.detects(&what));
                assert!(v.detects(&what) < least, "{what} {}", v.detects(&what));
            }
        }
    });
}

#[test]
fn bidirectional_mutations_integrate_paths_onto_a_wide_lens() {
    bidirectional::<4>(BOX, 2);
}

#[test]
fn flux_is_balanced_under_a_wide_lens() {
    balanced::<4>(GLASS, WIDE, &mixed(Direct::InChain), 0.1);
}

#[test]
fn densities_and_ways_back_agree_under_a_wide_lens() {
    proposals_agree::<4>(GLASS, WIDE, Direct::InChain);
}
