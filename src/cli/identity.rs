//! What a run is of: everything that its bits depend on. Two runs go on from, or add up with, each other only if all of
//! it is the same.

use super::job::Job;
use super::lab::GreyBins;
use super::render_args::{PrecisionArg, RenderArgs};
use crate::chain::MltOptions;
use crate::integrator::State;
use crate::scene::{IntegratorKind, Scene};
use serde::{Deserialize, Serialize};

/// The label of a checkpoint or part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of this program.
    pub version: String,
    /// What the code was compiled for: other instructions round otherwise.
    pub machine: String,
    /// Hash of the scene.
    pub scene: String,
    /// Integrator.
    pub integrator: String,
    /// Seed.
    pub seed: u64,
    /// Backend.
    pub accel: String,
    /// Embree's version; another one may name another of two triangles at the same place.
    pub embree: String,
    /// Embree's precision.
    pub precision: String,
    /// Size of the image.
    pub resolution: [u32; 2],
    /// Its part that is rendered.
    pub region: [u32; 4],
    /// Factor on the image, as text: numbers of a label must come back to the last bit.
    pub film_scale: String,
    /// Most scattering events.
    pub max_depth: u32,
    /// Wavelengths of a path.
    pub lanes: usize,
    /// Spectral bins.
    pub spectral: Option<usize>,
    /// What they hold per luminance, where the scene has no colour; as text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub illuminant: Option<Vec<String>>,
    /// Effects forced and left out, and the lights that take part, where that is not all.
    pub plan: String,
    /// Triangles, for the report.
    pub triangles: usize,
    /// Settings of the chains.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chains: Option<Chains>,
}

/// Settings of Metropolis light transport.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chains {
    /// What visits are proportional to.
    pub target: String,
    /// Who computes direct light.
    pub direct: String,
    /// Samples a pixel of the test image of two-stage Metropolis.
    pub two_stage: Option<u32>,
    /// Shares of the strategies, as text.
    pub mutate: Vec<String>,
    /// A pilot found these shares: they follow from scene, seed and settings.
    pub pilot: bool,
    /// Groups, chains of a group, seeding samples, steps of a round, rounds of a generation.
    pub work: [u32; 5],
    /// All that may only be set in code.
    pub other: String,
}

impl Identity {
    /// Of a job on a scene; `embree` as reports tell it.
    pub fn new(
        args: &RenderArgs,
        job: &Job,
        scene: &Scene,
        options: &MltOptions,
        embree: &str,
    ) -> Self {
        let name = |v: &dyn std::fmt::Debug| format!("{v:?}").to_lowercase();
        let o = options;
        let chains = Chains {
            target: name(&job.target),
            direct: name(&o.direct),
            two_stage: o.test_samples,
            mutate: o.shares.0.iter().map(f64::to_string).collect(),
            pilot: args.mutate.is_none(),
            work: [
                o.groups,
                o.chains,
                o.seeds,
                o.round,
                o.rounds_per_generation,
            ],
            other: format!(
                "{} {} {} {} {} {}",
                o.weigh_deletions,
                o.expected_values,
                o.stratify,
                o.entry_uses,
                // Otherwise a function of scene, settings and seed.
                args.tuning
                    .direct_rate
                    .map_or("look".into(), |r| r.to_string()),
                o.relative
            ),
        };
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            machine: machine(),
            scene: format!("{:016x}", scene.hash),
            integrator: name(&job.integrator),
            seed: args.seed,
            accel: name(&job.accel),
            embree: embree.into(),
            precision: match args.accel_precision {
                PrecisionArg::Robust => "robust".into(),
                PrecisionArg::Fast => "fast".into(),
            },
            resolution: scene.camera.resolution,
            region: scene.camera.crop,
            film_scale: (scene.settings.film_scale as f64).to_string(),
            max_depth: scene.settings.max_depth,
            lanes: job.plan.lanes,
            spectral: job.bins.map(|b| b.count),
            illuminant: GreyBins::of(job).map(|g| g.0.iter().map(f64::to_string).collect()),
            plan: plan(args, job),
            triangles: scene.geometry.triangle_count(),
            chains: (job.integrator == IntegratorKind::Mlt).then_some(chains),
        }
    }

    /// As the text of a label.
    pub fn label(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }

    /// What a label's text says.
    ///
    /// # Errors
    /// A reason, if it says something else.
    pub fn of_label(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|e| format!("has a label that cannot be read: {e}"))
    }

    /// That a run's sums are those of the image that the label tells of.
    ///
    /// # Errors
    /// A reason, if they are not.
    pub fn check(&self, run: &State) -> Result<(), String> {
        let c = run.crop();
        let [w, h] = self.resolution;
        let pixels = [c.x0, c.y0, c.x1, c.y1] == self.region && c.x1 <= w && c.y1 <= h;
        let summed = self.spectral.filter(|_| self.illuminant.is_none());
        let told = self.illuminant.as_ref().map(Vec::len);
        let bins =
            summed == run.bins().map(|b| b.count) && told.is_none_or(|n| Some(n) == self.spectral);
        if pixels && bins {
            Ok(())
        } else {
            Err("has a label that does not go with its sums".into())
        }
    }

    /// What differs: each thing with its value in `other`, then here. Empty if nothing does.
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let values = |i: &Self| serde_json::to_value(i).unwrap_or_default();
        let mut found = Vec::new();
        compare("", &values(other), &values(self), &mut found);
        // Shares that follow from what differs besides say nothing more.
        let piloted = |i: &Self| i.chains.as_ref().is_some_and(|c| c.pilot);
        if found.len() > 1 && piloted(self) && piloted(other) {
            found.retain(|f| !f.starts_with("mutate "));
        }
        found
    }
}

