//! Bidirectional mutation: deletes x_l … x_m and joins the ends by a new sub-path (Veach 11.4.2).
//!
//! With a = l+1 kept light vertices, c = k+1−m kept eye vertices, k_d = m−l and k_a = l'+m'+1:
//!
//! T(x→y) = p_d[l,m] · Σ_{i=1..k_a} p_a[i−1, k_a−i] · p_{l+i}(y) / K,
//!
//! K the densities of what is kept, the same for the way back. With C*_i = total/ρ_i this is the source's
//! Q(x→y) = p_d[l,m] Σ p_a/C_i^bd, and the ratio returned is Q(y→x)/Q(x→y).

use super::falsify::{Density, factor, odd_row};
use super::grow::{grow_eye, grow_light};
use super::{Context, Workspace};
use crate::accel::Accel;
use crate::path::{Emitters, Ends, Path, deletion_length, half_to};

/// See the module.
pub struct Bidirectional;

/// The choice of k_a and l' given what is kept.
#[derive(Clone, Copy, Debug)]
struct Insertion {
    /// Smallest and largest feasible k_a.
    lo: usize,
    hi: usize,
    /// Smallest feasible l'.
    least_light: usize,
    /// Smallest feasible m'.
    least_eye: usize,
}

impl Insertion {
    #[inline]
    fn of<A: Accel>(ends: Ends, ctx: &Context<A>) -> Self {
        let min_edges = if ctx.indirect_only { 3 } else { 1 };
        Self::new(
            ends,
            ctx.world.emitters.hittable,
            ctx.world.lens.has_aperture(),
            min_edges,
            ctx.world.max_edges,
        )
    }

    fn new(ends: Ends, hittable: bool, aperture: bool, min_edges: usize, max_edges: usize) -> Self {
        let least_light = (ends.light == 0 && !hittable) as usize;
        // Without a kept lens vertex a new one is made: from the eye, or from the light if the lens has an area.
        let new_lens = (ends.eye == 0) as usize;
        let least_eye = if aperture { 0 } else { new_lens };
        // k' + 1 = a + c + k_a − 1
        let kept = ends.light + ends.eye;
        let lo = (min_edges + 2)
            .saturating_sub(kept)
            .max(1 + least_light + new_lens);
        Self {
            lo,
            hi: (max_edges + 2).saturating_sub(kept),
            least_light,
            least_eye,
        }
    }

    /// p_a1 before normalisation: 0.5 for the same length, 0.15 each one off, 0.2·2^−j each j off.
    fn weight(from: usize, to: usize) -> f64 {
        match from.abs_diff(to) {
            0 => 0.5,
            1 => 0.15,
            j => 0.2 * half_to(j),
        }
    }

    /// Σ of the weights at distance 1 … j on one side.
    fn side(j: usize) -> f64 {
        if j == 0 { 0.0 } else { 0.25 - 0.2 * half_to(j) }
    }

    fn norm(&self, kd: usize) -> f64 {
        0.5 + Self::side(self.hi - kd) + Self::side(kd - self.lo)
    }

    fn contains(&self, ka: usize) -> bool {
        self.lo <= ka && ka <= self.hi
    }

    /// p_a1[k_a] given k_d, normalised over what is feasible.
    fn length_probability(&self, kd: usize, ka: usize) -> f64 {
        Self::weight(kd, ka) / self.norm(kd)
    }

    fn sample_length(&self, kd: usize, u: f64) -> usize {
        let mut r = u * self.norm(kd) - 0.5;
        if r < 0.0 {
            return kd;
        }
        for j in 1..=(self.hi - kd).max(kd - self.lo) {
            let w = Self::weight(kd, kd + j);
            for (ok, to) in [
                (kd + j <= self.hi, kd + j),
                (kd >= self.lo + j, kd.wrapping_sub(j)),
            ] {
                if ok {
                    r -= w;
                    if r < 0.0 {
                        return to;
                    }
                }
            }
        }
        kd
    }

    /// Number of feasible l' for k_a.
    fn splits(&self, ka: usize) -> usize {
        ka - self.least_light - self.least_eye
    }

    /// Σ_i p_a2 · ρ_{l+i} of a path that has k_a edges between the ends.
    fn strategy_sum<const N: usize>(&self, path: &Path<N>, a: usize, ka: usize) -> f64 {
        let from = a + self.least_light;
        let n = self.splits(ka);
        path.rho[from..from + n].iter().sum::<f64>() / n as f64
    }
}

