//! The proof of the mutations (DESIGN §5): one suite for all strategies, on small rooms.
//!
//! A new strategy is one line in [`ratio`], and one false density in `falsify.rs` with its line in `flux.rs`.

mod aperture;
mod flux;
mod integral;
mod integral_caustic;
mod integral_chains;
mod integral_dispersion;
mod integral_lens;
mod integral_subpath;
mod scenes;
mod start_up;
mod stats;
mod steps;

use super::{
    Bidirectional, CausticPerturbation, Context, LensPerturbation, LensSubpath,
    MultiChainPerturbation, Strategy, Wavelength,
};
use crate::accel::Embree;
use crate::path::{Ends, Path, Pool};

/// What a strategy returns when it makes y from x, from the paths alone.
fn ratio<const N: usize>(
    s: Strategy,
    x: &Path<N>,
    y: &Path<N>,
    pool: &Pool<N>,
    ends: Ends,
    ctx: &Context<Embree>,
) -> f64 {
    match s {
        Strategy::Bidirectional => {
            Bidirectional::transition(y, x, ends, ctx) / Bidirectional::transition(x, y, ends, ctx)
        }
        Strategy::Lens => LensPerturbation::ratio(x, y, ends.light),
        Strategy::Caustic => {
            CausticPerturbation::ratio(ctx.world, x, y, pool, ends.light - 1).unwrap_or(0.0)
        }
        Strategy::MultiChain => MultiChainPerturbation::ratio(x, y, ends.light),
        Strategy::LensSubpath => LensSubpath::ratio(x, y, pool, ends.light),
        Strategy::Wavelength => {
            Wavelength::ratio(Wavelength::form(ctx.world.dispersive, x, pool), x, y)
        }
    }
}
