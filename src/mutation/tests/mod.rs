//! The proof of the mutations (DESIGN §5): one suite for all strategies, on four small rooms.
//!
//! A new strategy is one line in [`propose`] and [`ratio`], one in [`STRATEGIES`], and one false density in
//! `falsify.rs` with its line in `flux.rs`.

mod aperture;
mod flux;
mod integral;
mod integral_lens;
mod scenes;
mod start_up;
mod stats;
mod steps;

use super::{Bidirectional, Context, LensPerturbation, Strategy, Wavelength, Workspace};
use crate::accel::Embree;
use crate::path::{Ends, Path, Pool};

/// The strategies under test.
const STRATEGIES: [Strategy; 3] = Strategy::ALL;

fn suits<const N: usize>(s: Strategy, x: &mut Path<N>, pool: &Pool<N>) -> bool {
    match s {
        Strategy::Bidirectional => true,
        Strategy::Lens => LensPerturbation::suits(x, pool).is_some(),
        Strategy::Wavelength => Wavelength::suits(false, x, pool),
    }
}

fn propose<const N: usize>(
    s: Strategy,
    x: &mut Path<N>,
    ws: &mut Workspace<N>,
    ctx: &mut Context<Embree>,
) -> Option<f64> {
    match s {
        Strategy::Bidirectional => Bidirectional::propose(x, ws, ctx),
        Strategy::Lens => LensPerturbation::propose(x, ws, ctx),
        Strategy::Wavelength => Wavelength::propose(x, ws, ctx),
    }
}

/// What [`propose`] returns when it makes y from x, from the paths alone.
fn ratio<const N: usize>(
    s: Strategy,
    x: &Path<N>,
    y: &Path<N>,
    ends: Ends,
    ctx: &Context<Embree>,
) -> f64 {
    match s {
        Strategy::Bidirectional => {
            Bidirectional::transition(y, x, ends, ctx) / Bidirectional::transition(x, y, ends, ctx)
        }
        Strategy::Lens => LensPerturbation::ratio(x, y, ends.light),
        Strategy::Wavelength => Wavelength::ratio(x, y),
    }
}
