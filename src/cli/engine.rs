//! From arguments to an image in memory: for `render`, and for every command that renders on the way.

use super::CliError;
use super::decide::Decisions;
use super::identity::Identity;
use super::job::Job;
use super::lab::Lab;
use super::layers::Separation;
use super::outlet::tell;
use super::plan_memory::Memory;
use super::render_args::{AccelArg, MltArg, PrecisionArg, RenderArgs};
use super::report::Report;
use super::watch::{Unwatched, Watched, Watcher};
use crate::accel::{Accel, Checked, Embree, EmbreeOptions, Obvhs, Recorder};
use crate::chain::MltOptions;
use crate::film::Bins;
use crate::integrator::{Bdpt, Budget, Outcome, Progress, Sampling};
use crate::integrator::{bdpt_kept, first_hit, mlt_kept, pt_kept};
use crate::output::{Channel, Image, Layers, Metadata, SpectralBins, write_exr, write_png};
use crate::path::{Heuristic, Tally, World, eye_on_surface};
use crate::scene::load::load_scene;
use crate::scene::{IntegratorKind, Scene};
use crate::study::process::processor_seconds;
use crate::study::sums::mlt_with_sums;
use rayon::ThreadPool;
use std::path::Path;
use std::time::{Duration, Instant};

/// A scene with every choice made.
pub struct Prepared {
    /// The scene, with resolution, region and depth as asked for.
    pub scene: Scene,
    /// What will be done.
    pub job: Job,
    /// Time of loading.
    pub loaded: Duration,
}

impl Prepared {
    /// Loads the scene and resolves the arguments.
    ///
    /// # Errors
    /// A scene that cannot be read, options that do not go together.
    pub fn new(args: &RenderArgs) -> Result<Self, CliError> {
        let start = Instant::now();
        let scene = load_scene(&args.scene, &args.load_options())?;
        Self::of(args, scene, start.elapsed())
    }

    /// Resolves the arguments for a scene that was loaded in that time.
    ///
    /// # Errors
    /// Options that do not go together.
    pub fn of(args: &RenderArgs, mut scene: Scene, loaded: Duration) -> Result<Self, CliError> {
        let job = Job::new(args, &mut scene)?;
        Ok(Self { scene, job, loaded })
    }
}

/// A rendered image and all that is known of it.
pub struct Rendered {
    /// Linear sRGB of each pixel of the crop.
    pub image: Image,
    /// Radiance per nm, if bins were asked for.
    pub bins: Option<SpectralBins>,
    /// Standard error of each pixel's luminance.
    pub error: Vec<f32>,
    /// What else an EXR gets.
    pub channels: Vec<Channel>,
    /// What goes into an EXR's header.
    pub metadata: Metadata,
    /// What goes into stats.json.
    pub report: Report,
    /// Rays that could not be written.
    pub unsaved: Option<CliError>,
}

impl Rendered {
    /// Writes an EXR or, by the name's ending, a PNG with this exposure in stops.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, file: &Path, exposure: f32) -> Result<(), CliError> {
        if is_png(file) {
            write_png(file, &self.image, exposure)?;
        } else {
            let layers = Layers {
                spectral: self.bins.as_ref(),
                error: Some(&self.error),
                channels: &self.channels,
            };
            write_exr(file, &self.image, &self.metadata, layers)?;
        }
        Ok(())
    }
}

/// Its name ends like a PNG's.
pub fn is_png(file: &Path) -> bool {
    file.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("png"))
}

/// Rays that `--record-rays` keeps at most: 640 MB of memory and of file.
const RECORDED: usize = 20_000_000;

fn save_rays<A: Accel>(recorder: &Recorder<A>, file: &Path) -> Result<(), CliError> {
    let saved = recorder.save(file);
    saved.map_err(|e| CliError::not_writable(file, e))?;
    let missed = recorder.missed();
    if missed > 0 {
        tell(format_args!(
            "warning: the last {missed} rays of this render are not in {}",
            file.display()
        ));
    }
    Ok(())
}

/// Samples a pixel of the test image of `--two-stage`: 25 pixels are averaged.
const TEST_SAMPLES: u32 = 4;

/// Settings of Metropolis light transport.
pub fn mlt_options(args: &RenderArgs, job: &Job, decided: &Decisions) -> MltOptions {
    let one = (args.mlt != MltArg::Full).then_some(1);
    let of = MltOptions::default();
    let options = args.tuning.apply(MltOptions {
        direct: decided.direct,
        direct_rate: decided.direct_rate,
        bins: sampled_bins(job),
        shares: decided.shares,
        test_samples: decided.two_stage.then_some(TEST_SAMPLES),
        chains: one.unwrap_or(of.chains),
        entry_uses: one.unwrap_or(of.entry_uses),
        relative: args.mlt == MltArg::Relative,
        ..of
    });
    // Nothing to seed: one sample of each group finds that its b is 0.
    let seeds = if decided.chain { options.seeds } else { 1 };
    MltOptions { seeds, ..options }
}

