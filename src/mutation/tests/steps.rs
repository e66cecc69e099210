//! What holds in every single step: kept positions, the pool's books, the densities, the way back.

use super::ratio;
use super::scenes::{
    BOX, Contents, GLASS, GLOSSY, OPEN, PLATE, POOL, Room, Seeds, WEDGE, copy, with_room,
};
use crate::chain::Direct;
use crate::mutation::{Context, Strategy, Wavelength, Workspace};
use crate::path::{Path, Pool, Tally};
use crate::real::{Real, Vec3};
use crate::sampling::Rng;

/// A walk by one strategy after another; `f` looks at each proposal: (strategy, x, y, the context, the workspace,
/// its ratio) before it is decided on.
fn walk<const N: usize>(
    world: &Room,
    direct: Direct,
    steps: u64,
    mut f: impl FnMut(&Step<N>, &Context<crate::accel::Embree>),
) -> [u64; Strategy::ALL.len()] {
    let indirect_only = direct == Direct::Separate;
    let mut seeds = Seeds::<N>::new(world, indirect_only);
    let mut rng = Rng::new(0x57e9, 93, 0, 0);
    let mut ws = Workspace::<N>::new(world.max_edges);
    let capacity = ws.pool.free_slots();
    let mut accepted = [0; Strategy::ALL.len()];
    let mut x: Option<Path<N>> = None;
    for step in 0..steps {
        rng.set_step(step);
        // A new seed now and then, so that no walk is stuck in one part of path space.
        if step % 1000 == 0 && seeds.draw(world, &mut rng) > 0.0 {
            ws.pool.reset();
            let (path, pool) = seeds.sampler.joined();
            x = Some(copy(path, pool, &mut ws.pool, world.max_edges));
        }
        let Some(x) = &mut x else { continue };
        let at = (step % Strategy::ALL.len() as u64) as usize;
        let strategy = Strategy::ALL[at];
        if !strategy.suits(world.dispersive, x, &ws.pool) {
            continue;
        }
        let mut tally = Tally::default();
        let mut local = rng;
        let mut ctx = Context {
            world,
            rng: &mut local,
            entries: None,
            tally: &mut tally,
            indirect_only,
            weigh_deletions: step % 2000 < 1000,
        };
        ws.begin(x);
        let before = positions(x, &ws.pool);
        let slots: Vec<u16> = x.links.iter().map(|l| l.slot).collect();
        let r = strategy.propose(x, &mut ws, &mut ctx);
        assert!(
            x.links.iter().map(|l| &l.slot).eq(&slots),
            "{strategy:?} changed x"
        );
        assert_eq!(positions(x, &ws.pool), before, "{strategy:?} moved x");
        let Some(r) = r else {
            assert_eq!(tally.impossible(), 0);
            ws.reject();
            assert_eq!(ws.pool.free_slots(), capacity - x.links.len());
            continue;
        };
        assert!(r.is_finite() && r >= 0.0, "{strategy:?}: ratio {r}");
        // No way back: only if the deleted part cannot be made again, and then importance sampling never deletes it.
        if r == 0.0 {
            let until = x.links.len() + 1 - ws.ends.eye;
            assert!(!ctx.weigh_deletions && strategy == Strategy::Bidirectional);
            assert!(x.rho[ws.ends.light..until].iter().all(|r| *r == 0.0));
        }
        f(
            &Step {
                index: step,
                strategy,
                x,
                ws: &ws,
                ratio: r,
            },
            &ctx,
        );
        assert_eq!(tally.impossible(), 0);
        if local.next_f64() < r {
            ws.accept(x);
            accepted[at] += 1;
        } else {
            ws.reject();
        }
        assert_eq!(
            ws.pool.free_slots(),
            capacity - x.links.len(),
            "{strategy:?} leaks"
        );
    }
    accepted
}

/// A proposal that was constructed.
struct Step<'a, const N: usize> {
    index: u64,
    strategy: Strategy,
    x: &'a Path<N>,
    ws: &'a Workspace<N>,
    ratio: f64,
}

fn positions<const N: usize>(x: &Path<N>, pool: &Pool<N>) -> Vec<Vec3> {
    x.links.iter().map(|l| pool.get(l.slot).p).collect()
}

/// Every strategy that has paths in the room had its share of accepted steps.
fn all_moved(contents: Contents, accepted: [u64; Strategy::ALL.len()], least: u64) {
    for (s, n) in Strategy::ALL.into_iter().zip(accepted) {
        println!("{s:?}: {n} steps");
        if s != Strategy::MultiChain || contents.chains {
            assert!(n >= least, "{s:?}: only {n} steps");
        }
    }
}

#[test]
fn kept_positions_keep_their_bits_and_no_slot_is_lost_in_a_million_steps() {
    for (contents, aperture) in [(GLASS, 0.0), (GLOSSY, 0.03), (POOL, 0.02)] {
        let accepted = with_room(contents, aperture, 6, |world| {
            walk::<4>(world, Direct::InChain, 500_000, |s, _| {
                if s.index % 7 != 0 {
                    return;
                }
                let (x, y) = (positions(s.x, &s.ws.pool), positions(&s.ws.y, &s.ws.pool));
                let kept = match s.strategy {
                    Strategy::Wavelength => {
                        Wavelength::form(world.dispersive, s.x, &s.ws.pool).kept(x.len())
                    }
                    _ => (s.ws.ends.light, s.ws.ends.eye),
                };
                assert_eq!(x[..kept.0], y[..kept.0], "{:?}", s.strategy);
                assert_eq!(x[x.len() - kept.1..], y[y.len() - kept.1..]);
                // A slot is never in a path twice, nor in both but where it is kept.
                let kept = s.x.links.iter().map(|l| l.slot);
                let mut all: Vec<u16> = kept.chain(s.ws.fresh()).collect();
                all.sort_unstable();
                all.dedup();
                assert_eq!(all.len(), s.x.links.len() + s.ws.fresh().count());
            })
        });
        all_moved(contents, accepted, 2_000);
    }
}