/// p_d[l,m] of a path whose strategies are known.
fn deletion_probability<const N: usize>(x: &Path<N>, ends: Ends, weigh: bool) -> f64 {
    let n = x.links.len() + 1;
    let d = n - ends.light - ends.eye;
    if weigh {
        deletion_length(d) * (x.sum[ends.light + d] - x.sum[ends.light]) / x.deletion_sum
    } else {
        let all: f64 = (1..=n)
            .map(|d| deletion_length(d) * (n - d + 1) as f64)
            .sum();
        deletion_length(d) / all
    }
}

/// Chooses the sub-path to delete.
fn sample_deletion<const N: usize>(x: &Path<N>, u: f64, weigh: bool) -> Option<Ends> {
    let n = x.links.len() + 1;
    let weight = |a: usize, d: usize| if weigh { x.sum[a + d] - x.sum[a] } else { 1.0 };
    let of_length = |d: usize| {
        if weigh {
            x.deletion[d]
        } else {
            deletion_length(d) * (n - d + 1) as f64
        }
    };
    let total: f64 = if weigh {
        x.deletion_sum
    } else {
        (1..=n).map(of_length).sum()
    };
    let mut r = u * total;
    for d in 1..=n {
        let w = of_length(d);
        if r >= w {
            r -= w;
            continue;
        }
        r /= deletion_length(d);
        for a in 0..=n - d {
            let w = weight(a, d);
            if r < w {
                return Some(Ends {
                    light: a,
                    eye: n - d - a,
                });
            }
            r -= w;
        }
        // The last rounding of the sums.
        return None;
    }
    None
}

impl Bidirectional {
    /// Proposes y in `ws.y`; see [`super`].
    pub fn propose<const N: usize, A: Accel>(
        x: &mut Path<N>,
        ws: &mut Workspace<N>,
        ctx: &mut Context<A>,
    ) -> Option<f64> {
        if !x.strategies() {
            return None;
        }
        let ends = sample_deletion(x, ctx.rng.next_f64(), ctx.weigh_deletions)?;
        let (a, n) = (ends.light, x.links.len() + 1);
        let kd = n - a - ends.eye;
        let ins = Insertion::of(ends, ctx);
        if !ins.contains(kd) {
            return None;
        }
        let ka = ins.sample_length(kd, ctx.rng.next_f64());
        let light_new = ins.least_light + (ctx.rng.next_f64() * ins.splits(ka) as f64) as usize;
        let light_new = light_new.min(ka - 1 - ins.least_eye);
        let eye_new = ka - 1 - light_new;
        ws.ends = ends;
        ws.y.lanes = x.lanes;
        let mode_l = grow_light(x, ws, ctx, a, light_new, ends.eye + eye_new == 0)?;
        let mode_e = grow_eye(x, ws, ctx, ends.eye, eye_new, a + light_new == 0)?;
        ws.splice(x);
        let y = &mut ws.y;
        let last = y.links.len() - 1;
        if a >= 1 {
            y.links[a - 1].mode = mode_l;
        }
        let m = a + ka - 1;
        if m <= last {
            y.links[m].mode = mode_e;
        }
        if a + light_new == 0 && !Emitters::can_be_hit(ws.pool.get(y.links[0].slot)) {
            return None;
        }
        y.relink(ctx.world, &ws.pool, a.saturating_sub(1), m.min(last));
        if !ctx.carries(y, &ws.pool) {
            return None;
        }
        let s = a + light_new;
        if s > 0 && s <= last && !y.edge_visible(ctx.world, &ws.pool, s - 1, ctx.tally) {
            return None;
        }
        if !y.strategies() || y.rho[s] <= 0.0 {
            ctx.tally.fault(crate::path::Fault::ZeroDensity);
            return None;
        }
        Some(Self::transition(y, x, ends, ctx) / Self::transition(x, y, ends, ctx))
    }

    /// T(x→y)/τ(y), up to the densities of what is kept. Both paths' strategies must be known.
    #[inline]
    pub(crate) fn transition<const N: usize, A: Accel>(
        x: &Path<N>,
        y: &Path<N>,
        ends: Ends,
        ctx: &Context<A>,
    ) -> f64 {
        let edges = |p: &Path<N>| p.links.len() + 1 - ends.light - ends.eye;
        let (kd, ka) = (edges(x), edges(y));
        let ins = Insertion::of(ends, ctx);
        deletion_probability(x, ends, ctx.weigh_deletions)
            * factor(Density::Deletion, x.k() % 2 == 1)
            * ins.length_probability(kd, ka)
            * factor(Density::Insertion, ka > kd)
            * ins.strategy_sum(y, ends.light, ka)
            * factor(Density::Strategies, odd_row(y))
            / y.total
    }
}
