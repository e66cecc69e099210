//! Typed questions to a parameter list.

use super::error::{Result, SceneError};
use super::params::{Param, Params, Type, Values};
use glam::DVec3;

impl Params {
    /// The parameter of that name if it has one of the types; an error if it has another.
    pub(super) fn typed(&self, name: &str, types: &[Type]) -> Result<Option<&Param>> {
        let Some(p) = self.get(name) else {
            return Ok(None);
        };
        if types.contains(&p.ty) {
            return Ok(Some(p));
        }
        let names: Vec<_> = types.iter().map(|t| t.name()).collect();
        let message = format!("parameter \"{name}\" of {} has the wrong type", self.owner);
        Err(SceneError::value(&p.at, message)
            .found(p.ty.name())
            .expected(names.join(" or ")))
    }

    /// One number, if given; finite also as a 32-bit float.
    pub(super) fn float_opt(&self, name: &str) -> Result<Option<f64>> {
        let Some(p) = self.typed(name, &[Type::Float])? else {
            return Ok(None);
        };
        one_float(p).map(Some)
    }

    /// One number.
    pub(super) fn float(&self, name: &str, default: f64) -> Result<f64> {
        Ok(self.float_opt(name)?.unwrap_or(default))
    }

    /// One number that must satisfy a condition, which is named in the error.
    pub(super) fn float_where(
        &self,
        name: &str,
        default: f64,
        expected: &str,
        ok: impl Fn(f64) -> bool,
    ) -> Result<f64> {
        let v = self.float(name, default)?;
        if ok(v) {
            return Ok(v);
        }
        Err(self.bad(name).found(v).expected(expected))
    }

    /// An error about the value of a parameter.
    pub(super) fn bad(&self, name: &str) -> SceneError {
        let at = self.get(name).map_or(&self.at, |p| &p.at);
        SceneError::value(
            at,
            format!("{} cannot use this value of \"{name}\"", self.owner),
        )
    }

    /// `N` numbers, if given.
    pub(super) fn floats<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>> {
        let Some(p) = self.typed(name, &[Type::Float])? else {
            return Ok(None);
        };
        finite(p)?;
        count(p, N)?;
        Ok(Some(std::array::from_fn(|i| p.numbers()[i])))
    }

    /// One integer, if given.
    pub(super) fn integer_opt(&self, name: &str) -> Result<Option<i64>> {
        let Some(p) = self.typed(name, &[Type::Integer])? else {
            return Ok(None);
        };
        count(p, 1)?;
        Ok(Some(p.numbers()[0] as i64))
    }

    /// One integer in a range.
    pub(super) fn integer(
        &self,
        name: &str,
        default: i64,
        range: std::ops::RangeInclusive<i64>,
    ) -> Result<i64> {
        let v = self.integer_opt(name)?.unwrap_or(default);
        if range.contains(&v) {
            return Ok(v);
        }
        let expected = format!("{} to {}", range.start(), range.end());
        Err(self.bad(name).found(v).expected(expected))
    }

    /// Integers, if given.
    pub(super) fn integers(&self, name: &str) -> Result<Option<Vec<i64>>> {
        Ok(self
            .typed(name, &[Type::Integer])?
            .map(|p| p.numbers().iter().map(|&v| v as i64).collect()))
    }

    /// One truth value.
    pub(super) fn boolean(&self, name: &str, default: bool) -> Result<bool> {
        let Some(p) = self.typed(name, &[Type::Bool])? else {
            return Ok(default);
        };
        match &p.values {
            Values::Bools(v) if v.len() == 1 => Ok(v[0]),
            Values::Bools(v) => Err(wrong_count(p, v.len(), 1)),
            _ => Ok(default),
        }
    }

    /// One string, if given.
    pub(super) fn string_opt(&self, name: &str) -> Result<Option<&str>> {
        let Some(p) = self.typed(name, &[Type::String])? else {
            return Ok(None);
        };
        match p.strings() {
            [s] => Ok(Some(s)),
            v => Err(wrong_count(p, v.len(), 1)),
        }
    }

    /// One string.
    pub(super) fn string<'a>(&'a self, name: &str, default: &'a str) -> Result<&'a str> {
        Ok(self.string_opt(name)?.unwrap_or(default))
    }

    /// One point or vector, if given.
    pub(super) fn point_opt(&self, name: &str) -> Result<Option<DVec3>> {
        let Some(p) = self.typed(name, &[Type::Point3, Type::Vector3])? else {
            return Ok(None);
        };
        finite(p)?;
        count(p, 3)?;
        Ok(Some(DVec3::from_slice(p.numbers())))
    }

    /// Many points, vectors or normals, if given; every coordinate finite.
    pub(super) fn points(&self, name: &str, types: &[Type]) -> Result<Option<Vec<DVec3>>> {
        let Some(p) = self.typed(name, types)? else {
            return Ok(None);
        };
        finite(p)?;
        Ok(Some(
            p.numbers().chunks_exact(3).map(DVec3::from_slice).collect(),
        ))
    }

    /// Many pairs, if given; every coordinate finite.
    pub(super) fn pairs(&self, name: &str) -> Result<Option<Vec<glam::Vec2>>> {
        let types = [Type::Point2, Type::Vector2, Type::Float];
        let Some(p) = self.typed(name, &types)? else {
            return Ok(None);
        };
        finite(p)?;
        if p.numbers().len() % 2 != 0 {
            return Err(wrong_count(p, p.numbers().len(), p.numbers().len() + 1));
        }
        let pair = |c: &[f64]| glam::Vec2::new(c[0] as f32, c[1] as f32);
        Ok(Some(p.numbers().chunks_exact(2).map(pair).collect()))
    }
}

/// The single number of a parameter.
pub(super) fn one_float(p: &Param) -> Result<f64> {
    count(p, 1)?;
    finite(p)?;
    Ok(p.numbers()[0])
}

/// The parameter holds exactly `n` numbers.
pub(super) fn count(p: &Param, n: usize) -> Result<()> {
    match p.numbers().len() {
        k if k == n => Ok(()),
        k => Err(wrong_count(p, k, n)),
    }
}

fn wrong_count(p: &Param, found: usize, expected: usize) -> SceneError {
    let message = format!("parameter \"{}\" has a wrong number of values", p.name);
    SceneError::value(&p.at, message)
        .found(found)
        .expected(expected)
}

/// Every number is finite as a 32-bit float; the error says which one is not.
pub(super) fn finite(p: &Param) -> Result<()> {
    let Some(i) = p.numbers().iter().position(|v| !(*v as f32).is_finite()) else {
        return Ok(());
    };
    let n = p.ty.arity().unwrap_or(1);
    let message = format!("value {} of parameter \"{}\" is not finite", i / n, p.name);
    Err(SceneError::value(&p.at, message)
        .found(p.numbers()[i])
        .expected("finite numbers"))
}
