//! `PixelFilter`, `Sampler` and `Integrator`: the defaults of a render.

use super::error::{Result, SceneError};
use super::state::Loader;
use super::view::{Film, directive};
use crate::scene::{FilterKind, FilterSettings, IntegratorKind, RenderSettings};

/// Sampler parameters: which random numbers, not which image.
const SAMPLER: [&str; 4] = ["seed", "randomization", "jitter", "samplesperpixel"];

/// pbrt-v4's samplers.
const SAMPLERS: [&str; 7] = [
    "independent",
    "stratified",
    "halton",
    "sobol",
    "paddedsobol",
    "zsobol",
    "pmj02bn",
];

/// Integrator parameters: how the same image is reached.
const INTEGRATOR: [&str; 9] = [
    "lightsampler",
    "bootstrapsamples",
    "chains",
    "largestepprobability",
    "sigma",
    "visualizestrategies",
    "visualizeweights",
    "rrthreshold",
    "sampler",
];

impl Loader {
    /// Reads what the file says about rendering.
    pub(super) fn render_settings(&mut self, film: &Film, exposure: f64) -> Result<RenderSettings> {
        let filter = self.filter()?;
        let spp = self.sampler()?;
        let (integrator, max_depth, mutations) = self.integrator()?;
        Ok(RenderSettings {
            integrator,
            max_depth,
            spp,
            mutations,
            filename: film.filename.clone(),
            filter,
            film_scale: (film.gain * exposure) as f32,
        })
    }

    fn filter(&mut self) -> Result<FilterSettings> {
        let (kind, p) = directive(self.prelude.filter.take(), "gaussian", "PixelFilter");
        // Kind with pbrt-v4's default parameters, and its default radius.
        let (kind, radius) = match kind.as_str() {
            "box" => (FilterKind::Box, 0.5),
            "triangle" => (FilterKind::Triangle, 2.0),
            "gaussian" => {
                let sigma = p.float_where("sigma", 0.5, "a width above 0", |v| v > 0.0)?;
                (
                    FilterKind::Gaussian {
                        sigma: sigma as f32,
                    },
                    1.5,
                )
            }
            "mitchell" => {
                let b = p.float("B", 1.0 / 3.0)? as f32;
                let c = p.float("C", 1.0 / 3.0)? as f32;
                (FilterKind::Mitchell { b, c }, 2.0)
            }
            other => {
                let e = SceneError::unsupported(&p.at, "this pixel filter is not supported")
                    .found(format!("\"{other}\""))
                    .expected("\"box\", \"triangle\", \"gaussian\" or \"mitchell\"");
                self.complain(vec![e])?;
                (FilterKind::Gaussian { sigma: 0.5 }, 1.5)
            }
        };
        let side = |name| {
            p.float_where(name, radius, "above 0, at most 64", |v| {
                v > 0.0 && v <= 64.0
            })
        };
        let radius = [side("xradius")? as f32, side("yradius")? as f32];
        self.complain(p.unused(&[]))?;
        Ok(FilterSettings { kind, radius })
    }

    fn sampler(&mut self) -> Result<Option<u32>> {
        let (kind, p) = directive(self.prelude.sampler.take(), "independent", "Sampler");
        if !SAMPLERS.contains(&kind.as_str()) {
            self.warn(&p.at, format!("the sampler \"{kind}\" is not known"));
        }
        let count = |name: &str| -> Result<Option<i64>> {
            match p.get(name) {
                Some(_) => p.integer(name, 1, 1..=i64::from(u32::MAX)).map(Some),
                None => Ok(None),
            }
        };
        let spp = if kind == "stratified" {
            let n = count("xsamples")?.unwrap_or(4) * count("ysamples")?.unwrap_or(4);
            Some(n)
        } else {
            count("pixelsamples")?
        };
        self.complain(p.unused(&SAMPLER))?;
        Ok(spp.map(|n| n.min(i64::from(u32::MAX)) as u32))
    }

    fn integrator(&mut self) -> Result<(Option<IntegratorKind>, u32, Option<u32>)> {
        let pending = self.prelude.integrator.take();
        self.sources.integrator = pending
            .as_ref()
            .map(|d| super::state::source(format!("integrator \"{}\"", d.kind), &d.params.at));
        let (kind, p) = directive(pending, "volpath", "Integrator");
        let known = match kind.as_str() {
            "path" | "volpath" | "simplepath" | "simplevolpath" => Some(IntegratorKind::Pt),
            "bdpt" => Some(IntegratorKind::Bdpt),
            "mlt" => Some(IntegratorKind::Mlt),
            // They reach the image by other ways than those here.
            "lightpath" | "sppm" | "randomwalk" => None,
            other => {
                let e = SceneError::unsupported(&p.at, "this integrator is not supported")
                    .found(format!("\"{other}\""))
                    .expected("\"mlt\", \"bdpt\", \"path\" or \"volpath\"");
                self.complain(vec![e])?;
                None
            }
        };
        let max_depth = p.integer("maxdepth", 5, 0..=1 << 20)? as u32;
        let mutations = match p.get("mutationsperpixel") {
            Some(_) => Some(p.integer("mutationsperpixel", 100, 1..=i64::from(u32::MAX))? as u32),
            None => None,
        };
        let mut errors = Vec::new();
        if p.boolean("regularize", false)? {
            let at = p.get("regularize").map_or(&p.at, |q| &q.at);
            errors.push(SceneError::unsupported(
                at,
                "regularisation is not supported",
            ));
        }
        // pbrt's simple integrators can leave out what these cannot; the image is the same.
        let simple = ["samplelights", "samplebsdf"];
        if known.is_some() {
            let harmless: Vec<_> = INTEGRATOR.iter().chain(&simple).copied().collect();
            errors.extend(p.unused(&harmless));
        }
        self.complain(errors)?;
        Ok((known, max_depth, mutations))
    }
}