/// A new sub-path that leaves what is kept through the same delta lobes ends where the old one did: the proposal is x itself.
/// To the bit, or it would move by the same roundings again and again. That random directions come so near has a probability
/// of some 10⁻⁸.
#[test]
fn bidirectional_mutations_that_change_nothing_move_nothing() {
    for (contents, aperture) in [(PLATE, 0.0), (POOL, 0.02), (GLASS, 0.03)] {
        let mut unchanged = 0;
        with_room(contents, aperture, 6, |world| {
            walk::<4>(world, Direct::InChain, 300_000, |s, _| {
                if s.strategy != Strategy::Bidirectional || s.x.k() != s.ws.y.k() {
                    return;
                }
                let (x, y) = (positions(s.x, &s.ws.pool), positions(&s.ws.y, &s.ws.pool));
                if x.iter().zip(&y).all(|(x, y)| x.distance(*y) < 1e-4) {
                    assert_eq!(x, y);
                    unchanged += 1;
                }
            });
        });
        println!("{unchanged} unchanged");
        assert!(unchanged > 1000);
    }
}

/// The path pushed anew, everything computed from its vertices and modes alone.
fn rebuilt<const N: usize>(world: &Room, x: &Path<N>, pool: &Pool<N>) -> Path<N> {
    let mut y = x.clone_capacity(world.max_edges);
    for link in &x.links {
        y.push(link.slot, link.mode);
    }
    y.relink(world, pool, 0, x.k());
    assert!(
        y.measure(world, pool, &mut Tally::default()),
        "a path of the chain carries nothing"
    );
    assert!(y.strategies(), "a path of the chain has no strategy");
    y
}

/// The same functions see the same vertices, so they give the same bits whatever the path went through.
fn same<const N: usize>(x: &Path<N>, y: &Path<N>) {
    for (i, (a, b)) in x.links.iter().zip(&y.links).enumerate() {
        assert_eq!(a.fs, b.fs, "f_s of x{i}");
        assert_eq!((a.pl, a.pe), (b.pl, b.pe), "densities of x{i}");
        assert_eq!((a.prob_l, a.prob_e), (b.prob_l, b.prob_e), "modes of x{i}");
        if i < x.k() {
            assert_eq!((a.g, a.inv_d2, a.dir), (b.g, b.inv_d2, b.dir), "edge {i}");
        }
    }
    assert_eq!((x.shape, x.shape_exp), (y.shape, y.shape_exp));
    assert_eq!((x.shape_tau, x.raster), (y.shape_tau, y.raster));
    if x.known {
        let n = x.k() + 2;
        assert_eq!((&x.rho[..n], x.total), (&y.rho[..n], y.total));
        assert_eq!(&x.deletion[..=n], &y.deletion[..=n]);
        assert_eq!(x.deletion_sum, y.deletion_sum);
    }
}

/// Densities on the way against densities from scratch, and the ratio of the way back.
pub(super) fn proposals_agree<const N: usize>(contents: Contents, aperture: Real, direct: Direct) {
    with_room(contents, aperture, 6, |world| {
        let mut seen = [0u64; Strategy::ALL.len()];
        let accepted = walk::<N>(world, direct, 150_000, |s, ctx| {
            let (x, y) = (
                rebuilt(world, s.x, &s.ws.pool),
                rebuilt(world, &s.ws.y, &s.ws.pool),
            );
            same(s.x, &x);
            same(&s.ws.y, &y);
            if s.ratio == 0.0 {
                return;
            }
            let back = ratio(s.strategy, &y, &x, &s.ws.pool, s.ws.ends, ctx);
            // A quotient of two quotients, each rounded a dozen times at most.
            let tolerance = 32.0 * f64::EPSILON;
            assert!(
                (back * s.ratio - 1.0).abs() < tolerance,
                "{:?}: {} there, {back} back",
                s.strategy,
                s.ratio
            );
            // The way back begins where the way there ended.
            assert!(s.strategy.suits(world.dispersive, &y, &s.ws.pool));
            seen[s.strategy as usize] += 1;
        });
        all_moved(contents, accepted, 200);
        all_moved(contents, seen, 400);
    });
}

#[test]
fn densities_and_ways_back_agree_in_a_diffuse_box() {
    proposals_agree::<1>(BOX, 0.0, Direct::InChain);
}

#[test]
fn densities_and_ways_back_agree_among_specular_paths() {
    proposals_agree::<4>(GLASS, 0.0, Direct::InChain);
}

#[test]
fn densities_and_ways_back_agree_under_a_plate_of_glass() {
    proposals_agree::<4>(PLATE, 0.0, Direct::Separate);
}

#[test]
fn densities_and_ways_back_agree_behind_a_wedge_of_flint_glass() {
    proposals_agree::<4>(WEDGE, 0.0, Direct::Separate);
}

#[test]
fn densities_and_ways_back_agree_through_the_surface_of_a_pool() {
    proposals_agree::<4>(POOL, 0.02, Direct::InChain);
}

#[test]
fn densities_and_ways_back_agree_among_glossy_vertices_under_a_thin_lens() {
    proposals_agree::<4>(GLOSSY, 0.03, Direct::Separate);
}

#[test]
fn densities_and_ways_back_agree_under_a_sky_a_sun_and_a_bulb() {
    proposals_agree::<4>(OPEN, 0.0, Direct::InChain);
}
