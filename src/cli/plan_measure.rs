//! `metrolux plan SCENE --measure`: what simulating each effect costs that the scene does not call for.
//!
//! The scene is rendered as planned and with an effect forced, in turn, each turn with seeds of its own; who begins
//! alternates. What is timed are whole stretches of chains with their direct pass (or camera samples), after the first
//! stretch, in which the chains are seeded and caches fill. Ratios are those of a pair of turns, of wall time and of
//! processor time, which other programs disturb less; their median and extremes are told.

use super::CliError;
use super::decide::Decisions;
use super::engine::{Prepared, mlt_options};
use super::render_args::RenderArgs;
use crate::accel::{Accel, Embree, EmbreeOptions};
use crate::chain::MltOptions;
use crate::integrator::{Bdpt, Budget, Progress, bdpt_bins, mlt, pt_bins};
use crate::path::{Heuristic, Tally, World};
use crate::plan::{Effect, Verdict};
use crate::scene::IntegratorKind;
use crate::study::process::processor_seconds;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::sync::Mutex;
use std::time::Instant;

/// Images are compared in so many tiles each way.
const TILES: usize = 4;
/// Seeding samples of a group: fewer than a render makes, which has more rounds to spread them over.
const SEEDS: u32 = 512;
/// Most pixels that are measured, unless the user names a resolution: many small images say more than one large.
const PIXELS: f64 = 128.0 * 128.0;

/// What one effect, or a set of them, costs.
#[derive(Debug, Serialize)]
pub struct Row {
    /// What is forced.
    pub forced: String,
    /// Why there is no figure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
    /// Wall time forced over planned: median, least, most over the pairs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall: Option<[f64; 3]>,
    /// The same of processor time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cpu: Option<[f64; 3]>,
    /// Microseconds of wall time for a mutation (or camera sample), planned and forced: medians.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub microseconds: Option<[f64; 2]>,
    /// Rays for a mutation (or camera sample), planned and forced.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rays: Option<[f64; 2]>,
    /// Squared error of the images forced over planned, at the same number of mutations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variance: Option<f64>,
    /// Probability that images of one expectation differ as much: the smallest p of the luminance of 4 × 4 tiles and of the
    /// image's X, Y and Z by Welch's t, corrected for their number (Šidák).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p: Option<f64>,
}

/// One way to render the scene.
struct Setup {
    args: RenderArgs,
    prepared: Prepared,
}

/// One turn of a setup.
#[derive(Clone)]
struct Turn {
    wall: f64,
    cpu: f64,
    /// Mutations or samples in the time.
    units: f64,
    rays: f64,
    /// Y of each tile; X, Y, Z of the image.
    tiles: Vec<f64>,
    error: f64,
}

impl Setup {
    fn new(args: &RenderArgs, force: &[Effect], lanes16: bool) -> Result<Self, CliError> {
        let mut args = args.clone();
        args.effects.force.extend_from_slice(force);
        if lanes16 {
            args.lanes = super::render_args::LanesArg::Sixteen;
        }
        let mut prepared = Prepared::new(&args)?;
        if args.resolution.is_none() && args.region.is_none() {
            let [w, h] = prepared.scene.camera.resolution.map(f64::from);
            let k = (PIXELS / (w * h)).sqrt().min(1.0);
            args.resolution = Some([w, h].map(|n| (n * k).round().max(1.0) as u32));
            prepared = Prepared::new(&args)?;
        }
        Ok(Self { args, prepared })
    }

    /// The same choice for both sides of a comparison: what the command line leaves open is as without a look.
    fn options(&self) -> MltOptions {
        let decided = Decisions::asked(&self.args, &self.prepared.job);
        MltOptions {
            seeds: SEEDS,
            ..mlt_options(&self.args, &self.prepared.job, &decided)
        }
    }

    fn turn<A: Accel>(&self, accel: &A, seed: u64, rounds: u64) -> Turn {
        match self.prepared.job.plan.lanes {
            1 => self.turn_with::<1, A>(accel, seed, rounds),
            4 => self.turn_with::<4, A>(accel, seed, rounds),
            8 => self.turn_with::<8, A>(accel, seed, rounds),
            _ => self.turn_with::<16, A>(accel, seed, rounds),
        }
    }