/// Looks at the scene, as a render does before it starts.
///
/// # Errors
/// A backend that refuses, threads that cannot be started.
pub fn decide(args: &RenderArgs, prepared: &Prepared) -> Result<Decisions, CliError> {
    let Prepared { scene, job, .. } = prepared;
    let accel = Embree::new(&scene.geometry, EmbreeOptions::default())?;
    let world = World::new(scene, &accel, scene.settings.max_depth)
        .with_target(job.target)
        .with_plan(&job.plan);
    let pool = threads(job.threads)?;
    let tally = &mut Tally::default();
    Ok(pool.install(|| match job.plan.lanes {
        1 => Decisions::new::<1, _>(args, job, &world, tally),
        4 => Decisions::new::<4, _>(args, job, &world, tally),
        8 => Decisions::new::<8, _>(args, job, &world, tally),
        _ => Decisions::new::<16, _>(args, job, &world, tally),
    }))
}

/// Builds the backend and renders, on threads of its own.
///
/// # Errors
/// A backend that refuses, threads that cannot be started.
pub fn render(
    args: &RenderArgs,
    prepared: &Prepared,
    progress: &dyn Progress,
) -> Result<Rendered, CliError> {
    render_watched(args, prepared, progress, &mut Unwatched)
}

/// As [`render`], with somebody who may stop it and go on with it.
///
/// # Errors
/// Those of [`render`], and a state to go on from that is of another render.
pub fn render_watched(
    args: &RenderArgs,
    prepared: &Prepared,
    progress: &dyn Progress,
    watcher: &mut (dyn Watcher + Send),
) -> Result<Rendered, CliError> {
    let pool = threads(prepared.job.threads)?;
    render_on(&pool, args, prepared, progress, watcher)
}

/// So many threads; 0 for one a core.
///
/// # Errors
/// Threads that cannot be started.
pub fn threads(count: usize) -> Result<ThreadPool, CliError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
    pool.map_err(|e| CliError::Internal(format!("cannot start threads: {e}")))
}

/// As [`render_watched`], on threads that are there.
///
/// # Errors
/// Those of [`render_watched`].
pub fn render_on(
    pool: &ThreadPool,
    args: &RenderArgs,
    prepared: &Prepared,
    progress: &dyn Progress,
    watcher: &mut (dyn Watcher + Send),
) -> Result<Rendered, CliError> {
    let Prepared { scene, job, loaded } = prepared;
    if let Some(text) = Memory::of(scene, job).too_much() {
        return Err(CliError::Usage(text));
    }
    let build = Instant::now();
    let told = |embree: String, accel: &dyn Accel| Told {
        load: *loaded,
        build: build.elapsed(),
        embree,
        bytes: accel.memory_bytes(),
    };
    let options = EmbreeOptions {
        robust: args.accel_precision == PrecisionArg::Robust,
        // The library's own threads build while the pool's sleep.
        threads: pool.current_num_threads(),
        ..EmbreeOptions::default()
    };
    let embree = || Embree::build(&scene.geometry, options, &|done| progress.building(done));
    match (job.accel, &args.record_rays) {
        (AccelArg::Embree, file) => {
            let accel = embree()?;
            let told = told(accel.version(), &accel);
            let Some(file) = file else {
                return pool
                    .install(|| watched_on(args, job, scene, &accel, told, (progress, watcher)));
            };
            let accel = Recorder::new(accel, RECORDED / pool.current_num_threads());
            let any: &dyn Accel = &accel;
            let mut rendered =
                pool.install(|| watched_on(args, job, scene, &any, told, (progress, watcher)))?;
            rendered.unsaved = save_rays(&accel, file).err();
            Ok(rendered)
        }
        (AccelArg::Checked, None) => {
            let embree = embree()?;
            let version = embree.version();
            let obvhs = pool.install(|| Obvhs::new(&scene.geometry));
            let accel = Checked::new(embree, obvhs);
            // Behind a table of functions like the recorder: the renderer is not compiled once more for it.
            let any: &dyn Accel = &accel;
            let told = told(version, any);
            let mut rendered =
                pool.install(|| watched_on(args, job, scene, &any, told, (progress, watcher)))?;
            rendered.report.checked(accel.disagreement());
            Ok(rendered)
        }
        (AccelArg::Obvhs, None) => {
            let accel = pool.install(|| Obvhs::new(&scene.geometry));
            let told = told("not used".into(), &accel);
            pool.install(|| watched_on(args, job, scene, &accel, told, (progress, watcher)))
        }
        (AccelArg::Obvhs | AccelArg::Checked, Some(_)) => {
            let text = "--record-rays is for --accel embree, whose rays are replayed";
            Err(CliError::Usage(text.into()))
        }
    }
}

