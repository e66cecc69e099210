//! Wavelength mutation: redraws the hero wavelength uniformly in the sampling variable and keeps the geometry.
//!
//! Symmetric in the measure du, so the ratio is τ(y)/τ(x) at the same vertices. No rays. A path with a dispersive delta
//! would not pass the same points at another wavelength; it is not suited.

use super::falsify::{Density, factor};
use super::{Context, Workspace};
use crate::accel::Accel;
use crate::path::{Ends, Path, Pool, exp2i};
use crate::scatter::{Mode, Transport};

/// See the module.
pub struct Wavelength;

impl Wavelength {
    /// No dispersive delta on the path (`dispersive`: the scene has such materials at all).
    #[inline]
    pub fn suits<const N: usize>(dispersive: bool, x: &Path<N>, pool: &Pool<N>) -> bool {
        !dispersive
            || !x
                .links
                .iter()
                .any(|l| l.mode != Mode::NonSpecular && pool.get(l.slot).bsdf.is_dispersive())
    }

    /// Proposes y in `ws.y`; see [`super`].
    pub fn propose<const N: usize, A: Accel>(
        x: &mut Path<N>,
        ws: &mut Workspace<N>,
        ctx: &mut Context<A>,
    ) -> Option<f64> {
        let lanes = ctx.world.lanes(ctx.rng.next_f32());
        ws.ends = Ends { light: 0, eye: 0 };
        // The geometry of every link stays; what depends on the wavelength is computed again.
        ws.y.links.clone_from(&x.links);
        ws.y.lanes = lanes;
        ws.y.raster = x.raster;
        for i in 0..x.links.len() {
            let l = &x.links[i];
            let v =
                ws.pool
                    .get(l.slot)
                    .at_wavelengths(&ctx.world.emitters, ctx.world.scene, &lanes);
            ws.y.links[i].slot = ws.put(Transport::FromLight, v, l.mode);
        }
        let y = &mut ws.y;
        let k = y.k();
        y.relink_parts(ctx.world, &ws.pool, 0..0, 0..k + 1);
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
