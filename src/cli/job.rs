//! A render job with every choice made: arguments over the scene file's settings over defaults.

use super::CliError;
use super::plan::EffectArgs;
use super::render_args::{
    AccelArg, DirectArg, IntegratorArg, MltArg, RenderArgs, TargetArg, TwoStageArg,
};
use crate::film::Bins;
use crate::integrator::{Budget, Stop};
use crate::plan::{MOST_EDGES, Options, Plan};
use crate::scene::spectrum::Target;
use crate::scene::{IntegratorKind, Scene};
use std::path::{Path, PathBuf};

/// What will be done.
pub struct Job {
    /// Integrator.
    pub integrator: IntegratorKind,
    /// When to stop.
    pub stop: Stop,
    /// Backend.
    pub accel: AccelArg,
    /// What the scene calls for, and what follows.
    pub plan: Plan,
    /// Threads; 0 for as many as there are cores.
    pub threads: usize,
    /// Files to write.
    pub outputs: Vec<PathBuf>,
    /// Spectral bins to write.
    pub bins: Option<Bins>,
    /// What the target of chains is made of.
    pub target: Target,
}

/// Mutations a pixel where neither the command line nor the scene says.
const DEFAULT_MUTATIONS: f64 = 100.0;
/// Samples a pixel where neither the command line nor the scene says.
const DEFAULT_SPP: f64 = 64.0;

impl Job {
    /// Resolves the arguments; resolution, region and depth are written into the scene's settings.
    pub fn new(args: &RenderArgs, scene: &mut Scene) -> Result<Self, CliError> {
        let usage = |m: String| CliError::Usage(m);
        if let Some([w, h]) = args.resolution {
            resize(scene, w, h);
        }
        if let Some([x0, y0, x1, y1]) = args.region {
            let [w, h] = scene.camera.resolution;
            if x0 >= x1 || y0 >= y1 || x1 > w || y1 > h {
                return Err(usage(format!(
                    "--region {x0},{y0},{x1},{y1} is not inside the image: found {w}x{h} pixels, expected \
                     x0 < x1 <= {w} and y0 < y1 <= {h}"
                )));
            }
            scene.camera.crop = [x0, y0, x1, y1];
        }
        if let Some(d) = args.max_depth {
            scene.settings.max_depth = d;
        }
        let integrator = match args.integrator {
            Some(IntegratorArg::Mlt) => IntegratorKind::Mlt,
            Some(IntegratorArg::Bdpt) => IntegratorKind::Bdpt,
            Some(IntegratorArg::Pt) => IntegratorKind::Pt,
            None => scene.settings.integrator.unwrap_or(IntegratorKind::Mlt),
        };
        let is_mlt = integrator == IntegratorKind::Mlt;
        if args.mutations.is_some() && !is_mlt {
            return Err(usage(
                "--mutations is for --integrator mlt; pt and bdpt take --spp".into(),
            ));
        }
        if args.spp.is_some() && is_mlt {
            return Err(usage(
                "--spp is for --integrator pt and bdpt; mlt takes --mutations".into(),
            ));
        }
        let budget = if let Some(t) = args.time_limit {
            Budget::Time(t)
        } else if let Some(r) = args.rounds {
            Budget::Rounds(r)
        } else if args.target_error.is_some() && args.mutations.is_none() && args.spp.is_none() {
            Budget::Rounds(u64::MAX)
        } else if is_mlt {
            let file = scene
                .settings
                .mutations
                .or(scene.settings.spp)
                .map(f64::from);
            Budget::PerPixel(args.mutations.or(file).unwrap_or(DEFAULT_MUTATIONS))
        } else {
            let file = scene.settings.spp.map(f64::from);
            Budget::PerPixel(args.spp.map(f64::from).or(file).unwrap_or(DEFAULT_SPP))
        };
        let outputs = if args.output.is_empty() {
            let name = scene
                .settings
                .filename
                .clone()
                .unwrap_or_else(|| "metrolux.exr".into());
            vec![PathBuf::from(name)]
        } else {
            args.output.clone()
        };
        let one_part = args.output.len() == 1 && !is_image(&args.output[0]);
        if args.shard.is_some() && !one_part {
            return Err(usage(
                "--shard writes one part, which is no image: expected one -o PART without .exr or .png"
                    .into(),
            ));
        }
        for o in outputs.iter().filter(|_| args.shard.is_none()) {
            let ext = o
                .extension()
                .and_then(|e| e.to_str())
                .unwrap_or("")
                .to_ascii_lowercase();
            if ext != "exr" && ext != "png" {
                return Err(usage(format!(
                    "cannot write {}: found ending “{ext}”, expected .exr or .png",
                    o.display()
                )));
            }
        }
        let exr = |o: &PathBuf| o.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        if args.spectral.is_some() && args.shard.is_none() && !outputs.iter().any(exr) {
            return Err(usage(
                "--spectral needs an EXR file to write the bins to: found only PNG, expected -o OUT.exr".into(),
            ));
        }
        super::layers::check(args, is_mlt, outputs.iter().any(exr))?;
        if args.target.is_some() && !is_mlt {
            return Err(usage("--target is for --integrator mlt".into()));
        }
        if args.two_stage == TwoStageArg::On && !is_mlt {
            return Err(usage("--two-stage is for --integrator mlt".into()));
        }
        if args.mlt != MltArg::Full && !is_mlt {
            return Err(usage("--mlt is for --integrator mlt".into()));
        }
        if args.mlt == MltArg::Relative
            && (args.direct() == DirectArg::Separate || args.two_stage == TwoStageArg::On)
        {
            let text = "--mlt relative leaves the image's scale unknown: found --direct separate or --two-stage, which \
                        need it, expected neither";
            return Err(usage(text.into()));
        }
        if args.tuning.sums.is_some() && args.direct() != DirectArg::Chain {
            return Err(usage("--sums is for --direct chain".into()));
        }
        if args.tuning != super::tuning::Tuning::default() && !is_mlt {
            let text = "--plain-deletions, --no-expected-values, --no-stratification, --chains, --seeds and --sums are \
                        for --integrator mlt";
            return Err(usage(text.into()));
        }
        if args.mutate.is_some() && !is_mlt {
            return Err(usage("--mutate is for --integrator mlt".into()));
        }
        let target = match (args.spectral, args.target) {
            (Some(_), Some(TargetArg::Luminance)) => {
                return Err(usage(
                    "--target luminance starves bins that the eye hardly sees: with --spectral, expected mixed"
                        .into(),
                ));
            }
            (Some(_), _) => Target::Bins,
            (None, Some(TargetArg::Luminance)) => Target::Luminance,
            (None, _) => Target::Mixed,
        };
        let job = Self {
            bins: args.spectral.map(|n| Bins::new(n as usize)),
            target,
            plan: plan(args, scene)?,
            integrator,
            stop: Stop {
                budget,
                target_error: args.target_error,
            },
            accel: args.accel,
            threads: args.threads.unwrap_or(0),
            outputs,
        };
        if args.target_error.is_some() && job.is_dark() {
            let text = "--target-error is relative to the image: found a scene without light, whose image is black";
            return Err(usage(text.into()));
        }
        Ok(job)
    }