fn compare(name: &str, a: &serde_json::Value, b: &serde_json::Value, found: &mut Vec<String>) {
    use serde_json::Value::{Null, Object};
    if let (Object(x), Object(y)) = (a, b) {
        let mut names: Vec<&String> = x.keys().chain(y.keys()).collect();
        names.sort();
        names.dedup();
        for n in names {
            let at = |v: &serde_json::Map<_, _>| v.get(n).cloned().unwrap_or(Null);
            compare(n, &at(x), &at(y), found);
        }
    } else if a != b {
        found.push(format!(
            "{} is {a} there and {b} here",
            name.replace('_', " ")
        ));
    }
}

/// What of the plan is not a function of the scene's hash and the rest of the identity.
fn plan(args: &RenderArgs, job: &Job) -> String {
    let dark: Vec<usize> = (0..job.plan.lit.len())
        .filter(|i| !job.plan.lit[*i])
        .collect();
    format!(
        "force {:?}, without {:?}, grey {}, unlit {dark:?}",
        args.effects.force,
        args.effects.without,
        job.plan.grey.is_some()
    )
}

/// Architecture and the instruction sets that change how sums are rounded or which code runs.
pub fn machine() -> String {
    let mut m = std::env::consts::ARCH.to_owned();
    for (has, name) in [
        (cfg!(target_feature = "fma"), "fma"),
        (cfg!(target_feature = "avx2"), "avx2"),
        (cfg!(target_feature = "avx512f"), "avx512f"),
        (cfg!(feature = "double"), "double"),
    ] {
        if has {
            m = m + "+" + name;
        }
    }
    m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_named() {
        let a = Identity {
            version: "1".into(),
            machine: machine(),
            scene: "00ff".into(),
            integrator: "mlt".into(),
            seed: 1,
            accel: "embree".into(),
            embree: "4".into(),
            precision: "robust".into(),
            resolution: [8, 6],
            region: [0, 0, 8, 6],
            film_scale: "1".into(),
            max_depth: 5,
            lanes: 4,
            spectral: None,
            illuminant: None,
            plan: String::new(),
            triangles: 3,
            chains: Some(Chains {
                target: "mixed".into(),
                direct: "separate".into(),
                two_stage: None,
                mutate: vec!["0.1".into(); 6],
                pilot: true,
                work: [16; 5],
                other: String::new(),
            }),
        };
        assert!(a.differences(&a).is_empty());
        assert_eq!(Identity::of_label(&a.label()), Ok(a.clone()));
        let mut b = a.clone();
        b.seed = 2;
        let chains = b.chains.as_mut().expect("set");
        chains.two_stage = Some(4);
        chains.mutate[0] = "0.2".into();
        let found = a.differences(&b);
        assert_eq!(
            found,
            [
                "two stage is 4 there and null here",
                "seed is 2 there and 1 here"
            ]
        );
        assert!(Identity::of_label("{}").is_err());
    }
}
