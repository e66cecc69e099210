//! From arguments to an image in memory: for `render`, and for every command that renders on the way.

use super::CliError;
use super::job::Job;
use super::render_args::{AccelArg, DirectArg, PrecisionArg, RenderArgs};
use super::report::{Report, peak_memory_bytes, processor_seconds};
use crate::accel::{Accel, Checked, Embree, EmbreeOptions, Obvhs, Recorder};
use crate::chain::{Direct, MltOptions};
use crate::film::Bins;
use crate::integrator::{Bdpt, Progress, bdpt_bins, mlt, pt_bins};
use crate::output::{Image, ImageError, Layers, Metadata, SpectralBins, write_exr, write_png};
use crate::path::{Heuristic, Tally, World};
use crate::scene::load::{LoadOptions, load_scene};
use crate::scene::spectrum::{Curve, Grey};
use crate::scene::{IntegratorKind, Scene};
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
        let lenient = args.lenient;
        let mut scene = load_scene(&args.scene, &LoadOptions { lenient })?;
        let job = Job::new(args, &mut scene)?;
        Ok(Self {
            scene,
            job,
            loaded: start.elapsed(),
        })
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
    /// What goes into an EXR's header.
    pub metadata: Metadata,
    /// What goes into stats.json.
    pub report: Report,
}

impl Rendered {
    /// Writes an EXR or, by the name's ending, a PNG with this exposure in stops.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, file: &Path, exposure: f32) -> Result<(), CliError> {
        if file
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("png"))
        {
            write_png(file, &self.image, exposure)?;
        } else {
            let layers = Layers {
                spectral: self.bins.as_ref(),
                error: Some(&self.error),
            };
            write_exr(file, &self.image, &self.metadata, layers)?;
        }
        Ok(())
    }
}

/// Rays that `--record-rays` keeps at most: 640 MB of memory and of file.
const RECORDED: usize = 20_000_000;

fn save_rays<A: Accel>(recorder: &Recorder<A>, file: &Path) -> Result<(), CliError> {
    recorder.save(file).map_err(|source| {
        let path = file.into();
        CliError::Output(ImageError::NotWritable { path, source })
    })?;
    let missed = recorder.missed();
    if missed > 0 {
        eprintln!(
            "warning: the last {missed} rays of this render are not in {}",
            file.display()
        );
    }
    Ok(())
}

/// Samples a pixel of the test image of `--two-stage`: 25 pixels are averaged.
const TEST_SAMPLES: u32 = 4;

