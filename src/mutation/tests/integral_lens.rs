//! The integral over what the lens perturbation and the wavelength mutation reach, against sums over the raster and the
//! spectrum formed as a path tracer would, without links and densities.

use super::integral::{Regions, compared, find, proposals};
use super::scenes::{BOX, Contents, GLASS, GLOSSY, OPEN, Room, image_cell, with_room};
use super::stats::Verdict;
use crate::mutation::{LensPerturbation, Strategy, Workspace};
use crate::path::{Emitters, Palette, Path, Pool, Tally, Vertex, deflect, scatter_terms, trace};
use crate::real::{Convert, Real, Vec2, Vec3};
use crate::sampling::Rng;
use crate::scatter::{Mode, Transport};
use crate::scene::spectrum::{Lanes, Spectrum};
use std::f64::consts::PI;

/// τ of what is seen at `raster` through the specular chains of x and lit by x's kept part, formed as a path tracer does.
/// `turn` says where to go on between chains, given where x went.
pub(super) fn through_chains<const N: usize>(
    world: &Room,
    x: &Path<N>,
    pool: &Pool<N>,
    first: usize,
    raster: Vec2,
    mut turn: impl FnMut(Vec3) -> Vec3,
    tally: &mut Tally,
) -> Option<f64> {
    let palette = Palette::new(x.lanes);
    let k = x.k();
    let mut cur: Vertex<N> = *pool.get(x.links[k].slot);
    let mut w = world.lens.direction(cur.p, raster);
    let mut f = Spectrum::ONE;
    let mut dispersive = x.links[..first]
        .iter()
        .any(|l| pool.get(l.slot).bsdf.is_dispersive());
    for i in (first..k).rev() {
        let next = trace(world, &cur, w, &palette, tally)?;
        dispersive |= next.bsdf.is_dispersive();
        let back = -w;
        if i > first {
            w = if x.links[i].mode == Mode::NonSpecular {
                turn(-x.links[i - 1].dir)
            } else {
                deflect(&next, back, x.links[i].mode, Transport::FromEye)?
            };
            let t = scatter_terms(&next, x.links[i].mode, w, back);
            f *= t.fs * next.cos(w) as Real;
        } else if first == 0 {
            f *= world.emitters.radiance(world.scene, &next, back);
        } else {
            let from = pool.get(x.links[first - 1].slot);
            let (to_light, inv_d2) = next.towards(from);
            f *= scatter_terms(&next, Mode::NonSpecular, to_light, back).fs;
            f *= if first == 1 {
                world.emitters.radiance(world.scene, from, -to_light)
            } else {
                let w_l = -x.links[first - 2].dir;
                scatter_terms(from, Mode::NonSpecular, w_l, -to_light).fs
            };
            f = f * (next.cos(to_light) * from.cos(to_light) * inv_d2) as Real;
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
        f = Spectrum::from_fn(|i| if i == 0 { f[0] * N as Real } else { 0.0 });
    }
    Some(f.dot(x.lanes.target) as f64).filter(|_| first > 0 || Emitters::can_be_hit(&cur))
}

/// The lens perturbation over the ring of raster points that it reaches, from a path whose first replaced vertex `from`
/// likes.
fn lens<const N: usize>(
    contents: Contents,
    aperture: Real,
    specular: usize,
    from: fn(usize) -> bool,
    least: f64,
) {
    with_room(contents, aperture, 6, |world| {
        let mut ws = Workspace::<N>::new(world.max_edges);
        let mut x = find(world, &mut ws, |x, pool| {
            let Some(first) = LensPerturbation::suits(x, pool) else {
                return false;
            };
            // L is an end like D, only that it is not scattered at.
            let inner = x.k() - first - 1;
            let middle = 0.5 * (world.lens.lo + world.lens.hi);
            // The sky stands above the back wall, near the border.
            let near = if first == 0 { 10.5 } else { 8.0 };
            inner == specular && from(first) && (x.raster - middle).abs().max_element() < near
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
            600_000,
            |r, _, ws, _| {
                if let Some(r) = r {
                    // The density of y in the raster measure.
                    let d2 = (ws.y.raster - at).double().length_squared();
                    let density = 1.0 / (2.0 * PI * d2 * spread);
                    now.extend(cell(ws.y.raster).map(|c| (c, r / density)));
                }
                sums.add(&mut now);
            },
        );
        let mut tally = Tally::default();
        let here =
            through_chains(world, &x, &ws.pool, first, at, |w| w, &mut tally).expect("x itself");
        let mut rng = Rng::new(0x9e, 101, 0, 0);
        let (inner, outer) = ((r2 * (-spread).exp()).powi(2), r2 * r2);
        for i in 0..600_000 {
            rng.set_step(i);
            let r = (inner + (outer - inner) * rng.next_f64()).sqrt() as Real;
            let raster = at + Vec2::from_angle(2.0 * PI as Real * rng.next_f32()) * r;
            if world.lens.contains(raster)
                && let Some(t) =
                    through_chains(world, &x, &ws.pool, first, raster, |w| w, &mut tally)
                && t > 0.0
            {
                let v = t / here * PI * (outer - inner);
                now.extend(cell(raster).map(|c| (c, v)));
            }
            expected.add(&mut now);
        }
        let mut all = Vec::new();
        compared("ring", &sums, &expected, &mut all);
        Verdict::judge(all, "ring", least);
    });
}

#[test]
fn lens_perturbations_integrate_what_is_seen_around() {
    lens::<4>(BOX, 0.0, 0, |first| first >= 2, 0.03);
    lens::<4>(GLOSSY, 0.03, 0, |first| first >= 2, 0.03);
}

#[test]
fn lens_perturbations_integrate_what_is_seen_through_specular_chains() {
    lens::<4>(GLASS, 0.0, 1, |first| first >= 2, 0.03);
    lens::<4>(GLASS, 0.0, 2, |first| first >= 2, 0.03);
    lens::<1>(GLASS, 0.02, 2, |first| first >= 2, 0.03);
}

/// LS*E: a lamp seen in the mirror, and the sky.
#[test]
fn lens_perturbations_integrate_chains_that_end_on_an_emitter() {
    lens::<4>(GLASS, 0.02, 1, |first| first == 0, 0.05);
    lens::<4>(OPEN, 0.0, 0, |first| first == 0, 0.03);
}

#[test]
fn wavelength_mutations_integrate_the_spectrum() {
    with_room(GLOSSY, 0.0, 6, |world| {
        let mut ws = Workspace::<1>::new(world.max_edges);
        let mut x = find(world, &mut ws, |x, pool| {
            x.k() == 4 && Strategy::Wavelength.suits(world.dispersive, x, pool)
        });
        let (mut sums, mut expected, mut now) =
            (Regions::default(), Regions::default(), Vec::new());
        let cell = |u: Real| [(3, (u * 8.0) as u32)];
        proposals(
            world,
            Strategy::Wavelength,
            &mut x,
            &mut ws,
            300_000,
            |r, _, ws, _| {
                now.extend(r.iter().flat_map(|r| cell(ws.y.lanes.u).map(|c| (c, *r))));
                sums.add(&mut now);
            },
        );
        let n = 300_000;
        for i in 0..n {
            let lanes = Lanes::new((i as Real + 0.5) / n as Real);
            let mut f = Spectrum::ONE;
            for j in 0..x.k() {
                let v = ws.pool.get(x.links[j].slot).at_wavelengths(
                    &world.emitters,
                    world.scene,
                    &lanes,
                );
                f *= if j == 0 {
                    world.emitters.radiance(world.scene, &v, x.links[0].dir)
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
        Verdict::judge(all, "spectrum", 0.06);
    });
}
