//! `Lanes<N>`: which wavelengths a path carries, and what each of them weighs.

use super::{LAMBDA_MAX, LAMBDA_MIN, Spectrum, observer};
use crate::real::Real;
use std::sync::LazyLock;

/// Part m of x̄ + ȳ + z̄ in the chain's target τ = (1 − m)·Y + m·(X + Y + Z) = Y + m·(X + Z).
///
/// A splat carries XYZ/τ, so a lane's largest splat is `max(x̄, ȳ, z̄) / (ȳ + m·(x̄ + z̄))`, below 1/m whatever the
/// wavelength. With luminance alone (m = 0) it reaches 187 near 400 nm: such paths are visited rarely and shown
/// brightly. m = 1/4 bounds it by 3.25 (at 396 nm; 2.8 is reached in the red too) while white light still puts two thirds of the
/// target on luminance (X ≈ Y ≈ Z there, so τ ≈ 1.5·Y). A larger m gains little: at m = 1 the bound is 1 and luminance
/// is left a third.
pub const TARGET_MIX: Real = 0.25;

/// Floor under the target of [`Target::Bins`], per nm, in units of the colour-matching functions: a thirtieth of the
/// mean of ȳ over 360–830 nm (106.86 / 470 ≈ 0.227), so that bins the eye does not see are visited too.
pub const BIN_FLOOR: Real = 0.0075;

/// What the chain's target τ is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Target {
    /// Y + m·(X + Z) with m = [`TARGET_MIX`].
    #[default]
    Mixed,
    /// Luminance Y alone, as in Veach's text.
    Luminance,
    /// As `Mixed`, with [`BIN_FLOOR`] under every wavelength, for spectral output.
    Bins,
}

/// The wavelengths a path carries. Lane 0 is the hero wavelength λh = Λ(u); lane i is Λ(frac(u + i/N)), where Λ is the
/// inverse CDF of a fixed density shaped like the eye's response over 360–830 nm (PBRT 4.5.4).
/// The measure of the wavelength dimension is du on [0, 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lanes<const N: usize> {
    /// The hero's sampling variable in [0, 1).
    pub u: Real,
    /// Wavelengths in nm.
    pub lambda: [Real; N],
    /// X, Y, Z of a unit of f in each lane: x̄(λᵢ) / (N·p(λᵢ)) and so on, so that XYZ = Σᵢ fᵢ·weightᵢ.
    pub xyz: [Spectrum<N>; 3],
    /// Weights of the chain's target: τ(f) = Σᵢ fᵢ·targetᵢ.
    pub target: Spectrum<N>,
}

impl<const N: usize> Lanes<N> {
    /// The lanes of hero variable `u` in [0, 1), with the target of [`Target::Mixed`].
    pub fn new(u: Real) -> Self {
        Self::with(u, Target::Mixed)
    }

    /// As [`Self::new`], or with luminance alone as the target.
    pub fn with_target(u: Real, luminance_only: bool) -> Self {
        Self::with(
            u,
            if luminance_only {
                Target::Luminance
            } else {
                Target::Mixed
            },
        )
    }

    /// The lanes of hero variable `u` in [0, 1) with the given target.
    pub fn with(u: Real, target: Target) -> Self {
        let mut s = Self {
            u,
            lambda: [0.0; N],
            xyz: [Spectrum::ZERO; 3],
            target: Spectrum::ZERO,
        };
        for i in 0..N {
            let (lambda, pdf) = visible(Self::lane_u(u, i));
            let nm = 1.0 / (N as Real * pdf);
            let cmf = observer::cmf(lambda);
            s.lambda[i] = lambda;
            for (c, v) in cmf.iter().enumerate() {
                s.xyz[c].0[i] = v * nm;
            }
            s.target.0[i] = nm
                * match target {
                    Target::Luminance => cmf[1],
                    Target::Mixed => cmf[1] + TARGET_MIX * (cmf[0] + cmf[2]),
                    Target::Bins => cmf[1] + TARGET_MIX * (cmf[0] + cmf[2]) + BIN_FLOOR,
                };
        }
        s
    }

    /// X, Y, Z of the spectral values `f`.
    #[inline]
    pub fn to_xyz(&self, f: Spectrum<N>) -> [Real; 3] {
        [f.dot(self.xyz[0]), f.dot(self.xyz[1]), f.dot(self.xyz[2])]
    }

    /// Nanometres each lane stands for, 1 / (N·p(λᵢ)): ∫ f dλ is estimated by Σᵢ fᵢ·nmᵢ.
    pub fn nm(&self) -> Spectrum<N> {
        Spectrum::from_fn(|i| 1.0 / (N as Real * visible(Self::lane_u(self.u, i)).1))
    }

