//! Wavelength mutation: redraws the hero wavelength uniformly in the sampling variable.
//!
//! Without a dispersive delta the geometry stays and no ray is traced: symmetric in the measure du, so the ratio is
//! τ(y)/τ(x) at the same vertices. A path with one is followed again at the new wavelength; see [`super::dispersion`].

use super::dispersion::{Form, retrace};
use super::falsify::{Density, factor};
use super::{Context, Workspace};
use crate::accel::Accel;
use crate::path::{Ends, Path, Pool, exp2i};
use crate::scatter::Transport;
use crate::scene::spectrum::Lanes;

/// See the module.
pub struct Wavelength;

impl Wavelength {
    /// What has to be retraced (`dispersive`: the scene has such materials at all).
    #[inline]
    pub(super) fn form<const N: usize>(dispersive: bool, x: &Path<N>, pool: &Pool<N>) -> Form {
        if dispersive {
            Form::of(x, pool)
        } else {
            Form::Still
        }
    }

    /// All but paths that are dispersive on both sides of every connection.
    #[inline]
    pub fn suits<const N: usize>(dispersive: bool, x: &Path<N>, pool: &Pool<N>) -> bool {
        Self::form(dispersive, x, pool) != Form::Closed
    }

    /// Proposes y in `ws.y`; see [`super`].
    pub fn propose<const N: usize, A: Accel>(
        x: &mut Path<N>,
        ws: &mut Workspace<N>,
        ctx: &mut Context<A>,
    ) -> Option<f64> {
        let lanes = ctx.world.lanes(ctx.rng.next_f32());
        let form = Self::form(ctx.world.dispersive, x, &ws.pool);
        if form == Form::Still {
            same_places(lanes, x, ws, ctx)?;
        } else {
            retrace(form, lanes, x, ws, ctx)?;
        }
        Some(Self::ratio(form, x, &ws.y))
    }

    /// T(y→x)·τ(y) / (T(x→y)·τ(x)).
    #[inline]
    pub(super) fn ratio<const N: usize>(form: Form, x: &Path<N>, y: &Path<N>) -> f64 {
        let density = |p: &Path<N>| factor(Density::Wavelength, p.lanes.u < 0.5);
        let scale = exp2i(y.shape_exp - x.shape_exp);
        form.changed(y) / form.changed(x) * scale * density(x) / density(y)
    }
}

/// Makes y of x's vertices as they are at other wavelengths.
fn same_places<const N: usize, A: Accel>(
    lanes: Lanes<N>,
    x: &Path<N>,
    ws: &mut Workspace<N>,
    ctx: &mut Context<A>,
) -> Option<()> {
    let world = ctx.world;
    ws.ends = Ends { light: 0, eye: 0 };
    // The geometry of every link stays; what depends on the wavelength is computed again.
    ws.y.links.clone_from(&x.links);
    ws.y.lanes = lanes;
    ws.y.raster = x.raster;
    for i in 0..x.links.len() {
        let l = &x.links[i];
        let v = ws.pool.get(l.slot);
        let v = v.at_wavelengths(&world.emitters, world.scene, &lanes);
        ws.y.links[i].slot = ws.put(Transport::FromLight, v, l.mode);
    }
    let k = ws.y.k();
    ws.y.relink_parts(world, &ws.pool, 0..0, 0..k + 1);
    ctx.carries(&mut ws.y, &ws.pool).then_some(())
}