    fn turn_with<const N: usize, A: Accel>(&self, accel: &A, seed: u64, rounds: u64) -> Turn {
        let Prepared { scene, job, .. } = &self.prepared;
        let world = World::new(scene, accel, scene.settings.max_depth)
            .with_target(job.target)
            .with_plan(&job.plan);
        let [x0, y0, x1, y1] = scene.camera.crop.map(|v| v as usize);
        let pixels = ((x1 - x0) * (y1 - y0)) as f64;
        let mut tally = Tally::default();
        let watch = Watch::default();
        let budget = Budget::Rounds(rounds);
        let (image, errors, units, rays) = match job.integrator {
            IntegratorKind::Mlt => {
                let r = mlt::<N, A>(&world, &self.options(), budget, seed, &watch, &mut tally);
                let t = r.stats.tally;
                let units = r.mutations as f64;
                let rays = (t.rays_closest + t.rays_visibility) as f64 / units;
                (r.image, r.errors, units, rays)
            }
            other => {
                let what = Bdpt {
                    heuristic: Heuristic::Power,
                    indirect_only: false,
                };
                let r = match other {
                    IntegratorKind::Pt => {
                        pt_bins::<N, A>(&world, None, budget, seed, &watch, &mut tally)
                    }
                    _ => bdpt_bins::<N, A>(&world, what, None, budget, seed, &watch, &mut tally),
                };
                let units = r.samples as f64 * pixels;
                let rays = (tally.rays_closest + tally.rays_visibility) as f64 / units;
                (r.image, r.errors, units, rays)
            }
        };
        let (wall, cpu, part) = watch.read();
        let mut tiles = vec![0.0; TILES * TILES + 3];
        for (i, p) in image.iter().enumerate() {
            let (x, y) = (i % (x1 - x0), i / (x1 - x0));
            let tile = y * TILES / (y1 - y0) * TILES + x * TILES / (x1 - x0);
            tiles[tile] += p[1] / pixels;
            for c in 0..3 {
                tiles[TILES * TILES + c] += p[c] / pixels;
            }
        }
        Turn {
            wall,
            cpu,
            units: units * part,
            rays,
            tiles,
            error: errors.summary(&image).relative,
        }
    }
}

/// Reads the clocks whenever a render tells how far it is.
#[derive(Default)]
struct Watch(Mutex<Vec<(f64, Option<Instant>, f64)>>);

impl Progress for Watch {
    fn update(&self, done: f64) {
        let mut times = self.0.lock().expect("no thread panicked");
        times.push((done, Some(Instant::now()), processor_seconds()));
    }
}

impl Watch {
    /// Wall time, processor time and part of the work between the first call and the last.
    fn read(&self) -> (f64, f64, f64) {
        let times = self.0.lock().expect("no thread panicked");
        let (Some(a), Some(b)) = (times.first(), times.last()) else {
            return (0.0, 0.0, 0.0);
        };
        let wall = match (a.1, b.1) {
            (Some(a), Some(b)) => (b - a).as_secs_f64(),
            _ => 0.0,
        };
        (wall, b.2 - a.2, b.0 - a.0)
    }
}

/// Measures each effect that the scene does not call for, all of them together, and 16 lanes in place of 4.
///
/// # Errors
/// A scene or backend that refuses.
pub fn measure(
    args: &RenderArgs,
    rounds: u64,
    repeats: usize,
    mut told: impl FnMut(&Row),
) -> Result<(), CliError> {
    let planned = Setup::new(args, &[], false)?;
    let plan = &planned.prepared.job.plan;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(planned.prepared.job.threads)
        .build()
        .map_err(|e| CliError::Internal(format!("cannot start threads: {e}")))?;
    let off: Vec<Effect> = Effect::ALL
        .into_iter()
        .filter(|e| !plan.on(*e) && *e != Effect::Alpha)
        .collect();
    let mut sets: Vec<(String, Vec<Effect>, bool)> = off
        .iter()
        .map(|e| (e.name().to_owned(), vec![*e], false))
        .collect();
    if off.len() > 1 {
        sets.push(("all of these".into(), off.clone(), false));
    }
    if plan.on(Effect::Colour) && plan.lanes == 4 {
        sets.push(("16 lanes".into(), Vec::new(), true));
    }
    let embree = Embree::new(&planned.prepared.scene.geometry, EmbreeOptions::default())?;
    for (name, force, lanes16) in sets {
        let forced = Setup::new(args, &force, lanes16)?;
        let other = Embree::new(&forced.prepared.scene.geometry, EmbreeOptions::default())?;
        let mut pairs = Vec::new();
        for i in 0..=repeats {
            let seed = args.seed.wrapping_add(1000 * i as u64);
            let a = || pool.install(|| planned.turn(&embree, seed, rounds));
            let b = || pool.install(|| forced.turn(&other, seed + 500, rounds));
            let pair = if i % 2 == 0 {
                let first = a();
                (first, b())
            } else {
                let first = b();
                (a(), first)
            };
            // The first pair warms up.
            if i > 0 {
                pairs.push(pair);
            }
        }
        told(&row(name, &pairs));
    }
    for f in &plan.findings {
        let why = match f.verdict {
            Verdict::CalledFor => "the scene calls for it",
            _ if f.effect == Effect::Alpha => "there is no code for it",
            _ => continue,
        };
        told(&Row {
            forced: f.effect.name().into(),
            why_not: Some(why.into()),
            wall: None,
            cpu: None,
            microseconds: None,
            rays: None,
            variance: None,
            p: None,
        });
    }
    Ok(())
}