/// Builds the backend and renders, on threads of its own.
///
/// # Errors
/// A backend that refuses, threads that cannot be started.
pub fn render(
    args: &RenderArgs,
    prepared: &Prepared,
    progress: &dyn Progress,
) -> Result<Rendered, CliError> {
    let Prepared { scene, job, loaded } = prepared;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(job.threads)
        .build()
        .map_err(|e| CliError::Internal(format!("cannot start threads: {e}")))?;
    let build = Instant::now();
    let told = |embree: String| Told {
        load: *loaded,
        build: build.elapsed(),
        embree,
    };
    let options = EmbreeOptions {
        robust: args.accel_precision == PrecisionArg::Robust,
        ..EmbreeOptions::default()
    };
    match (job.accel, &args.record_rays) {
        (AccelArg::Embree, file) => {
            let accel = Embree::new(&scene.geometry, options)?;
            let told = told(accel.version());
            let Some(file) = file else {
                return Ok(pool.install(|| render_on(args, job, scene, &accel, told, progress)));
            };
            let accel = Recorder::new(accel, RECORDED / pool.current_num_threads());
            let any: &dyn Accel = &accel;
            let rendered = pool.install(|| render_on(args, job, scene, &any, told, progress));
            save_rays(&accel, file)?;
            Ok(rendered)
        }
        (AccelArg::Checked, None) => {
            let embree = Embree::new(&scene.geometry, options)?;
            let version = embree.version();
            let obvhs = pool.install(|| Obvhs::new(&scene.geometry));
            let accel = Checked::new(embree, obvhs);
            let told = told(version);
            // Behind a table of functions like the recorder: the renderer is not compiled once more for it.
            let any: &dyn Accel = &accel;
            let mut rendered = pool.install(|| render_on(args, job, scene, &any, told, progress));
            rendered.report.checked(accel.disagreement());
            Ok(rendered)
        }
        (AccelArg::Obvhs, None) => {
            let accel = pool.install(|| Obvhs::new(&scene.geometry));
            let told = told("not used".into());
            Ok(pool.install(|| render_on(args, job, scene, &accel, told, progress)))
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
}

/// Renders on the threads of the pool it is called in, with a backend that stands.
pub fn render_on<A: Accel>(
    args: &RenderArgs,
    job: &Job,
    scene: &Scene,
    accel: &A,
    told: Told,
    progress: &dyn Progress,
) -> Rendered {
    match job.plan.lanes {
        1 => with_lanes::<1, A>(args, job, scene, accel, told, progress),
        4 => with_lanes::<4, A>(args, job, scene, accel, told, progress),
        8 => with_lanes::<8, A>(args, job, scene, accel, told, progress),
        _ => with_lanes::<16, A>(args, job, scene, accel, told, progress),
    }
}

fn with_lanes<const N: usize, A: Accel>(
    args: &RenderArgs,
    job: &Job,
    scene: &Scene,
    accel: &A,
    told: Told,
    progress: &dyn Progress,
) -> Rendered {
    let world = World::new(scene, accel, scene.settings.max_depth)
        .with_target(job.target)
        .with_plan(&job.plan);
    // Without colour the bins are made of the luminance at the end.
    let bins = job.bins.filter(|_| job.plan.grey.is_none());
    let mut tally = Tally::default();
    let mut report = Report::new(args.seed, scene, job, told);
    let (start, cpu) = (Instant::now(), processor_seconds());
    let (xyz, spectrum, errors, met) = match job.integrator {
        IntegratorKind::Pt => {
            let r = pt_bins::<N, A>(&world, bins, job.stop, args.seed, progress, &mut tally);
            report.samples(r.samples);
            (r.image, r.spectrum, r.errors, r.target_met)
        }
        IntegratorKind::Bdpt => {
            let what = Bdpt {
                heuristic: Heuristic::Power,
                indirect_only: false,
            };
            let stop = job.stop;
            let r = bdpt_bins::<N, A>(&world, what, bins, stop, args.seed, progress, &mut tally);
            report.samples(r.samples);
            (r.image, r.spectrum, r.errors, r.target_met)
        }
        IntegratorKind::Mlt => {
            let direct = match args.direct {
                DirectArg::Separate => Direct::Separate,
                DirectArg::Chain => Direct::InChain,
            };
            let options = args.tuning.apply(MltOptions {
                direct,
                bins,
                shares: job.plan.shares,
                test_samples: args.two_stage.then_some(TEST_SAMPLES),
                ..MltOptions::default()
            });
            let r = mlt::<N, A>(&world, &options, job.stop, args.seed, progress, &mut tally);
            report.mlt(&r, &options.shares, job.target);
            (r.image, r.spectrum, r.errors, r.target_met)
        }
    };
    report.error(errors.summary(&xyz), args.target_error, met);
    report.finish(
        start.elapsed(),
        processor_seconds() - cpu,
        peak_memory_bytes(),
        &tally,
    );
    let [x0, y0, x1, y1] = scene.camera.crop;
    let k = scene.settings.film_scale as f64;
    let scaled: Vec<[f64; 3]> = xyz.iter().map(|p| p.map(|c| c * k)).collect();
    let image = Image::from_xyz((x1 - x0) as usize, (y1 - y0) as usize, &scaled);
    let spectrum = match (job.bins, &job.plan.grey) {
        (Some(bins), Some((illuminant, grey))) => Some(spread(&xyz, illuminant, grey, bins)),
        _ => spectrum,
    };
    let bins = job.bins.zip(spectrum).map(|(bins, values)| SpectralBins {
        bins,
        values: values.iter().map(|v| (v * k) as f32).collect(),
    });
    Rendered {
        image,
        bins,
        error: errors.standard(k),
        metadata: report.metadata(scene),
        report,
    }
}

/// The bins of an image that has its illuminant's spectrum everywhere: `[pixel · bins + bin]`.
fn spread(xyz: &[[f64; 3]], illuminant: &Curve, grey: &Grey, bins: Bins) -> Vec<f64> {
    // Values at the one wavelength, per Y of the film; a bin holds the mean of its nanometres.
    let per_y = 1.0 / (grey.xyz[1] * illuminant.at(grey.lambda)) as f64;
    let mut shape = vec![(0.0f64, 0u32); bins.count];
    for tenth in 0..4700 {
        let l = 360.05 + 0.1 * tenth as f32;
        let (sum, n) = &mut shape[bins.index(l)];
        *sum += illuminant.at(l) as f64;
        *n += 1;
    }
    let shape: Vec<f64> = shape.iter().map(|(sum, n)| sum / *n as f64).collect();
    let pixel = |p: &[f64; 3]| {
        let y = p[1] * per_y;
        shape.iter().map(move |s| s * y).collect::<Vec<_>>()
    };
    xyz.iter().flat_map(pixel).collect()
}
