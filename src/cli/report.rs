//! What a render tells about itself: stats.json, EXR metadata, the closing line.

use super::CliError;
use super::decide::Decisions;
use super::engine::Told;
use super::identity::Identity;
use super::instancing::Instancing;
use super::job::Job;
use crate::accel::Disagreement;
use crate::chain::Shares;
use crate::film::ErrorSummary;
use crate::integrator::MltResult;
use crate::mutation::Strategy;
use crate::output::{Metadata, Window};
use crate::path::{Site, Tally};
use crate::scene::Scene;
use crate::scene::spectrum::Target;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

/// stats.json. Times in seconds.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    version: &'static str,
    embree: String,
    accel: String,
    integrator: String,
    seed: u64,
    scene_hash: String,
    lanes: usize,
    threads: usize,
    resolution: [u32; 2],
    crop: [u32; 4],
    max_depth: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    spectral_bins: Option<usize>,
    triangles: usize,
    /// Objects kept once, places where they stand, and what the primitives would be if each place had its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    instancing: Option<Instancing>,
    /// Of the acceleration structure.
    accel_bytes: usize,
    load_seconds: f64,
    build_seconds: f64,
    wall_seconds: f64,
    cpu_seconds: f64,
    peak_memory_bytes: u64,
    rays_closest: u64,
    rays_visibility: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    samples_per_pixel: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mlt: Option<MltReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    decisions: Option<Decisions>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ErrorReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    checked: Option<Disagreement>,
    faults: BTreeMap<&'static str, u64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    fault_sites: Vec<Site>,
}

/// The image's error; `relative` is null where it cannot be told.
#[derive(Clone, Debug, Serialize)]
struct ErrorReport {
    #[serde(flatten)]
    found: ErrorSummary,
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    target_met: Option<bool>,
}

#[derive(Clone, Debug, Default, Serialize)]
struct MltReport {
    target: &'static str,
    rounds: u64,
    mutations: u64,
    direct_samples_per_pixel: f64,
    b: f64,
    b_standard_error: f64,
    longest_stay: u64,
    strategies: BTreeMap<&'static str, StrategyReport>,
}

#[derive(Clone, Debug, Default, Serialize)]
struct StrategyReport {
    share: f64,
    proposed: u64,
    constructed: u64,
    accepted: u64,
    acceptance_rate: f64,
    longest_run_of_rejections: u64,
}

