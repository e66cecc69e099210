//! Parameters → spectra, by the role they play (pbrt-v4's spectrum types).

use super::error::{Result, SceneError};
use super::lookup::{finite, one_float};
use super::params::{Param, Type};
use super::state::Files;
use super::token::parse_number;
use crate::real::Convert;
use crate::scene::spectrum::{self, Curve, LAMBDA_MAX, LAMBDA_MIN, Rgb2Spec};

/// What a spectrum stands for; RGB means something else in each role.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Reflectance, at most 1.
    Albedo,
    /// Any non-negative quantity, such as η or k.
    Unbounded,
    /// Emission; RGB rides on D65.
    Illuminant,
}

/// The types a spectrum can come in.
pub(super) const SPECTRUM: [Type; 3] = [Type::Rgb, Type::Spectrum, Type::Blackbody];

/// An emitted spectrum with the luminance pbrt-v4 divides it by: that of the illuminant behind an RGB value,
/// else its own.
#[derive(Clone, Debug)]
pub(super) struct Emitted {
    pub(super) curve: Curve,
    pub(super) luminance: f32,
}

impl Emitted {
    /// D65, pbrt's default for lights.
    pub(super) fn white() -> Self {
        let curve = Curve::Table {
            scale: 1.0,
            table: spectrum::d65(),
        };
        let luminance = spectrum::luminance(&curve);
        Self { curve, luminance }
    }

    /// `scale` times the spectrum of luminance 1; black stays black.
    pub(super) fn scaled(&self, scale: f64) -> Curve {
        let k = scale / f64::from(self.luminance);
        if k.is_finite() {
            self.curve.scaled(k as f32)
        } else {
            Curve::Constant(0.0)
        }
    }
}

/// The emitted spectrum a parameter describes.
pub(super) fn emitted(p: &Param, files: &Files) -> Result<Emitted> {
    let curve = curve(p, Role::Illuminant, files)?;
    let luminance = if p.ty == Type::Rgb {
        Emitted::white().luminance
    } else {
        spectrum::luminance(&curve)
    };
    Ok(Emitted { curve, luminance })
}

/// The spectrum a parameter describes.
pub(super) fn curve(p: &Param, role: Role, files: &Files) -> Result<Curve> {
    finite(p)?;
    match p.ty {
        Type::Rgb => rgb(p, role),
        Type::Blackbody => {
            let kelvin = one_float(p)?;
            if kelvin <= 0.0 {
                return Err(bad(p).found(kelvin).expected("a temperature above 0 K"));
            }
            Ok(spectrum::blackbody(kelvin as f32))
        }
        _ => match p.strings() {
            [] => samples(p, pairs(p, p.numbers())?, role),
            [name] => match spectrum::named(name) {
                Some(c) => Ok(c),
                None => from_file(p, name, role, files),
            },
            more => Err(bad(p).found(more.len()).expected("one name")),
        },
    }
}

fn bad(p: &Param) -> SceneError {
    SceneError::value(&p.at, format!("parameter \"{}\" is not a spectrum", p.name))
}

fn rgb(p: &Param, role: Role) -> Result<Curve> {
    super::lookup::count(p, 3)?;
    let c: [f32; 3] = std::array::from_fn(|i| p.numbers()[i] as f32);
    if c.iter().any(|&v| v < 0.0) {
        return Err(bad(p).found(format!("{c:?}")).expected("no negative part"));
    }
    let max = c.iter().fold(0.0f32, |a, &b| a.max(b));
    if role == Role::Albedo && max > 1.0 {
        return Err(bad(p).found(format!("{c:?}")).expected("at most 1"));
    }
    if max == 0.0 {
        return Ok(Curve::Constant(0.0));
    }
    // Grey upsamples to a constant exactly; said here, so that the plan can see it.
    if c[0] == c[1] && c[1] == c[2] {
        return Ok(match role {
            Role::Illuminant => Curve::Table {
                scale: max,
                table: spectrum::d65(),
            },
            _ => Curve::Constant(max),
        });
    }
    // pbrt-v4: an unbounded colour is halved under its maximum, where the fit is smooth.
    let scale = if role == Role::Albedo { 1.0 } else { 2.0 * max };
    let shape = Rgb2Spec::get().fetch(c.map(|v| v / scale));
    Ok(match role {
        Role::Illuminant => Curve::Illuminant {
            scale,
            shape,
            table: spectrum::d65(),
        },
        _ => Curve::Sigmoid { scale, shape },
    })
}

fn pairs(p: &Param, numbers: &[f64]) -> Result<Vec<(f32, f32)>> {
    if numbers.is_empty() || !numbers.len().is_multiple_of(2) {
        return Err(bad(p)
            .found(format!("{} numbers", numbers.len()))
            .expected("pairs of wavelength and value"));
    }
    Ok(numbers
        .chunks_exact(2)
        .map(|c| (c[0] as f32, c[1] as f32))
        .collect())
}

/// Samples are 0 outside their range, as in pbrt-v4; but a refraction index of 0 is none, so η and k keep their
/// first and last value instead.
fn samples(p: &Param, mut pairs: Vec<(f32, f32)>, role: Role) -> Result<Curve> {
    if let Some(w) = pairs.windows(2).find(|w| w[0].0 >= w[1].0) {
        return Err(bad(p)
            .found(format!("{} nm after {} nm", w[1].0, w[0].0))
            .expected("rising wavelengths"));
    }
    if let Some(s) = pairs.iter().find(|s| s.1 < 0.0) {
        return Err(bad(p).found(s.1).expected("no negative value"));
    }
    if role == Role::Unbounded {
        let (first, last) = (pairs[0], pairs[pairs.len() - 1]);
        if first.0.real() > LAMBDA_MIN {
            pairs.insert(0, (LAMBDA_MIN.single(), first.1));
        }
        if last.0.real() < LAMBDA_MAX {
            pairs.push((LAMBDA_MAX.single(), last.1));
        }
    }
    Ok(spectrum::from_samples(&pairs))
}

/// A `.spd` file: wavelength and value in turn, `#` begins a comment.
fn from_file(p: &Param, name: &str, role: Role, files: &Files) -> Result<Curve> {
    let path = files.resolve(name);
    let text = std::fs::read_to_string(&path).map_err(|e| {
        SceneError::file(
            &p.at,
            format!("\"{name}\" is neither a known spectrum nor a readable file"),
        )
        .found(e)
    })?;
    let mut numbers = Vec::new();
    for word in text
        .lines()
        .flat_map(|l| l.split('#').next().unwrap_or("").split_ascii_whitespace())
    {
        match parse_number(word) {
            Some(v) if (v as f32).is_finite() => numbers.push(v),
            _ => {
                let message = format!("{} is not a list of numbers", path.display());
                return Err(SceneError::file(&p.at, message).found(format!("{word:.40}")));
            }
        }
    }
    samples(p, pairs(p, &numbers)?, role)
}
