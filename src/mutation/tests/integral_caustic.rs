//! The integral over what the caustic perturbation reaches: the directions around x_m's (entry points under light from
//! infinity), against sums over them formed as a tracer of light would, without links and densities. Specular vertices
//! pass on their share of the flux, which knows nothing of squared indices.

use super::integral::{Regions, compared, find, proposals};
use super::scenes::{BOX, Contents, OPEN, PLATE, POOL, Room, image_cell, with_room};
use super::stats::Verdict;
use crate::mutation::turn::turned;
use crate::mutation::{CausticPerturbation, Strategy, Workspace};
use crate::path::{Kind, Palette, Path, Pool, Start, Tally, deflect, scatter_terms, trace_ray};
use crate::real::{Real, Vec2, Vec3};
use crate::sampling::Rng;
use crate::scatter::{Frame, Mode, Transport};
use crate::scene::spectrum::Spectrum;
use std::f64::consts::PI;

/// What a ray from x_m brings to the lens.
pub(super) struct Seen {
    pub(super) tau: f64,
    raster: Vec2,
    /// Smallest and largest change from which the strategy would come back.
    back: [f64; 2],
}

/// Follows the ray through the specular chain of x to the lens.
pub(super) fn to_lens<const N: usize>(
    world: &Room,
    x: &Path<N>,
    pool: &Pool<N>,
    m: usize,
    (mut o, mut w): (Start, Vec3),
    tally: &mut Tally,
) -> Option<Seen> {
    let k = x.k();
    let palette = Palette::new(x.lanes);
    let start = pool.get(x.links[m].slot);
    let mut f = if m == 0 {
        world.emitters.radiance(world.scene, start, w)
    } else {
        scatter_terms(start, Mode::NonSpecular, -x.links[m - 1].dir, w).fs
    };
    f = f * start.cos(w) as Real;
    for j in 0..m {
        f *= x.links[j].fs;
    }
    let (mut from, mut way) = (start.p, 0.0f64);
    for i in m + 1..k {
        let next = trace_ray(world, o, w, &palette, tally)?;
        if next.kind != Kind::Surface {
            return None;
        }
        way += from.distance(next.p) as f64;
        from = next.p;
        let back = -w;
        if i + 1 < k {
            let mode = x.links[i].mode;
            w = deflect(&next, back, mode, Transport::FromLight)?;
            o = world.leave(&next, next.p, w);
            let (l, e) = (next.frame().to_local(back), next.frame().to_local(w));
            let s = next.bsdf.specular(l, e, mode)?;
            f *= match mode {
                Mode::Transmit => Spectrum::splat(s.prob_l),
                _ => s.value,
            };
            continue;
        }
        let lens = pool.get(x.links[k].slot);
        let (to, inv_d2) = next.towards(lens);
        let cos = lens.cos(to);
        f *= scatter_terms(&next, Mode::NonSpecular, back, to).fs;
        f = f * (next.cos(to) * cos * inv_d2 * world.lens.importance(cos)) as Real;
        let raster = world.lens.raster(lens.p, -to)?;
        if !world.lens.contains(raster) || !world.visible(&next, lens, tally) {
            return None;
        }
        // The angle under which a pixel is seen, carried over to the other end of the chain.
        let pixel = 1.0 / (world.lens.raster_per_solid_angle(cos) * inv_d2).sqrt();
        let unit = if start.kind == Kind::Infinite {
            pixel
        } else {
            pixel / way
        };
        let r2 = world.lens.perturbation as f64 * unit;
        let largest = if start.kind == Kind::Infinite {
            r2
        } else {
            r2.min(PI / 2.0)
        };
        return Some(Seen {
            tau: f.dot(x.lanes.target) as f64,
            raster,
            back: [0.1 * unit, largest],
        });
    }
    None
}

