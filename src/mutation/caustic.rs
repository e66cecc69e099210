//! Caustic perturbation: turns a direction on the light side a little and follows the specular chain again, towards
//! the lens (Veach 11.4.3.2).
//!
//! Suited to (L|D)S*DE with x_m the (L|D): x_{m+1} … x_{k−1} are replaced, and x_{k−1} is joined to the lens. The first
//! direction turns by θ = θ2·exp(−ln(θ2/θ1)·U) at a uniform angle φ: the density is 1/(2π·θ·sin θ·ln(θ2/θ1)) per solid
//! angle. With θ(r) the lens-ray angle of r pixels,
//!
//! θ_i(x) = θ(r_i) · |x_k − x_{k−1}| / Σ_{j=m+1..k−1} |x_j − x_{j−1}|, θ2 ≤ π/2,
//!
//! so that the image moves by pixels whatever the camera looks at. This depends on the path: the way there has θ_i(x),
//! the way back θ_i(y), and there is no way back if θ lies outside of θ1(y) … θ2(y).
//!
//! x_m may be a light, whose radiance is then its f_s. Light from infinity has a fixed direction; its entry point x1
//! moves in the plane across instead, by s = s2·exp(−ln(s2/s1)·U), s_i = θ(r_i)·|x_k − x_{k−1}|, which has the density
//! 1/(2π·s²·ln(s2/s1)) per area of that plane.

use super::falsify::{Density, factor, odd_row};
use super::turn::{Octaves, angle, turned};
use super::{Context, Workspace};
use crate::accel::Accel;
use crate::path::{Ends, Kind, Path, Pool, Start, World, deflect, exp2i};
use crate::real::{Convert, Real, Vec3};
use crate::scatter::{Frame, Mode, Transport};
use std::f64::consts::PI;

/// See the module.
pub struct CausticPerturbation;

impl CausticPerturbation {
    /// Index m of the vertex whose direction turns, if x has the form this strategy suits.
    #[inline]
    pub fn suits<const N: usize>(x: &Path<N>) -> Option<usize> {
        let k = x.k();
        if k < 2 || x.links[k - 1].mode != Mode::NonSpecular {
            return None;
        }
        let mut m = k - 2;
        while m > 0 && x.links[m].mode != Mode::NonSpecular {
            m -= 1;
        }
        Some(m)
    }

    /// Proposes y in `ws.y`; see [`super`].
    pub fn propose<const N: usize, A: Accel>(
        x: &mut Path<N>,
        ws: &mut Workspace<N>,
        ctx: &mut Context<A>,
    ) -> Option<f64> {
        let world = ctx.world;
        let m = Self::suits(x)?;
        let k = x.k();
        let size = Self::sizes(world, x, &ws.pool, m).sample(ctx.rng.next_f64());
        let phi = 2.0 * PI * ctx.rng.next_f64();
        ws.ends = Ends {
            light: m + 1,
            eye: 1,
        };
        let start = ws.pool.get(x.links[m].slot);
        let (mut o, mut w) = if start.kind == Kind::Infinite {
            let (sin, cos) = (phi as Real).sin_cos();
            let across = Vec3::new(cos, sin, 0.0) * size as Real;
            let through =
                ws.pool.get(x.links[1].slot).p + Frame::from_normal(start.p).to_world(across);
            (Start::at(world.emitters.entry(start.p, through)), -start.p)
        } else {
            let w = turned(x.links[m].dir, size, phi);
            (world.leave_on_line(start, w), w)
        };
        for i in m + 1..k {
            let mode = x.links[i].mode;
            let slot = ws.trace(world, Transport::FromLight, (o, w), mode, ctx.tally)?;
            let next = ws.pool.get(slot);
            if next.kind != Kind::Surface {
                return None;
            }
            if i + 1 < k {
                w = deflect(next, -w, mode, Transport::FromLight)?;
                o = world.leave_on_line(next, w);
            } else if !next.bsdf.has_non_specular() {
                return None;
            }
        }
        ws.splice(x);
        let y = &mut ws.y;
        y.relink(world, &ws.pool, m, k);
        if !ctx.carries(y, &ws.pool) || !y.edge_visible(world, &ws.pool, k - 1, ctx.tally) {
            return None;
        }
        Self::ratio(world, x, y, &ws.pool, m)
    }

    /// T(y→x)·τ(y) / (T(x→y)·τ(x)) of paths that differ between vertex `m` and the lens; `None` if one of the two does
    /// not reach the other.
    #[inline]
    pub(crate) fn ratio<const N: usize, A: Accel>(
        world: &World<A>,
        x: &Path<N>,
        y: &Path<N>,
        pool: &Pool<N>,
        m: usize,
    ) -> Option<f64> {
        let (there, back) = (
            Self::sizes(world, x, pool, m),
            Self::sizes(world, y, pool, m),
        );
        let size = Self::moved(x, y, pool, m);
        // Both are asked, so that what rounding puts beyond the border is refused either way.
        if !there.contains(size) || !back.contains(size) {
            return None;
        }
        let density = |p: &Path<N>| factor(Density::Caustic, odd_row(p));
        let scale = exp2i(y.shape_exp - x.shape_exp);
        Some(
            changed(y, m, x.k() - 1) / changed(x, m, x.k() - 1)
                * scale
                * (there.spread() / back.spread())
                * (density(x) / density(y)),
        )
    }

    /// θ1(x) … θ2(x); s1 … s2 for light from infinity.
    #[inline]
    pub(super) fn sizes<const N: usize, A: Accel>(
        world: &World<A>,
        x: &Path<N>,
        pool: &Pool<N>,
        m: usize,
    ) -> Octaves {
        let k = x.k();
        let length = |i: usize| x.links[i].inv_d2.sqrt().recip();
        let cos = x.links[k - 1].cos_far.abs() as f64;
        let r2 = world.lens.perturbation as f64;
        let r1 = r2 * (-world.lens.perturbation_range as f64).exp();
        // What one pixel covers of the surface seen, across the ray.
        let pixel = length(k - 1) / world.lens.raster_per_solid_angle(cos).sqrt();
        if pool.get(x.links[m].slot).kind == Kind::Infinite {
            return Octaves::new(r1 * pixel, r2 * pixel);
        }
        let angle = pixel / (m..k - 1).map(length).sum::<f64>();
        Octaves::new(r1 * angle, (r2 * angle).min(0.5 * PI))
    }

    /// By how much the first direction was turned, or its entry point moved.
    #[inline]
    pub(super) fn moved<const N: usize>(x: &Path<N>, y: &Path<N>, pool: &Pool<N>, m: usize) -> f64 {
        let start = pool.get(x.links[m].slot);
        if start.kind != Kind::Infinite {
            return angle(x.links[m].dir, y.links[m].dir);
        }
        let d = (pool.get(y.links[1].slot).p - pool.get(x.links[1].slot).p).double();
        d.cross(start.p.double()).length()
    }
}

/// τ of all spectra times what else of f/T belongs to the vertices after `m` up to `last`, which is joined to the next.
/// Non-specular ones between them are left in given directions.
pub(super) fn changed<const N: usize>(p: &Path<N>, m: usize, last: usize) -> f64 {
    let l = &p.links;
    let mut c = p.shape_tau * l[m].cos_near.abs() as f64 * l[last].g;
    for j in m + 1..last {
        c *= if l[j].mode == Mode::NonSpecular {
            l[j].cos_near.abs() as f64
        } else {
            l[j].g * l[j].prob_l as f64 / l[j + 1].pl
        };
    }
    c
}
