//! The integral over what the wavelength mutation reaches from a path that disperses: the spectrum, against sums over it
//! formed as tracers of light and of paths would.

use super::integral::{Regions, compared, find, proposals};
use super::integral_caustic::to_lens;
use super::integral_lens::through_chains;
use super::scenes::{Contents, GLASS, Room, WEDGE, copy, with_room};
use super::stats::Verdict;
use crate::mutation::dispersion::Form;
use crate::mutation::{Strategy, Workspace};
use crate::path::{Path, Pool, Tally};
use crate::real::Real;
use crate::scene::spectrum::Lanes;

/// x with its vertices where they are, at other wavelengths.
fn at<const N: usize>(
    world: &Room,
    x: &Path<N>,
    pool: &Pool<N>,
    lanes: Lanes<N>,
) -> (Path<N>, Pool<N>) {
    let mut other = Pool::new(x.links.len());
    let mut y = copy(x, pool, &mut other, world.max_edges);
    for l in &y.links {
        let v = *other.get(l.slot);
        *other.get_mut(l.slot) = v.at_wavelengths(&world.emitters, world.scene, &lanes);
    }
    y.lanes = lanes;
    y.relink(world, &other, 0, x.k());
    (y, other)
}

/// From a path whose retraced part `wanted` likes. `tau` is what a path brings at its wavelengths.
fn dispersion<const N: usize>(
    contents: Contents,
    wanted: impl Fn(Form) -> bool,
    tau: impl Fn(&Room, &Path<N>, &Pool<N>, &mut Tally) -> Option<f64>,
) {
    with_room(contents, 0.0, 6, |world| {
        let mut ws = Workspace::<N>::new(world.max_edges);
        let mut x = find(world, &mut ws, |x, pool| wanted(Form::of(x, pool)));
        let (mut sums, mut expected, mut now) =
            (Regions::default(), Regions::default(), Vec::new());
        let cell = |u: Real| [(3, (u * 8.0) as u32), (0, 0)];
        let n = 200_000;
        proposals(
            world,
            Strategy::Wavelength,
            &mut x,
            &mut ws,
            n,
            |r, _, ws, _| {
                now.extend(r.iter().flat_map(|r| cell(ws.y.lanes.u).map(|c| (c, *r))));
                sums.add(&mut now);
            },
        );
        let mut tally = Tally::default();
        let here = tau(world, &x, &ws.pool, &mut tally).expect("x itself");
        for i in 0..n {
            let lanes = Lanes::new((i as Real + 0.5) / n as Real);
            let (y, pool) = at(world, &x, &ws.pool, lanes);
            if let Some(t) = tau(world, &y, &pool, &mut tally).filter(|t| *t > 0.0) {
                now.extend(cell(lanes.u).map(|c| (c, t / here)));
            }
            expected.add(&mut now);
        }
        let mut all = Vec::new();
        compared("spectrum", &sums, &expected, &mut all);
        Verdict::judge(all, "spectrum", 0.04);
    });
}

/// LSSDE: the spot moves over the floor with its colour.
#[test]
fn wavelength_mutations_integrate_the_spectrum_behind_a_wedge() {
    dispersion::<1>(
        WEDGE,
        |f| matches!(f, Form::FromLight { from: 0, to: 3 }),
        |world, x, pool, tally| {
            let start = pool.get(x.links[0].slot);
            let ray = (world.leave(start, start.p, x.links[0].dir), x.links[0].dir);
            to_lens(world, x, pool, 0, ray, tally).map(|s| s.tau)
        },
    );
}

/// (L|D)DSSE: what is seen through a ball of glass.
#[test]
fn wavelength_mutations_integrate_the_spectrum_seen_through_glass() {
    dispersion::<4>(
        GLASS,
        |f| matches!(f, Form::FromEye { to } if to >= 2),
        |world, x, pool, tally| {
            let Form::FromEye { to } = Form::of(x, pool) else {
                return None;
            };
            through_chains(world, x, pool, to, x.raster, |w| w, tally)
        },
    );
}