    /// Lanes of a path on which only the hero counts: its weights hold N times as much, the others 0.
    pub fn hero_only(&self) -> Self {
        let only =
            |s: Spectrum<N>| Spectrum::from_fn(|i| if i == 0 { s.0[0] * N as Real } else { 0.0 });
        Self {
            xyz: self.xyz.map(only),
            target: only(self.target),
            ..*self
        }
    }

    fn lane_u(u: Real, i: usize) -> Real {
        let v = u + i as Real / N as Real;
        if v >= 1.0 { v - 1.0 } else { v }
    }
}

/// Slope and centre of the density p(λ) ∝ sech²(B·(λ − C)), PBRT 4.5.4.
const B: f64 = 0.0072;
const C: f64 = 538.0;

/// tanh(B·(λ − C)) at both ends of the range: the CDF is linear in that tanh.
static ENDS: LazyLock<[Real; 2]> =
    LazyLock::new(|| [LAMBDA_MIN, LAMBDA_MAX].map(|l| ((l as f64 - C) * B).tanh() as Real));

/// Wavelength in nm at CDF value `u`, and its density per nm.
pub fn visible(u: Real) -> (Real, Real) {
    let [a, b] = *ENDS;
    let t = a + u * (b - a);
    let lambda = C as Real + (0.5 / B as Real) * ((1.0 + t) / (1.0 - t)).ln();
    (
        lambda.clamp(LAMBDA_MIN, LAMBDA_MAX),
        B as Real * (1.0 - t * t) / (b - a),
    )
}

/// CDF value of a wavelength in nm: the inverse of [`visible`].
pub fn visible_cdf(lambda: Real) -> Real {
    let [a, b] = *ENDS;
    (((((lambda as f64) - C) * B).tanh() as Real - a) / (b - a)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::spectrum::{d65, xyz_of};

    #[test]
    fn density_integrates_to_one_and_inverts() {
        let n = 4700;
        let step = 470.0 / n as f64;
        let sum: f64 = (0..n)
            .map(|i| 360.0 + (i as f64 + 0.5) * step)
            .map(|l| visible(visible_cdf(l as Real)).1 as f64 * step)
            .sum();
        // Midpoint rule of a smooth bell: the f32 rounding of each term dominates.
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        for l in [360.0 as Real, 400.0, 538.0, 700.0, 829.0] {
            // du/dλ is smallest at the red end (2e-4): one ulp of u near 1 is 6e-8/2e-4 nm there.
            assert!((visible(visible_cdf(l)).0 - l).abs() < 2e-3, "{l}");
        }
    }

    #[test]
    fn lanes_average_to_the_xyz_of_a_table() {
        let table = crate::scene::spectrum::Curve::Table {
            scale: 1.0,
            table: d65(),
        };
        let exact = xyz_of(&table);
        let m = 20_000;
        let mut sum = [0.0f64; 3];
        for j in 0..m {
            let lanes = Lanes::<4>::new((j as Real + 0.5) / m as Real);
            let v = lanes.to_xyz(table.eval(&lanes));
            for c in 0..3 {
                sum[c] += v[c] as f64 / m as f64;
            }
        }
        for c in 0..3 {
            // Midpoint rule on piecewise smooth functions (error O(m⁻²)) in f32 (a bias of at most a few ulp).
            assert!(
                (sum[c] / exact[c] - 1.0).abs() < 2e-5,
                "{c}: {} {}",
                sum[c],
                exact[c]
            );
        }
    }

    #[test]
    fn lanes_are_rotations_of_the_hero() {
        let l = Lanes::<8>::new(0.3);
        for i in 0..8 {
            let m = Lanes::<8>::new((0.3 + i as Real / 8.0) % 1.0);
            assert!((m.lambda[0] - l.lambda[i]).abs() < 1e-3);
        }
        let hero = l.hero_only();
        assert_eq!(hero.target[1], 0.0);
        assert_eq!(hero.xyz[1][0], l.xyz[1][0] * 8.0);
    }

    #[test]
    fn splats_are_bounded_by_the_mix() {
        let mut worst: Real = 0.0;
        for j in 0..10_000 {
            let l = Lanes::<1>::new(j as Real / 10_000.0);
            assert!(l.target[0] > 0.0);
            for c in 0..3 {
                worst = worst.max(l.xyz[c][0] / l.target[0]);
            }
        }
        // The figure that TARGET_MIX states.
        assert!((3.2..3.3).contains(&worst), "{worst}");
        let l = Lanes::<1>::with(visible_cdf(825.0), Target::Bins);
        assert!(l.target[0] >= BIN_FLOOR * l.nm()[0]);
    }
}
