//! `metrolux plan`: what a scene calls for, why, and what follows from it.

use super::CliError;
use super::decide::Decisions;
use super::engine::{self, Prepared};
use super::inspect::embree_options;
use super::outlet::print;
use super::plan_measure::{Row, measure};
use super::plan_memory::{Memory, megabytes};
use super::render_args::{AccelArg, RenderArgs};
use super::while_running;
use crate::accel::Quality;
use crate::plan::{Chosen, Effect, Finding, Strategy, Unlit};
use crate::real::Convert;
use crate::scene::IntegratorKind;
use clap::Args;
use serde::Serialize;
use std::collections::BTreeMap;
use std::process::ExitCode;

/// Effects chosen on the command line.
#[derive(Args, Clone, Debug, Default)]
pub struct EffectArgs {
    /// Simulate an effect though nothing in the scene calls for it; may be given several times
    ///
    /// The image stays the same; it shows what the effect costs. `metrolux plan` tells which effects there are.
    #[arg(long, value_name = "EFFECT", value_delimiter = ',')]
    pub force: Vec<Effect>,
    /// Leave an effect out though the scene calls for it; a warning tells what is then wrong with the image
    #[arg(long, value_name = "EFFECT", value_delimiter = ',')]
    pub without: Vec<Effect>,
}

impl EffectArgs {
    /// Refuses what cannot be done.
    ///
    /// # Errors
    /// An effect both forced and left out, or one that there is no code for.
    pub fn check(&self) -> Result<(), CliError> {
        if let Some(e) = self.force.iter().find(|e| self.without.contains(e)) {
            let text = format!("found --force {e} and --without {e}, expected one of them");
            return Err(CliError::Usage(text));
        }
        if self.force.contains(&Effect::Alpha) {
            let text = "--force alpha: there is nothing to force, since alpha of 0 or 1 is settled by the loader, and \
                        any other is refused";
            return Err(CliError::Usage(text.into()));
        }
        Ok(())
    }
}

/// Arguments of `metrolux plan`.
#[derive(Args, Debug)]
pub struct PlanArgs {
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Also render the scene as planned and with each effect forced, in turns, and tell what it costs
    #[arg(long)]
    pub measure: bool,
    /// Pairs of turns of --measure
    #[arg(long, value_name = "K", default_value_t = 7, value_parser = clap::value_parser!(u64).range(2..=1000))]
    pub repeats: u64,
    /// The options of render, but for those that say how it is kept and what it tells; with --measure, --rounds says how long
    /// a turn is
    #[command(flatten)]
    pub render: RenderArgs,
}

/// A plan as JSON.
#[derive(Serialize)]
struct Told<'a> {
    scene: String,
    scene_hash: String,
    integrator: String,
    resolution: [u32; 2],
    max_edges: usize,
    lanes: usize,
    /// The wavelength that stands for all in a scene without colour, nm.
    one_wavelength: Option<f32>,
    effects: &'a [Finding],
    strategies: BTreeMap<&'static str, f64>,
    lights: Lights<'a>,
    unused_materials: Vec<String>,
    unseen_shapes: Vec<String>,
    decisions: &'a Option<Decisions>,
    embree: EmbreeFlags,
    memory_bytes: BTreeMap<&'static str, u64>,
    refused: &'a [String],
}

#[derive(Serialize)]
struct Lights<'a> {
    sampled: usize,
    /// In proportion to what they are chosen.
    chosen_by: &'static str,
    chosen: &'a [Chosen],
    left_out: &'a [Unlit],
}

/// What the acceleration structure is asked for.
#[derive(Serialize)]
struct EmbreeFlags {
    used: bool,
    robust: bool,
    compact: bool,
    high_quality: bool,
    filter_callback: bool,
    instance_level: bool,
}

impl EmbreeFlags {
    fn text(&self) -> String {
        if !self.used {
            return "not used".into();
        }
        let word = |on: bool, yes: &'static str, no: &'static str| if on { yes } else { no };
        [
            word(self.robust, "robust", "fast"),
            word(self.compact, "compact", "not compact"),
            word(self.high_quality, "high-quality build", "medium build"),
            word(self.instance_level, "instances", "one level"),
            word(
                self.filter_callback,
                "filter callback",
                "no filter callback",
            ),
        ]
        .join(", ")
    }
}

