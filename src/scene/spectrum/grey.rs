//! One wavelength that stands for all: in a scene whose lights share one spectrum s up to a factor and whose surfaces are
//! grey, f(λ) = s(λ)·g with g the same at every wavelength. A path then carries f at one fixed wavelength, and the colour
//! is the same number times XYZ(s)/s(λ).

use super::{Curve, Lanes, Spectrum, TARGET_MIX, Target, cmf, xyz_of};
use crate::real::Real;

/// The one wavelength of a grey scene and what its value is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grey {
    /// The wavelength, nm.
    pub lambda: Real,
    /// X, Y, Z of light of the illuminant's shape with value 1 at that wavelength.
    pub xyz: [Real; 3],
}

/// Where [`Grey`] lanes say their hero variable is. They are never drawn, and all of a render have the same.
const U: Real = 0.5;

impl Grey {
    /// For an illuminant of that shape; `None` if the eye does not see it. The wavelength is the one that gives most of
    /// its luminance, on a whole nanometre: tables are not interpolated there.
    pub fn new(illuminant: &Curve) -> Option<Self> {
        let bright = |l: &u32| illuminant.at(*l as Real) * cmf(*l as Real)[1];
        let lambda = (360..=830).max_by(|a, b| bright(a).total_cmp(&bright(b)))?;
        let lambda = lambda as Real;
        let value = illuminant.at(lambda) as f64;
        let xyz = xyz_of(illuminant).map(|v| (v / value) as Real);
        let seen = value > 0.0 && xyz[1] > 0.0 && xyz.iter().all(|v| v.is_finite());
        seen.then_some(Self { lambda, xyz })
    }

    /// Lanes that all hold the one wavelength.
    pub fn lanes<const N: usize>(&self, target: Target) -> Lanes<N> {
        let share = 1.0 / N as Real;
        let [x, y, z] = self.xyz;
        let tau = match target {
            Target::Luminance => y,
            // The bins of a grey scene are made of its luminance: they need no floor.
            Target::Mixed | Target::Bins => y + TARGET_MIX * (x + z),
        };
        Lanes {
            u: U,
            lambda: [self.lambda; N],
            xyz: self.xyz.map(|v| Spectrum::splat(v * share)),
            target: Spectrum::splat(tau * share),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::spectrum::{d65, rgb_illuminant};

    #[test]
    fn one_wavelength_has_the_colour_of_all() {
        let table = Curve::Table {
            scale: 3.0,
            table: d65(),
        };
        let lamp = rgb_illuminant([17.0, 12.0, 4.0]);
        for light in [table, lamp, Curve::Constant(0.25)] {
            let grey = Grey::new(&light).expect("seen");
            let lanes = grey.lanes::<1>(Target::Mixed);
            let found = lanes.to_xyz(light.eval(&lanes));
            for (a, b) in found.into_iter().zip(xyz_of(&light)) {
                // Two roundings of f32.
                assert!((a as f64 / b - 1.0).abs() < 3e-7, "{a} {b}");
            }
            let four = grey.lanes::<4>(Target::Luminance);
            let y = light.eval(&four).dot(four.target);
            assert!((y / found[1] - 1.0).abs() < 1e-6);
        }
        assert_eq!(Grey::new(&Curve::Constant(0.0)), None);
    }
}
