//! Multi-chain perturbation: a lens perturbation of the first specular chain, then a small turn at each diffuse vertex
//! that joins it to the next (Veach 11.4.3.3).
//!
//! Suited to (L|D)DS⁺(DS⁺)*DS*E, where the last chain's end is joined to what is kept, and to LS⁺(DS⁺)*DS*E, where the
//! retraced chain must end on an emitter or escape to an infinite light. Veach asks for S⁺ at the lens too; without it the
//! strategy also moves caustics seen directly, whose steps from the light are small where a lens focuses and the view is
//! narrow. A turn is by θ = θ2·exp(−ln(θ2/θ1)·U) of the old path's direction, with constant θ1, θ2: symmetric in solid
//! angle. The raster point moves as under the lens perturbation, symmetric too. What is left is
//!
//! τ(y) · G of the connection · Π G/(p^E/P(mode)) after lens and specular vertices · Π |cos θ| at turned vertices
//!
//! over the same of x.

use super::falsify::{Density, factor, odd_row};
use super::lens::retrace;
use super::turn::{Octaves, turned};
use super::{Context, Workspace};
use crate::accel::Accel;
use crate::path::{Emitters, Path, Pool, exp2i};
use crate::scatter::Mode;
use std::f64::consts::PI;

/// θ1 … θ2 of the turns, radians.
pub(super) const TURN: Octaves = Octaves::new(0.0001, 0.1);

/// See the module.
pub struct MultiChainPerturbation;

impl MultiChainPerturbation {
    /// Index of the first vertex that is replaced, if x has the form this strategy suits.
    #[inline]
    pub fn suits<const N: usize>(x: &Path<N>, pool: &Pool<N>) -> Option<usize> {
        let mut chains = 0;
        // Vertices from `end` on are seen to be chains with their ends.
        let mut end = x.k();
        while end > 0 {
            let mut j = end - 1;
            while j > 0 && x.links[j].mode != Mode::NonSpecular {
                j -= 1;
            }
            // Only the chain at the lens may be empty.
            if j + 1 == end && end < x.k() {
                break;
            }
            chains += 1;
            end = j;
        }
        let joins = end > 0 || Emitters::can_be_hit(pool.get(x.links[0].slot));
        (chains >= 2 && joins).then_some(end)
    }

    /// Proposes y in `ws.y`; see [`super`].
    pub fn propose<const N: usize, A: Accel>(
        x: &mut Path<N>,
        ws: &mut Workspace<N>,
        ctx: &mut Context<A>,
    ) -> Option<f64> {
        let first = Self::suits(x, &ws.pool)?;
        retrace(x, ws, ctx, first, |rng, w| {
            let theta = TURN.sample(rng.next_f64());
            turned(w, theta, 2.0 * PI * rng.next_f64())
        })?;
        Some(Self::ratio(x, &ws.y, first))
    }

    /// T(y→x)·τ(y) / (T(x→y)·τ(x)) of paths that differ from vertex `first` on.
    #[inline]
    pub(crate) fn ratio<const N: usize>(x: &Path<N>, y: &Path<N>, first: usize) -> f64 {
        let density = |p: &Path<N>| factor(Density::MultiChain, odd_row(p));
        let scale = exp2i(y.shape_exp - x.shape_exp);
        changed(y, first) / changed(x, first) * scale * (density(x) / density(y))
    }
}

/// τ of all spectra times what else of f/T belongs to the vertices from `first` on; the density of the turns is left out.
pub(super) fn changed<const N: usize>(p: &Path<N>, first: usize) -> f64 {
    let k = p.k();
    let l = &p.links;
    let mut c = p.shape_tau;
    if first > 0 {
        c *= l[first - 1].g;
    }
    for j in first..k {
        c *= if j + 1 == k {
            l[j].g / l[j].pe
        } else if l[j + 1].mode == Mode::NonSpecular {
            l[j].cos_far.abs() as f64
        } else {
            l[j].g * l[j + 1].prob_e as f64 / l[j].pe
        };
    }
    c
}
