//! `LightSource` and `AreaLightSource`, scaled as pbrt-v4 scales them.

use super::error::{Location, Result, SceneError};
use super::image::Encoding;
use super::params::Params;
use super::spectra::{Emitted, SPECTRUM, emitted};
use super::state::Library;
use crate::scene::spectrum::Curve;
use crate::scene::{Light, Source};
use glam::{DMat3, DMat4, DVec3, Mat3, Vec3};
use std::f64::consts::PI;

/// A light whose position waits for the scene to be recentred.
pub(super) struct PendingLight {
    pub(super) light: Light,
    pub(super) position: Option<DVec3>,
    pub(super) source: Source,
}

/// What an emissive shape gets.
#[derive(Debug)]
pub(super) struct AreaLight {
    pub(super) radiance: Curve,
    /// Wanted power of each pbrt shape; the radiance then has luminance 1.
    pub(super) power: Option<f64>,
    pub(super) two_sided: bool,
    pub(super) at: Location,
}

impl AreaLight {
    /// Radiance of a shape of the given area.
    pub(super) fn radiance(&self, area: f64) -> Curve {
        match self.power {
            None => self.radiance.clone(),
            Some(power) => {
                let sides = if self.two_sided { 2.0 } else { 1.0 };
                self.radiance.scaled((power / (sides * PI * area)) as f32)
            }
        }
    }
}

impl Library {
    fn emitted(&self, p: &Params, name: &str) -> Result<Option<Emitted>> {
        match p.typed(name, &SPECTRUM)? {
            None => Ok(None),
            Some(q) => emitted(q, &self.files).map(Some),
        }
    }

    /// `AreaLightSource "diffuse"`.
    pub(super) fn area_light(&self, kind: &str, p: &Params) -> Result<AreaLight> {
        if kind != "diffuse" {
            return Err(
                SceneError::unsupported(&p.at, "this area light is not supported")
                    .found(format!("\"{kind}\""))
                    .expected("\"diffuse\""),
            );
        }
        if let Some(q) = p.get("filename") {
            return Err(SceneError::unsupported(
                &q.at,
                "area lights with an image are not supported",
            ));
        }
        let l = self.emitted(p, "L")?.unwrap_or_else(|| self.white.clone());
        Ok(AreaLight {
            radiance: l.scaled(scale(p)?),
            power: positive(p, "power")?,
            two_sided: p.boolean("twosided", false)?,
            at: p.at.clone(),
        })
    }

    /// `LightSource`, with the world transform that stands at it.
    pub(super) fn light(
        &mut self,
        kind: &str,
        p: &Params,
        to_world: &DMat4,
    ) -> Result<PendingLight> {
        let source = super::state::source(format!("light \"{kind}\""), &p.at);
        let (light, position) = match kind {
            "point" => {
                let i = self.emitted(p, "I")?.unwrap_or_else(|| self.white.clone());
                let mut s = scale(p)?;
                if let Some(power) = positive(p, "power")? {
                    s *= power / (4.0 * PI);
                }
                let from = p.point_opt("from")?.unwrap_or(DVec3::ZERO);
                let light = Light::Point {
                    position: Vec3::ZERO,
                    intensity: i.scaled(s),
                };
                (light, Some(to_world.transform_point3(from)))
            }
            "spot" => {
                let (light, at) = self.spot(p, to_world)?;
                (light, Some(at))
            }
            "distant" => {
                let l = self.emitted(p, "L")?.unwrap_or_else(|| self.white.clone());
                let mut s = scale(p)?;
                if let Some(illuminance) = positive(p, "illuminance")? {
                    s *= illuminance;
                }
                let (_, d) = aim(p, to_world)?;
                let light = Light::Distant {
                    direction: d,
                    irradiance: l.scaled(s),
                };
                (light, None)
            }
            "infinite" => (self.infinite(p, to_world)?, None),
            other => {
                return Err(
                    SceneError::unsupported(&p.at, "this light is not supported")
                        .found(format!("\"{other}\""))
                        .expected("\"point\", \"spot\", \"distant\" or \"infinite\""),
                );
            }
        };
        Ok(PendingLight {
            light,
            position,
            source,
        })
    }