/// What is known before the first ray.
pub struct Told {
    /// Time of loading.
    pub load: Duration,
    /// Time of building.
    pub build: Duration,
    /// Embree's version.
    pub embree: String,
    /// Bytes of the acceleration structure.
    pub bytes: usize,
}

/// Who hears of progress, who may stop the render.
type Around<'a> = (&'a dyn Progress, &'a mut (dyn Watcher + Send));

/// Renders on the threads of the pool it is called in, with a backend that stands.
fn watched_on<A: Accel>(
    args: &RenderArgs,
    job: &Job,
    scene: &Scene,
    accel: &A,
    told: Told,
    around: Around,
) -> Result<Rendered, CliError> {
    match job.plan.lanes {
        1 => with_lanes::<1, A>(args, job, scene, accel, told, around),
        4 => with_lanes::<4, A>(args, job, scene, accel, told, around),
        8 => with_lanes::<8, A>(args, job, scene, accel, told, around),
        _ => with_lanes::<16, A>(args, job, scene, accel, told, around),
    }
}

fn with_lanes<const N: usize, A: Accel>(
    args: &RenderArgs,
    job: &Job,
    scene: &Scene,
    accel: &A,
    told: Told,
    (progress, watcher): Around,
) -> Result<Rendered, CliError> {
    let world = World::new(scene, accel, scene.settings.max_depth)
        .with_target(job.target)
        .with_plan(&job.plan);
    let mut looks = Tally::default();
    if let Some(id) = eye_on_surface(&world, &mut looks) {
        let of = &scene.sources;
        let camera = of
            .camera
            .as_ref()
            .map_or(String::new(), |c| format!("{c}: "));
        let surface = of.surface(&scene.geometry, id);
        return Err(CliError::Usage(format!(
            "{camera}the eye lies on a surface: found it on {surface}, expected it beside"
        )));
    }
    let begun = (Instant::now(), processor_seconds());
    let decisions = match job.integrator {
        IntegratorKind::Mlt => Decisions::new::<N, A>(args, job, &world, &mut looks),
        IntegratorKind::Pt | IntegratorKind::Bdpt => Decisions::asked(args, job),
    };
    let options = mlt_options(args, job, &decisions);
    let identity = Identity::new(args, job, scene, &options, &told.embree);
    watcher.begin(identity)?;
    let mut tally = Tally::default();
    let mut report = Report::new(args.seed, scene, job, told);
    if job.integrator == IntegratorKind::Mlt {
        report.decided(decisions);
    }
    let hit = args.layers.iter().any(|l| l.is_of_first_hit());
    let hit = hit.then(|| first_hit::<N, A>(&world, &mut looks));
    let separation = Separation::new(&args.layers, hit.as_ref());
    let lab = Lab::new(args, job, scene, &options, report, begun).with_layers(separation);
    let mut watched = Watched { watcher, lab: &lab };
    let what = Sampling {
        world: &world,
        bins: options.bins,
        stop: job.stop,
        seed: args.seed,
    };
    let keeper = &mut watched;
    let outcome = match job.integrator {
        IntegratorKind::Pt => {
            pt_kept::<N, A>(what, progress, &mut tally, keeper).map(Outcome::Sampled)
        }
        IntegratorKind::Bdpt => {
            let how = Bdpt {
                heuristic: Heuristic::Power,
                indirect_only: false,
            };
            bdpt_kept::<N, A>(what, how, progress, &mut tally, keeper).map(Outcome::Sampled)
        }
        IntegratorKind::Mlt if args.tuning.sums.is_some() => {
            let (Some(sums), Budget::Rounds(n)) = (args.tuning.sums, job.stop.budget) else {
                return Err(CliError::Internal("--sums came without --rounds".into()));
            };
            // Behind a table of functions: the step that every render makes is not compiled once more for it.
            let any: &dyn Accel = accel;
            let world = World::new(scene, &any, scene.settings.max_depth)
                .with_target(job.target)
                .with_plan(&job.plan);
            let r = mlt_with_sums::<N, _>(&world, &options, n, args.seed, sums, &mut tally);
            Ok(Outcome::Mlt(Box::new(r)))
        }
        IntegratorKind::Mlt => {
            let when = (job.stop, args.seed);
            mlt_kept::<N, A>(&world, &options, when, progress, &mut tally, keeper)
                .map(|r| Outcome::Mlt(Box::new(r)))
        }
    };
    let outcome = outcome.map_err(|e| watched.watcher.malformed(e))?;
    // Every run looks; what a run that goes on has counted before is without it.
    tally += looks;
    let mut rendered = lab.develop(outcome, &tally);
    rendered.report.sites(world.sites.first());
    Ok(rendered)
}

/// The bins that samples fill: without colour they are made of the luminance at the end.
fn sampled_bins(job: &Job) -> Option<Bins> {
    job.bins.filter(|_| job.plan.grey.is_none())
}