fn row(forced: String, pairs: &[(Turn, Turn)]) -> Row {
    let ratio = |time: &dyn Fn(&Turn) -> f64| {
        let per_unit = |t: &Turn| time(t) / t.units;
        let ratios = pairs.iter().map(|(a, b)| per_unit(b) / per_unit(a));
        Some(spread(ratios.collect()))
    };
    let micro = |t: &Turn| 1e6 * t.wall / t.units;
    let mean = |f: &dyn Fn(&(Turn, Turn)) -> f64| {
        pairs.iter().map(f).sum::<f64>() / pairs.len().max(1) as f64
    };
    Row {
        forced,
        why_not: None,
        wall: ratio(&|t| t.wall),
        cpu: ratio(&|t| t.cpu),
        microseconds: Some([
            spread(pairs.iter().map(|p| micro(&p.0)).collect())[0],
            spread(pairs.iter().map(|p| micro(&p.1)).collect())[0],
        ]),
        rays: Some([mean(&|p| p.0.rays), mean(&|p| p.1.rays)]),
        variance: Some(mean(&|p| p.1.error.powi(2)) / mean(&|p| p.0.error.powi(2))),
        p: Some(same(pairs)),
    }
}

/// Median, least and most.
fn spread(mut v: Vec<f64>) -> [f64; 3] {
    v.sort_by(f64::total_cmp);
    let n = v.len();
    if n == 0 {
        return [f64::NAN; 3];
    }
    [0.5 * (v[(n - 1) / 2] + v[n / 2]), v[0], v[n - 1]]
}

/// See [`Row::p`].
fn same(pairs: &[(Turn, Turn)]) -> f64 {
    let count = pairs.first().map_or(0, |p| p.0.tiles.len());
    let n = pairs.len() as f64;
    let moments = |v: &dyn Fn(&(Turn, Turn)) -> f64| {
        let mean = pairs.iter().map(v).sum::<f64>() / n;
        let square: f64 = pairs.iter().map(|p| (v(p) - mean).powi(2)).sum();
        (mean, square / (n - 1.0) / n)
    };
    let (mut least, mut made) = (1.0f64, 0);
    for i in 0..count {
        let (a, va) = moments(&|p| p.0.tiles[i]);
        let (b, vb) = moments(&|p| p.1.tiles[i]);
        let v = va + vb;
        // Rounding of the film alone, or nothing to compare.
        if v.is_nan() || v.sqrt() <= 1e-7 * a.abs() || a == 0.0 {
            continue;
        }
        let freedom = v * v / ((va * va + vb * vb) / (n - 1.0));
        let Ok(t) = StudentsT::new(0.0, 1.0, freedom) else {
            continue;
        };
        let p = 2.0 * t.cdf(-((a - b).abs() / v.sqrt()));
        least = least.min(p);
        made += 1;
    }
    1.0 - (1.0 - least).powi(made.max(1))
}

impl Row {
    /// The head of a table of rows.
    pub const HEAD: &str = "forced        wall forced/planned     processor time          µs planned forced   rays planned forced  \
        variance  same image p";

    /// A line of the table.
    pub fn text(&self) -> String {
        let (Some(wall), Some(cpu), Some([a, b]), Some([c, d]), Some(v), Some(p)) = (
            self.wall,
            self.cpu,
            self.microseconds,
            self.rays,
            self.variance,
            self.p,
        ) else {
            let why = self.why_not.as_deref().unwrap_or("");
            return format!("{:<13} {why}", self.forced);
        };
        let told = |[r, lo, hi]: [f64; 3]| format!("{r:.3} ({lo:.3} … {hi:.3})");
        let (wall, cpu) = (told(wall), told(cpu));
        format!(
            "{:<13} {wall}   {cpu}    {a:>8.3} {b:>8.3}     {c:>8.2} {d:>8.2}    {v:>6.2}    {p:.2}",
            self.forced
        )
    }
}
