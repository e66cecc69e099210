//! The integral over what the multi-chain perturbation reaches: the raster points and turns around a path, against sums
//! over both formed as a path tracer would.

use super::integral::{Regions, compared, find, proposals};
use super::integral_lens::through_chains;
use super::scenes::{Contents, PLATE, POOL, image_cell, with_room};
use super::stats::Verdict;
use crate::mutation::multi_chain::TURN;
use crate::mutation::turn::{angle, turned};
use crate::mutation::{MultiChainPerturbation, Strategy, Workspace};
use crate::path::{Path, Tally};
use crate::real::{Convert, Real, Vec2};
use crate::sampling::Rng;
use crate::scatter::Mode;
use std::f64::consts::PI;

/// Vertices between chains: those whose directions turn.
fn between<const N: usize>(x: &Path<N>, first: usize) -> impl Iterator<Item = usize> + '_ {
    (first + 1..x.k()).filter(|&i| x.links[i].mode == Mode::NonSpecular)
}

/// From a path of `k` edges whose first replaced vertex is `from`.
fn multi_chain<const N: usize>(
    contents: Contents,
    aperture: Real,
    k: usize,
    from: usize,
    least: f64,
) {
    with_room(contents, aperture, 6, |world| {
        let mut ws = Workspace::<N>::new(world.max_edges);
        let mut x = find(world, &mut ws, |x, pool| {
            let middle = 0.5 * (world.lens.lo + world.lens.hi);
            x.k() == k
                && MultiChainPerturbation::suits(x, pool) == Some(from)
                && (x.raster - middle).abs().max_element() < 9.0
        });
        let r2 = world.lens.perturbation as f64;
        let spread = world.lens.perturbation_range as f64;
        let (mut sums, mut expected) = (Regions::default(), Regions::default());
        let mut now = Vec::new();
        let cell = |r: Vec2| [(2, image_cell(world, r)), (0, 0)];
        let at = x.raster;
        let n = 500_000;
        proposals(
            world,
            Strategy::MultiChain,
            &mut x,
            &mut ws,
            n,
            |r, x, ws, _| {
                if let Some(r) = r {
                    // The density of y in the measure of raster points and turned directions.
                    let d2 = (ws.y.raster - at).double().length_squared();
                    let mut density = 1.0 / (2.0 * PI * d2 * spread);
                    for i in between(x, from) {
                        let theta = angle(x.links[i - 1].dir, ws.y.links[i - 1].dir);
                        density *= TURN.per_solid_angle(theta);
                    }
                    now.extend(cell(ws.y.raster).map(|c| (c, r / density)));
                }
                sums.add(&mut now);
            },
        );
        let mut tally = Tally::default();
        let here =
            through_chains(world, &x, &ws.pool, from, at, |w| w, &mut tally).expect("x itself");
        let mut rng = Rng::new(0x9e, 102, 0, 0);
        let (inner, outer) = ((r2 * (-spread).exp()).powi(2), r2 * r2);
        let (narrow, wide) = (0.0001f64.cos(), 0.1f64.cos());
        let turns = between(&x, from).count() as i32;
        let measure = PI * (outer - inner) * (2.0 * PI * (narrow - wide)).powi(turns);
        for i in 0..n {
            rng.set_step(i);
            let r = (inner + (outer - inner) * rng.next_f64()).sqrt() as Real;
            let raster = at + Vec2::from_angle(2.0 * PI as Real * rng.next_f32()) * r;
            let turn = |w| {
                let theta = (narrow + (wide - narrow) * rng.next_f64()).acos();
                turned(w, theta, 2.0 * PI * rng.next_f64())
            };
            if world.lens.contains(raster)
                && let Some(t) = through_chains(world, &x, &ws.pool, from, raster, turn, &mut tally)
                && t > 0.0
            {
                now.extend(cell(raster).map(|c| (c, t / here * measure)));
            }
            expected.add(&mut now);
        }
        let mut all = Vec::new();
        compared("ring", &sums, &expected, &mut all);
        Verdict::judge(all, "ring", least);
    });
}

/// LSDSE, and LSSDE, whose chain at the lens is empty.
#[test]
fn multi_chain_perturbations_integrate_chains_that_end_on_an_emitter() {
    multi_chain::<4>(POOL, 0.0, 4, 0, 0.05);
    multi_chain::<1>(POOL, 0.02, 4, 0, 0.05);
    multi_chain::<4>(PLATE, 0.0, 4, 0, 0.06);
    multi_chain::<1>(PLATE, 0.02, 4, 0, 0.06);
}

/// L(D)DSDSE, and L(D)DSSDE.
#[test]
fn multi_chain_perturbations_integrate_chains_that_are_joined() {
    multi_chain::<4>(POOL, 0.0, 5, 1, 0.1);
    multi_chain::<4>(POOL, 0.0, 6, 2, 0.15);
    multi_chain::<4>(PLATE, 0.0, 5, 1, 0.1);
    multi_chain::<4>(PLATE, 0.02, 6, 2, 0.15);
}
