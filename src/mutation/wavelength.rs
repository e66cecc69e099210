//! Wavelength mutation: redraws the hero wavelength uniformly in the sampling variable and keeps the geometry.
//!
//! Symmetric in the measure du, so the ratio is τ(y)/τ(x) at the same vertices. No rays. A path with a dispersive delta
//! would not pass the same points at another wavelength; it is not suited.

use super::falsify::{Density, factor};
use super::{Context, Workspace};
use crate::accel::Accel;
use crate::path::{Ends, Path, Pool, exp2i};
use crate::scatter::Mode;

/// See the module.
pub struct Wavelength;

impl Wavelength {
    /// No dispersive delta on the path (`dispersive`: the scene has such materials at all).
    #[inline]
    pub fn suits<const N: usize>(dispersive: bool, x: &Path<N>, pool: &Pool<N>) -> bool {
        !dispersive
            || !x
                .slots
                .iter()
                .zip(&x.links)
                .any(|(&s, l)| l.mode != Mode::NonSpecular && pool.get(s).bsdf.is_dispersive())
    }

    /// Proposes y in `ws.y`; see [`super`].
    pub fn propose<const N: usize, A: Accel>(
        x: &mut Path<N>,
        ws: &mut Workspace<N>,
        ctx: &mut Context<A>,
    ) -> Option<f64> {
        let lanes = ctx.world.lanes(ctx.rng.next_f32());
        ws.ends = Ends { light: 0, eye: 0 };
        for (&slot, link) in x.slots.iter().zip(&x.links) {
            let v = ws.pool.get(slot).at_wavelengths(ctx.world.scene, &lanes);
            let new = ws.put(v);
            ws.inner.push((new, link.mode));
        }
        let inner = std::mem::take(&mut ws.inner);
        ws.y.splice(x, ws.ends, &inner);
        ws.inner = inner;
        let y = &mut ws.y;
        y.lanes = lanes;
        let k = y.k();
        y.relink(ctx.world, &ws.pool, 0, k);
        if !ctx.carries(y, &ws.pool) {
            return None;
        }
        Some(Self::ratio(x, y))
    }

    /// T(y→x)·τ(y) / (T(x→y)·τ(x)).
    #[inline]
    pub(crate) fn ratio<const N: usize>(x: &Path<N>, y: &Path<N>) -> f64 {
        let density = |p: &Path<N>| factor(Density::Wavelength, p.lanes.u < 0.5);
        y.shape_tau / x.shape_tau * exp2i(y.shape_exp - x.shape_exp) * density(x) / density(y)
    }
}
