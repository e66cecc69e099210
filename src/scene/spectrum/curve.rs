//! A quantity as a function of wavelength.

use super::{LAMBDA_MIN, Lanes, Sigmoid, Spectrum};
use crate::real::{Convert, Real};
use std::sync::Arc;

/// A function of wavelength.
#[derive(Clone, Debug, PartialEq)]
pub enum Curve {
    /// The same at every wavelength.
    Constant(f32),
    /// A smooth reflectance or scaled unbounded spectrum: `scale` · sigmoid.
    Sigmoid {
        /// Factor.
        scale: f32,
        /// Shape.
        shape: Sigmoid,
    },
    /// An RGB illuminant: `scale` · sigmoid · illuminant table.
    Illuminant {
        /// Factor.
        scale: f32,
        /// Shape.
        shape: Sigmoid,
        /// Values at 360, 361 … 830 nm.
        table: Arc<Vec<f32>>,
    },
    /// Values at 360, 361 … 830 nm, linear between, times a factor.
    Table {
        /// Factor.
        scale: f32,
        /// 471 values.
        table: Arc<Vec<f32>>,
    },
}

impl Curve {
    /// Value at one wavelength in nm.
    pub fn at(&self, lambda: Real) -> Real {
        match self {
            Self::Constant(v) => v.real(),
            Self::Sigmoid { scale, shape } => scale.real() * shape.at(lambda),
            Self::Illuminant {
                scale,
                shape,
                table,
            } => scale.real() * shape.at(lambda) * lookup(table, lambda),
            Self::Table { scale, table } => scale.real() * lookup(table, lambda),
        }
    }

    /// Values at the wavelengths of `lanes`.
    #[inline]
    pub fn eval<const N: usize>(&self, lanes: &Lanes<N>) -> Spectrum<N> {
        match self {
            Self::Constant(v) => Spectrum::splat(v.real()),
            Self::Sigmoid { scale, shape } => shape.eval(lanes) * scale.real(),
            Self::Illuminant {
                scale,
                shape,
                table,
            } => {
                shape.eval(lanes)
                    * Spectrum::from_fn(|i| scale.real() * lookup(table, lanes.lambda[i]))
            }
            Self::Table { scale, table } => {
                Spectrum::from_fn(|i| scale.real() * lookup(table, lanes.lambda[i]))
            }
        }
    }

    /// The same curve times a factor.
    pub fn scaled(&self, k: f32) -> Self {
        let mut c = self.clone();
        match &mut c {
            Self::Constant(v) => *v *= k,
            Self::Sigmoid { scale, .. }
            | Self::Illuminant { scale, .. }
            | Self::Table { scale, .. } => *scale *= k,
        }
        c
    }

    /// Written as one number: the same at every wavelength.
    pub fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }
}

fn lookup(table: &[f32], lambda: Real) -> Real {
    let x = (lambda - LAMBDA_MIN).clamp(0.0, (table.len() - 1) as Real);
    let i = (x as usize).min(table.len() - 2);
    let f = x - i as Real;
    table[i].real() * (1.0 - f) + table[i + 1].real() * f
}