impl Report {
    /// Starts a report with what is known beforehand.
    pub fn new(seed: u64, scene: &Scene, job: &Job, told: Told) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            embree: told.embree,
            accel: format!("{:?}", job.accel).to_lowercase(),
            integrator: format!("{:?}", job.integrator).to_lowercase(),
            seed,
            scene_hash: format!("{:016x}", scene.hash),
            lanes: job.plan.lanes,
            threads: rayon::current_num_threads(),
            resolution: scene.camera.resolution,
            crop: scene.camera.crop,
            max_depth: scene.settings.max_depth,
            spectral_bins: job.bins.map(|b| b.count),
            triangles: scene.geometry.triangle_count(),
            instancing: Instancing::of(&scene.geometry),
            accel_bytes: told.bytes,
            load_seconds: told.load.as_secs_f64(),
            build_seconds: told.build.as_secs_f64(),
            ..Self::default()
        }
    }

    /// What `--accel checked` found.
    pub fn checked(&mut self, found: Disagreement) {
        self.checked = Some(found);
    }

    /// The same, if it was asked for.
    pub fn disagreement(&self) -> Option<&Disagreement> {
        self.checked.as_ref()
    }

    /// Starts a report on a render done elsewhere, of which this is known.
    pub fn of(i: &Identity) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            embree: i.embree.clone(),
            accel: i.accel.clone(),
            integrator: i.integrator.clone(),
            seed: i.seed,
            scene_hash: i.scene.clone(),
            lanes: i.lanes,
            threads: rayon::current_num_threads(),
            resolution: i.resolution,
            crop: i.region,
            max_depth: i.max_depth,
            spectral_bins: i.spectral,
            triangles: i.triangles,
            ..Self::default()
        }
    }

    /// Samples a pixel of pt and bdpt.
    pub fn samples(&mut self, spp: u64) {
        self.samples_per_pixel = Some(spp);
    }

    /// What MLT has to tell; the target by its name on the command line.
    pub fn mlt(&mut self, r: &MltResult, shares: &Shares, target: Target) {
        self.mlt = Some(MltReport {
            target: match target {
                Target::Luminance => "luminance",
                Target::Mixed | Target::Bins => "mixed",
            },
            rounds: r.rounds,
            mutations: r.mutations,
            direct_samples_per_pixel: r.direct_samples,
            b: r.b.0,
            b_standard_error: r.b.1,
            longest_stay: r.stats.longest_stay,
            strategies: Strategy::ALL
                .iter()
                .zip(r.stats.strategies)
                .map(|(s, c)| {
                    let rate = c.accepted as f64 / c.proposed.max(1) as f64;
                    let r = StrategyReport {
                        share: shares.0[*s as usize],
                        proposed: c.proposed,
                        constructed: c.constructed,
                        accepted: c.accepted,
                        acceptance_rate: rate,
                        longest_run_of_rejections: c.longest_run,
                    };
                    (s.name(), r)
                })
                .collect(),
        });
    }

    /// What was decided by a look at the scene.
    pub fn decided(&mut self, decisions: Decisions) {
        self.decisions = Some(decisions);
    }

    /// The image's error, and whether the target for it was met.
    pub fn error(&mut self, found: ErrorSummary, target: Option<f64>, met: bool) {
        self.error = Some(ErrorReport {
            found,
            target,
            target_met: target.map(|_| met),
        });
    }

    /// Times, memory and counters at the end.
    pub fn finish(&mut self, wall: Duration, cpu: f64, memory: u64, t: &Tally) {
        self.wall_seconds = wall.as_secs_f64();
        self.cpu_seconds = cpu;
        self.peak_memory_bytes = memory;
        self.rays_closest = t.rays_closest;
        self.rays_visibility = t.rays_visibility;
        self.faults = BTreeMap::from([
            ("hit_clamped", t.hits_clamped),
            ("nan", t.fault_nan),
            ("negative", t.fault_negative),
            ("infinite", t.fault_infinite),
            ("zero_density", t.fault_zero_density),
        ]);
    }

    /// Where impossible values were met.
    pub fn sites(&mut self, sites: Vec<Site>) {
        self.fault_sites = sites;
    }

    /// See [`Self::sites`].
    pub fn fault_sites(&self) -> &[Site] {
        &self.fault_sites
    }

    /// Faults that must not happen.
    pub fn faults_impossible(&self) -> u64 {
        self.faults
            .iter()
            .filter(|(k, _)| **k != "hit_clamped")
            .map(|(_, v)| v)
            .sum()
    }

    /// There is a picture: a round or a sample of it.
    pub fn begun(&self) -> bool {
        let rounds = self.mlt.as_ref().map(|m| m.rounds);
        rounds.or(self.samples_per_pixel) != Some(0)
    }

    /// The part of the image that is rendered.
    pub fn crop(&self) -> [u32; 4] {
        self.crop
    }

    /// What goes into an EXR's header.
    pub fn metadata(&self) -> Metadata {
        let [w, h] = self.resolution.map(|v| v as usize);
        let origin = [self.crop[0] as i32, self.crop[1] as i32];
        let faults = serde_json::to_string(&self.faults).unwrap_or_default();
        let mut counters = vec![
            ("integrator".to_owned(), self.integrator.clone()),
            ("faults".to_owned(), faults),
            (
                "rays".to_owned(),
                (self.rays_closest + self.rays_visibility).to_string(),
            ),
        ];
        if let Some(m) = &self.mlt {
            counters.push(("rounds".into(), m.rounds.to_string()));
            counters.push(("mutations".into(), m.mutations.to_string()));
            let shares = Strategy::ALL.map(|s| {
                let share = m.strategies.get(s.name()).map_or(0.0, |r| r.share);
                format!("{}={share}", s.name())
            });
            counters.push(("mutate".into(), shares.join(",")));
        }
        if let Some(s) = self.samples_per_pixel {
            counters.push(("samplesPerPixel".into(), s.to_string()));
        }
        if let Some(e) = self.error.as_ref().map(|e| e.found) {
            counters.push(("relativeError".into(), format!("{:e}", e.relative)));
            counters.push(("blackPixels".into(), e.black_pixels.to_string()));
            let freedom = e.degrees_of_freedom.to_string();
            counters.push(("errorDegreesOfFreedom".into(), freedom));
        }
        Metadata {
            scene_hash: u64::from_str_radix(&self.scene_hash, 16).unwrap_or(0),
            seed: self.seed,
            b: self.mlt.as_ref().map(|m| m.b),
            b_standard_error: self.mlt.as_ref().map(|m| m.b_standard_error),
            counters,
            window: Some(Window {
                origin,
                full: [w, h],
            }),
        }
    }

    /// The image's relative error, where it can be told.
    pub fn relative_error(&self) -> Option<f64> {
        self.error
            .as_ref()
            .map(|e| e.found.relative)
            .filter(|e| e.is_finite())
    }

    /// Wall time of the work, seconds.
    pub fn seconds(&self) -> f64 {
        self.wall_seconds
    }

    /// A line about the error, for a person.
    pub fn error_line(&self) -> Option<String> {
        let e = self.error.as_ref()?;
        let rounds = self.mlt.as_ref().map(|m| m.rounds);
        let done = match (rounds, self.samples_per_pixel) {
            (Some(r), _) => format!("{r} rounds"),
            (None, s) => format!("{} samples per pixel", s.unwrap_or(0)),
        };
        let mut line = format!(
            "relative error {:.2} % after {done}",
            100.0 * e.found.relative
        );
        if e.found.black_pixels > 0 {
            line += &format!(", {} pixels still black", e.found.black_pixels);
        }
        if let (Some(target), Some(met)) = (e.target, e.target_met) {
            let not = if met { "" } else { "not " };
            line += &format!("; target of {} % {not}reached", 100.0 * target);
        }
        Some(line)
    }

    /// One line for a person.
    pub fn summary(&self) -> String {
        let rays = (self.rays_closest + self.rays_visibility) as f64 / self.wall_seconds / 1e6;
        match &self.mlt {
            Some(m) => format!(
                "{} in {:.1} s: {:.1} M mutations ({:.2} M/s), {rays:.2} M rays/s, b = {:.4e} ± {:.1} %",
                self.integrator,
                self.wall_seconds,
                m.mutations as f64 / 1e6,
                m.mutations as f64 / 1e6 / self.wall_seconds,
                m.b,
                100.0 * m.b_standard_error / m.b.max(f64::MIN_POSITIVE)
            ),
            None => format!(
                "{} in {:.1} s: {} samples per pixel, {rays:.2} M rays/s",
                self.integrator,
                self.wall_seconds,
                self.samples_per_pixel.unwrap_or(0)
            ),
        }
    }
}

/// Writes the report as JSON, atomically.
pub fn write_json(path: &Path, report: &Report) -> Result<(), CliError> {
    let text =
        serde_json::to_string_pretty(report).map_err(|e| CliError::Internal(e.to_string()))?;
    crate::output::write_atomic(path, (text + "\n").as_bytes())?;
    Ok(())
}
