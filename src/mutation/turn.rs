//! Small changes of directions: exponentially distributed between two sizes, at a uniform angle (Veach 11.4.3).

use crate::real::{Convert, Real, Vec3};
use crate::scatter::Frame;
#[cfg(test)]
use std::f64::consts::PI;

/// Sizes lo … hi, each octave as likely as any other: s = hi·exp(−ln(hi/lo)·U).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Octaves {
    lo: f64,
    hi: f64,
}

impl Octaves {
    /// Nothing is inside where `lo` ≥ `hi`.
    pub(super) const fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    /// A size for u in 0..1.
    #[inline]
    pub(super) fn sample(self, u: f64) -> f64 {
        self.hi * (-self.spread() * u).exp()
    }

    /// ln(hi/lo): the density of s is 1/(s·spread).
    #[inline]
    pub(super) fn spread(self) -> f64 {
        (self.hi / self.lo).ln()
    }

    /// The size is one that [`Self::sample`] gives.
    #[inline]
    pub(super) fn contains(self, s: f64) -> bool {
        self.lo <= s && s <= self.hi
    }

    /// Density per solid angle of a direction turned by a θ of these: 1/(2π·θ·sin θ·ln(θ2/θ1)).
    #[cfg(test)]
    pub(super) fn per_solid_angle(self, theta: f64) -> f64 {
        1.0 / (2.0 * PI * theta * theta.sin() * self.spread())
    }
}

/// The unit direction `w` turned by `theta`, towards the side that `phi` names.
#[inline]
pub(super) fn turned(w: Vec3, theta: f64, phi: f64) -> Vec3 {
    let (sin, cos) = (theta as Real).sin_cos();
    let (y, x) = (phi as Real).sin_cos();
    Frame::from_normal(w)
        .to_world(Vec3::new(sin * x, sin * y, cos))
        .normalize()
}

/// The angle between unit directions, as exact for small ones as the directions are.
#[inline]
pub(super) fn angle(a: Vec3, b: Vec3) -> f64 {
    let (a, b) = (a.double(), b.double());
    2.0 * (a - b).length().atan2((a + b).length())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octaves_are_equally_likely() {
        let o = Octaves::new(0.01, 0.64);
        let n = 6000;
        let mut count = [0; 6];
        for i in 0..n {
            let s = o.sample((i as f64 + 0.5) / n as f64);
            assert!(o.contains(s));
            count[(s / 0.01).log2() as usize] += 1;
        }
        assert_eq!(count, [1000; 6]);
    }

    /// Also a half turn, where a density with θ² in place of θ·sin θ would be off by π/2.
    #[test]
    fn the_density_of_directions_integrates_to_one() {
        let o = Octaves::new(1e-3, 0.5 * PI);
        let n = 100_000;
        let sum: f64 = (0..n)
            .map(|i| {
                let theta = 1e-3 + (0.5 * PI - 1e-3) * (i as f64 + 0.5) / n as f64;
                let step = (0.5 * PI - 1e-3) / n as f64;
                o.per_solid_angle(theta) * 2.0 * PI * theta.sin() * step
            })
            .sum();
        // The midpoint rule's error: h²/24 · [f'] of f = 1/(θ·spread), largest at its lower end.
        let step = 0.5 * PI / n as f64;
        let error = step * step / 24.0 / (1e-6 * o.spread());
        assert!((sum - 1.0).abs() < 2.0 * error, "{sum}");
    }

    #[test]
    fn a_turn_is_by_its_angle() {
        for w in [Vec3::Z, Vec3::NEG_Z, Vec3::new(0.36, 0.48, -0.8)] {
            for theta in [1e-4, 0.01, 0.5, 1.5] {
                for phi in [0.0, 1.0, 4.0] {
                    let found = angle(w, turned(w, theta, phi));
                    // Unit vectors of 24 bits stand for an angle within a few of their last places.
                    assert!((found - theta).abs() < 4e-7, "{theta}: {found}");
                }
            }
        }
    }
}