    fn spot(&self, p: &Params, to_world: &DMat4) -> Result<(Light, DVec3)> {
        let i = self.emitted(p, "I")?.unwrap_or_else(|| self.white.clone());
        let mut s = scale(p)?;
        let cone = p.float_where("coneangle", 30.0, "above 0, at most 180 degrees", |v| {
            v > 0.0 && v <= 180.0
        })?;
        let delta = p.float_where("conedeltaangle", 5.0, "0 to the cone angle", |v| {
            (0.0..=cone).contains(&v)
        })?;
        let end = cone.to_radians().cos();
        let start = (cone - delta).to_radians().cos();
        if let Some(power) = positive(p, "power")? {
            s *= power / (2.0 * PI * ((1.0 - start) + (start - end) / 2.0));
        }
        let (from, direction) = aim(p, to_world)?;
        let light = Light::Spot {
            position: Vec3::ZERO,
            direction,
            cos_start: start as f32,
            cos_end: end as f32,
            intensity: i.scaled(s),
        };
        Ok((light, from))
    }

    fn infinite(&mut self, p: &Params, to_world: &DMat4) -> Result<Light> {
        let l = self.emitted(p, "L")?;
        let mut s = scale(p)?;
        let illuminance = positive(p, "illuminance")?;
        let Some(file) = p.string_opt("filename")? else {
            // Under radiance 1 from everywhere a surface receives π.
            s *= illuminance.map_or(1.0, |e| e / PI);
            return Ok(Light::InfiniteConstant {
                radiance: l.unwrap_or_else(|| self.white.clone()).scaled(s),
            });
        };
        let at = p.get("filename").map_or(&p.at, |q| &q.at);
        if l.is_some() {
            return Err(SceneError::value(
                at,
                "an infinite light has either \"L\" or \"filename\"",
            )
            .found("both"));
        }
        let path = self.files.resolve(file);
        let image = self.images.load(&path, Encoding::Srgb, at)?;
        let map = &self.images.list[image as usize];
        if map.width != map.height {
            let message = "an environment map must be a square equal-area octahedral image";
            return Err(
                SceneError::value(at, message).found(format!("{} × {}", map.width, map.height))
            );
        }
        if let Some(e) = illuminance {
            s *= e / super::octahedral::illuminance(map);
        }
        Ok(Light::InfiniteImage {
            image,
            to_world: rotation(to_world),
            illuminant: self.white.scaled(s),
        })
    }
}

fn scale(p: &Params) -> Result<f64> {
    p.float_where("scale", 1.0, "no negative scale", |v| v >= 0.0)
}

/// A quantity that pbrt ignores unless it is positive.
fn positive(p: &Params, name: &str) -> Result<Option<f64>> {
    Ok(p.float_opt(name)?.filter(|v| *v > 0.0))
}

/// World position of `from` and unit direction to `to`.
fn aim(p: &Params, to_world: &DMat4) -> Result<(DVec3, Vec3)> {
    let from = p.point_opt("from")?.unwrap_or(DVec3::ZERO);
    let to = p.point_opt("to")?.unwrap_or(DVec3::Z);
    let direction = to_world.transform_vector3(to - from);
    let Some(d) = direction.try_normalize() else {
        return Err(p.bad("to").found("the point \"from\" itself"));
    };
    Ok((to_world.transform_point3(from), d.as_vec3()))
}

/// The nearest map with unit columns; scale means nothing to a direction.
fn rotation(m: &DMat4) -> Mat3 {
    let m = DMat3::from_mat4(*m);
    DMat3::from_cols(
        m.x_axis.normalize(),
        m.y_axis.normalize(),
        m.z_axis.normalize(),
    )
    .as_mat3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::spectrum;

    /// `rgb L [1 1 1]` shows as 1: ∫ȳ·L dλ = 1 (pbrt-v4 divides by the illuminant's luminance).
    #[test]
    fn white_has_luminance_one() {
        let y = spectrum::luminance(&Emitted::white().scaled(1.0));
        // Two f32 roundings and one quadrature of 471 terms.
        assert!((y - 1.0).abs() < 1e-5, "{y}");
    }

    #[test]
    fn power_is_area_times_pi_times_radiance() {
        let l = AreaLight {
            radiance: Curve::Constant(1.0),
            power: Some(6.0),
            two_sided: true,
            at: Location {
                file: "".into(),
                line: 0,
                column: 0,
            },
        };
        let Curve::Constant(r) = l.radiance(2.0) else {
            panic!()
        };
        assert!((f64::from(r) * 2.0 * 2.0 * PI - 6.0).abs() < 1e-6);
    }
}