/// The caustic perturbation over the ring of directions or entry points that it reaches, from a path of form `wanted`:
/// (kind of x_m, m, specular vertices).
fn caustic<const N: usize>(
    contents: Contents,
    aperture: Real,
    wanted: (Kind, usize, usize),
    least: f64,
) {
    with_room(contents, aperture, 6, |world| {
        let mut ws = Workspace::<N>::new(world.max_edges);
        let mut x = find(world, &mut ws, |x, pool| {
            let middle = 0.5 * (world.lens.lo + world.lens.hi);
            let form = |m: usize| {
                let kind = pool.get(x.links[m].slot).kind;
                (kind, m, x.k() - 2 - m)
            };
            CausticPerturbation::suits(x).is_some_and(|m| form(m) == wanted)
                && (x.raster - middle).abs().max_element() < 8.0
        });
        let m = wanted.1;
        let at = *ws.pool.get(x.links[m].slot);
        let (axis, through) = (x.links[m].dir, ws.pool.get(x.links[m + 1].slot).p);
        let far = wanted.0 == Kind::Infinite;
        let ray = |size: f64, phi: f64| {
            if far {
                let side = Vec2::from_angle(phi as Real) * size as Real;
                let q = through + Frame::from_normal(at.p).to_world(side.extend(0.0));
                return (Start::at(world.emitters.entry(at.p, q)), -at.p);
            }
            let w = turned(axis, size, phi);
            (world.leave(&at, at.p, w), w)
        };
        let mut tally = Tally::default();
        let here = to_lens(world, &x, &ws.pool, m, ray(0.0, 0.0), &mut tally).expect("x itself");
        let (mut sums, mut expected) = (Regions::default(), Regions::default());
        let mut now = Vec::new();
        let cell = |r: Vec2| [(2, image_cell(world, r)), (0, 0)];
        let n = 500_000;
        proposals(
            world,
            Strategy::Caustic,
            &mut x,
            &mut ws,
            n,
            |r, x, ws, _| {
                if let Some(r) = r {
                    // The ratio holds the density of the way back, at y.
                    let sizes = CausticPerturbation::sizes(world, &ws.y, &ws.pool, m);
                    let size = CausticPerturbation::moved(x, &ws.y, &ws.pool, m);
                    let back = if far {
                        1.0 / (2.0 * PI * size * size * sizes.spread())
                    } else {
                        sizes.per_solid_angle(size)
                    };
                    now.extend(cell(ws.y.raster).map(|c| (c, r / back)));
                }
                sums.add(&mut now);
            },
        );
        let mut rng = Rng::new(0x9e, 103, 0, 0);
        let [lo, hi] = here.back;
        for i in 0..n {
            rng.set_step(i);
            let (u, phi) = (rng.next_f64(), 2.0 * PI * rng.next_f64());
            let (size, measure) = if far {
                let (inner, outer) = (lo * lo, hi * hi);
                let size = (inner + (outer - inner) * u).sqrt();
                (size, PI * (outer - inner))
            } else {
                let (inner, outer) = (lo.cos(), hi.cos());
                let size = (inner + (outer - inner) * u).acos();
                (size, 2.0 * PI * (inner - outer))
            };
            if let Some(y) = to_lens(world, &x, &ws.pool, m, ray(size, phi), &mut tally)
                && (y.back[0]..=y.back[1]).contains(&size)
            {
                let v = y.tau / here.tau * measure;
                now.extend(cell(y.raster).map(|c| (c, v)));
            }
            expected.add(&mut now);
        }
        let mut all = Vec::new();
        compared("ring", &sums, &expected, &mut all);
        Verdict::judge(all, "ring", least);
    });
}

#[test]
fn caustic_perturbations_integrate_directions_of_a_lamp_and_of_a_wall() {
    caustic::<4>(BOX, 0.0, (Kind::Surface, 0, 0), 0.03);
    caustic::<4>(BOX, 0.03, (Kind::Surface, 1, 0), 0.03);
}

#[test]
fn caustic_perturbations_integrate_what_comes_through_specular_chains() {
    caustic::<4>(PLATE, 0.0, (Kind::Surface, 0, 2), 0.05);
    caustic::<1>(PLATE, 0.02, (Kind::Surface, 1, 2), 0.05);
    caustic::<4>(POOL, 0.0, (Kind::Surface, 1, 1), 0.05);
}

/// A bulb, and the sun and the sky, whose light has one direction and many entry points.
#[test]
fn caustic_perturbations_integrate_light_of_a_point_and_from_infinity() {
    caustic::<4>(OPEN, 0.0, (Kind::Point, 0, 0), 0.05);
    caustic::<4>(OPEN, 0.0, (Kind::Infinite, 0, 0), 0.05);
    // Through the pane, of which the path found may see little.
    caustic::<4>(OPEN, 0.0, (Kind::Infinite, 0, 1), 0.25);
}
