//! The number type of light transport: f32, or f64 in a build with the feature `double`, which tells how much of a result
//! is rounding (`metrolux verify --against`).
//!
//! Points, directions, densities and spectra of paths are of this type. What comes from files (vertices, texels, tables),
//! what a ray-tracing backend is asked, and the film are f32 in both builds; a border between them is a call of [`Convert`].

use glam::{DMat3, DVec2, DVec3};

#[cfg(not(feature = "double"))]
mod chosen {
    pub use glam::{Mat3, Vec2, Vec3};
    pub use std::f32::consts;

    /// A number of light transport.
    pub type Real = f32;
}

#[cfg(feature = "double")]
mod chosen {
    pub use glam::{DMat3 as Mat3, DVec2 as Vec2, DVec3 as Vec3};
    pub use std::f64::consts;

    /// A number of light transport.
    pub type Real = f64;
}

pub use chosen::{Mat3, Real, Vec2, Vec3, consts};

/// Between the number type of transport and those of both precisions, for numbers, vectors and arrays of them.
pub trait Convert {
    /// In f32.
    type Single;
    /// In the type of this build.
    type Real;
    /// In f64.
    type Double;
    /// Rounded to f32.
    fn single(self) -> Self::Single;
    /// As this build has it.
    fn real(self) -> Self::Real;
    /// Widened to f64.
    fn double(self) -> Self::Double;
}

macro_rules! convert {
    ($single:ty, $real:ty, $double:ty, $widen:expr, $round:expr) => {
        impl Convert for $single {
            type Single = $single;
            type Real = $real;
            type Double = $double;
            #[inline(always)]
            fn single(self) -> $single {
                self
            }
            #[cfg(not(feature = "double"))]
            #[inline(always)]
            fn real(self) -> $real {
                self
            }
            #[cfg(feature = "double")]
            #[inline(always)]
            fn real(self) -> $real {
                $widen(self)
            }
            #[inline(always)]
            fn double(self) -> $double {
                $widen(self)
            }
        }

        impl Convert for $double {
            type Single = $single;
            type Real = $real;
            type Double = $double;
            #[inline(always)]
            fn single(self) -> $single {
                $round(self)
            }
            #[cfg(not(feature = "double"))]
            #[inline(always)]
            fn real(self) -> $real {
                $round(self)
            }
            #[cfg(feature = "double")]
            #[inline(always)]
            fn real(self) -> $real {
                self
            }
            #[inline(always)]
            fn double(self) -> $double {
                self
            }
        }
    };
}

convert!(f32, Real, f64, f64::from, |v| v as f32);
convert!(
    glam::Vec2,
    Vec2,
    DVec2,
    |v: glam::Vec2| v.as_dvec2(),
    |v: DVec2| v.as_vec2()
);
convert!(
    glam::Vec3,
    Vec3,
    DVec3,
    |v: glam::Vec3| v.as_dvec3(),
    |v: DVec3| v.as_vec3()
);
convert!(
    glam::Mat3,
    Mat3,
    DMat3,
    |m: glam::Mat3| m.as_dmat3(),
    |m: DMat3| m.as_mat3()
);

impl<T: Convert, const N: usize> Convert for [T; N] {
    type Single = [T::Single; N];
    type Real = [T::Real; N];
    type Double = [T::Double; N];
    #[inline(always)]
    fn single(self) -> Self::Single {
        self.map(T::single)
    }
    #[inline(always)]
    fn real(self) -> Self::Real {
        self.map(T::real)
    }
    #[inline(always)]
    fn double(self) -> Self::Double {
        self.map(T::double)
    }
}
