//! `Spectrum<N>`: one value for each of the N wavelengths that a path carries at once.

use crate::real::Real;
use std::ops::{Add, AddAssign, Div, Index, Mul, MulAssign, Sub};

/// N spectral values, one a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(16))]
pub struct Spectrum<const N: usize>(pub [Real; N]);

impl<const N: usize> Default for Spectrum<N> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<const N: usize> Spectrum<N> {
    /// All lanes 0.
    pub const ZERO: Self = Self([0.0; N]);
    /// All lanes 1.
    pub const ONE: Self = Self([1.0; N]);

    /// All lanes `v`.
    #[inline]
    pub fn splat(v: Real) -> Self {
        Self([v; N])
    }

    /// Lane by lane.
    #[inline]
    pub fn from_fn(f: impl FnMut(usize) -> Real) -> Self {
        Self(std::array::from_fn(f))
    }

    /// Applies `f` to each lane.
    #[inline]
    pub fn map(self, f: impl FnMut(Real) -> Real) -> Self {
        Self(self.0.map(f))
    }

    /// Largest lane.
    #[inline]
    pub fn max(self) -> Real {
        self.0.iter().fold(Real::NEG_INFINITY, |a, &b| a.max(b))
    }

    /// Mean over the lanes.
    #[inline]
    pub fn mean(self) -> Real {
        self.0.iter().sum::<Real>() / N as Real
    }

    /// Every lane is exactly 0.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0.iter().all(|&v| v == 0.0)
    }

    /// Σ aᵢ·bᵢ.
    #[inline]
    pub fn dot(self, o: Self) -> Real {
        let mut s = 0.0;
        for i in 0..N {
            s += self.0[i] * o.0[i];
        }
        s
    }
}

macro_rules! lanewise {
    ($t:ident, $f:ident, $op:tt) => {
        impl<const N: usize> $t for Spectrum<N> {
            type Output = Self;
            #[inline]
            fn $f(self, o: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] $op o.0[i]))
            }
        }
    };
}
lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);
lanewise!(Div, div, /);

impl<const N: usize> Mul<Real> for Spectrum<N> {
    type Output = Self;
    #[inline]
    fn mul(self, k: Real) -> Self {
        self.map(|v| v * k)
    }
}
impl<const N: usize> AddAssign for Spectrum<N> {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
impl<const N: usize> MulAssign for Spectrum<N> {
    #[inline]
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}
impl<const N: usize> Index<usize> for Spectrum<N> {
    type Output = Real;
    #[inline]
    fn index(&self, i: usize) -> &Real {
        &self.0[i]
    }
}