    /// No light gives any: the image is black.
    pub fn is_dark(&self) -> bool {
        !self.plan.lit.contains(&true)
    }
}

/// Plans the render; what the arguments force or leave out goes into or out of the scene.
fn plan(args: &RenderArgs, scene: &mut Scene) -> Result<Plan, CliError> {
    args.effects.check()?;
    let EffectArgs { force, without } = args.effects.clone();
    let options = Options {
        lanes: args.lanes.count(),
        shares: args.mutate,
        force,
        without,
        flat: None,
    };
    let edges = scene.settings.max_depth as usize + 1;
    if edges > MOST_EDGES {
        let most = MOST_EDGES - 1;
        let file = scene
            .sources
            .integrator
            .as_ref()
            .filter(|_| args.max_depth.is_none());
        let at = file.map_or("--max-depth".into(), |i| i.to_string());
        return Err(CliError::Usage(format!(
            "{at}: paths of that length cannot be stored: found a maximal depth of {}, expected at most {most}",
            scene.settings.max_depth
        )));
    }
    Ok(Plan::make(scene, &options))
}

/// Its name ends like an image's.
pub fn is_image(file: &Path) -> bool {
    let ending = file.extension().and_then(|e| e.to_str());
    ending.is_some_and(|e| e.eq_ignore_ascii_case("exr") || e.eq_ignore_ascii_case("png"))
}

/// Changes the resolution; the field of view of the shorter side and the crop's part of the image stay.
fn resize(scene: &mut Scene, w: u32, h: u32) {
    let c = &mut scene.camera;
    let [ow, oh] = c.resolution;
    let (sx, sy) = (w as f64 / ow as f64, h as f64 / oh as f64);
    let scale = |v: u32, s: f64, max: u32| ((v as f64 * s).round() as u32).min(max);
    c.crop = [
        scale(c.crop[0], sx, w),
        scale(c.crop[1], sy, h),
        scale(c.crop[2], sx, w),
        scale(c.crop[3], sy, h),
    ];
    let old = ow as f32 / oh as f32;
    let new = w as f32 / h as f32;
    // pbrt's default window: ±1 on the shorter side, ±aspect on the longer one.
    let wide = |a: f32| if a > 1.0 { (a, 1.0) } else { (1.0, 1.0 / a) };
    let ((ox, oy), (nx, ny)) = (wide(old), wide(new));
    c.screen = [
        c.screen[0] * nx / ox,
        c.screen[1] * nx / ox,
        c.screen[2] * ny / oy,
        c.screen[3] * ny / oy,
    ];
    c.resolution = [w, h];
}