/// Runs the sub-command.
///
/// # Errors
/// A scene that cannot be read, options that do not go together.
pub fn run(args: &PlanArgs) -> Result<ExitCode, CliError> {
    while_running::refuse(&args.render, "plan")?;
    let prepared = Prepared::new(&args.render)?;
    let (scene, job, plan) = (&prepared.scene, &prepared.job, &prepared.job.plan);
    let options = embree_options(&args.render);
    let flags = EmbreeFlags {
        used: args.render.accel == AccelArg::Embree,
        robust: options.robust,
        compact: options.compact,
        high_quality: options.quality == Quality::High,
        filter_callback: plan.on(Effect::Alpha) || plan.on(Effect::Slivers),
        instance_level: plan.on(Effect::Instances),
    };
    if args.measure {
        return measured(args);
    }
    let memory = Memory::of(scene, job);
    let decisions = match job.integrator {
        IntegratorKind::Mlt => Some(engine::decide(&args.render, &prepared)?),
        IntegratorKind::Pt | IntegratorKind::Bdpt => None,
    };
    let shares = decisions.as_ref().map_or(plan.shares, |d| d.shares);
    let integrator = format!("{:?}", job.integrator).to_lowercase();
    if args.json {
        let told = Told {
            scene: args.render.scene.display().to_string(),
            scene_hash: format!("{:016x}", scene.hash),
            integrator,
            resolution: scene.camera.resolution,
            max_edges: plan.max_edges,
            lanes: plan.lanes,
            one_wavelength: plan.grey.as_ref().map(|g| g.1.lambda.single()),
            effects: &plan.findings,
            strategies: Strategy::ALL
                .iter()
                .map(|s| (s.name(), shares.get(*s)))
                .collect(),
            lights: Lights {
                sampled: plan.lit.iter().filter(|l| **l).count(),
                chosen_by: "luminous_power",
                chosen: &plan.chosen,
                left_out: &plan.unlit,
            },
            unused_materials: plan.unused.iter().map(ToString::to_string).collect(),
            unseen_shapes: plan.unseen.iter().map(ToString::to_string).collect(),
            decisions: &decisions,
            embree: flags,
            memory_bytes: memory.parts.iter().copied().collect(),
            refused: &scene.warnings,
        };
        let text = serde_json::to_string_pretty(&told);
        print(text.map_err(|e| CliError::Internal(e.to_string()))?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let [w, h] = scene.camera.resolution;
    print(format_args!(
        "{}: {integrator}, {w}x{h}",
        args.render.scene.display()
    ))?;
    print(
        plan.text(job.integrator == IntegratorKind::Mlt)
            .trim_end_matches('\n'),
    )?;
    if let Some(decided) = &decisions {
        let [direct, stages] = decided.text();
        print(format_args!("shares         {}", decided.shares()))?;
        print(format_args!("direct light   {direct}"))?;
        print(format_args!("stages         {stages}"))?;
    }
    print(format_args!("embree         {}", flags.text()))?;
    let parts = memory.parts.iter().filter(|p| p.1 > 0);
    let parts: Vec<String> = parts
        .map(|(name, bytes)| format!("{name} {}", megabytes(*bytes)))
        .collect();
    let (total, parts) = (megabytes(memory.total()), parts.join(", "));
    print(format_args!("memory         about {total}: {parts}"))?;
    if let Some(text) = memory.too_much() {
        print(format_args!("               {text}"))?;
    }
    if scene.warnings.is_empty() {
        print("refused        nothing")?;
    }
    for w in &scene.warnings {
        print(format_args!("refused        {w}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Rounds of chains, or camera samples a pixel, of one turn of `--measure`.
const ROUNDS: u64 = 48;

fn measured(args: &PlanArgs) -> Result<ExitCode, CliError> {
    let mut rows = Vec::new();
    if !args.json {
        print(Row::HEAD)?;
    }
    let mut printed = Ok(());
    let rounds = args.render.rounds.unwrap_or(ROUNDS);
    measure(&args.render, rounds, args.repeats as usize, |row| {
        if args.json {
            let row = serde_json::to_value(row);
            rows.push(row.unwrap_or_default());
        } else if printed.is_ok() {
            printed = print(row.text());
        }
    })?;
    printed?;
    if args.json {
        let text = serde_json::to_string_pretty(&rows);
        print(text.map_err(|e| CliError::Internal(e.to_string()))?)?;
    }
    Ok(ExitCode::SUCCESS)
}
