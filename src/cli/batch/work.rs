//! One job: skipped if it is done, gone on with if it was cut, rendered otherwise.

use super::board::Board;
use super::expand::Job;
use super::store::{Done, Stamp, Store, settings};
use crate::cli::CliError;
use crate::cli::distinct::{each, refuse_shared};
use crate::cli::engine::{self, Prepared};
use crate::cli::keep::{Ended, Keep};
use crate::cli::render::{announce, judge, write, written};
use crate::cli::render_args::{RenderArgs, ResumeArg};
use crate::cli::report::write_json;
use crate::cli::signals::Signals;
use crate::cli::voice::{Level, Voice};
use crate::output::{ImageError, check_writable};
use crate::scene::load::{Setting, load_scene};
use crate::scene::{Camera, RenderSettings, Scene};
use crate::study::page::thumbnail;
use rayon::ThreadPool;
use serde::Serialize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

/// A render that ends within this time gets no checkpoint at its end: making it again costs less than keeping many small
/// ones.
const TRIFLE: Duration = Duration::from_secs(10);

/// How a job came out.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum How {
    /// From the start.
    Rendered,
    /// From a checkpoint.
    Resumed,
    /// It was done before.
    Unchanged,
    /// For this reason it was not done.
    Failed(String),
    /// A signal stopped it.
    Cut,
    /// The batch ended before it was its turn.
    NotBegun,
}

/// What is told of a job.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// How it came out.
    pub how: How,
    /// Its exit code.
    pub code: u8,
    /// Wall time of the rendering.
    pub seconds: f64,
    /// Relative error.
    pub error: Option<f64>,
    /// Times it was tried again.
    pub retries: u32,
}

impl Outcome {
    /// Before its turn.
    pub fn not_begun() -> Self {
        Self {
            how: How::NotBegun,
            code: 75,
            seconds: 0.0,
            error: None,
            retries: 0,
        }
    }

    fn of(done: &Done, how: How) -> Self {
        Self {
            how,
            code: done.code,
            seconds: done.seconds,
            error: done.error,
            retries: 0,
        }
    }
}

/// What all jobs share.
pub struct Ground<'a> {
    /// What is done.
    pub store: &'a Store,
    /// The batch's voice.
    pub voice: &'a Voice,
    /// What was asked of the process.
    pub signals: &'a Signals,
    /// Progress.
    pub board: &'a Board<'a>,
    /// Time between checkpoints.
    pub every: Duration,
    /// Times that a job is tried again.
    pub retry: u32,
}

/// The last scene of a worker, for the next job if that has the same.
#[derive(Default)]
pub struct Shelf {
    kept: Option<(Scene, Loaded)>,
}

/// What is known of a scene that was loaded.
struct Loaded {
    key: (PathBuf, Vec<Setting>, bool),
    view: (Camera, RenderSettings),
    files: Vec<Stamp>,
    took: Duration,
}

impl Shelf {
    fn take(&mut self, args: &RenderArgs) -> Result<(Scene, Loaded), CliError> {
        let key = (args.scene.clone(), args.set.clone(), args.lenient);
        // The old one goes before a new one is loaded.
        if let Some((scene, mut kept)) = self.kept.take().filter(|k| k.1.key == key) {
            kept.took = Duration::ZERO;
            return Ok((scene, kept));
        }
        let (begun, now) = (Instant::now(), SystemTime::now());
        let scene = load_scene(&args.scene, &args.load_options())?;
        let stamps: Option<Vec<Stamp>> = scene.files.iter().map(|f| Stamp::of(f)).collect();
        // A file that was changed since may have been read before that.
        let sure = |s: &Vec<Stamp>| !s.iter().any(|f| f.younger_than(now));
        let loaded = Loaded {
            key,
            view: (scene.camera.clone(), scene.settings.clone()),
            files: stamps.filter(sure).unwrap_or_default(),
            took: begun.elapsed(),
        };
        Ok((scene, loaded))
    }

    /// Puts a scene back, as it was when it was loaded.
    fn put(&mut self, mut scene: Scene, loaded: Loaded, args: &RenderArgs) {
        // What is forced and left out goes into the scene itself.
        if args.effects.force.is_empty() && args.effects.without.is_empty() {
            (scene.camera, scene.settings) = loaded.view.clone();
            self.kept = Some((scene, loaded));
        }
    }
}

/// Does a job on these threads, again if it fails for a reason that may pass.
pub fn run(
    ground: &Ground,
    number: usize,
    job: &Job,
    pool: &ThreadPool,
    shelf: &mut Shelf,
) -> Outcome {
    let voice = ground.voice.of_job(&job.name);
    let mut retries = 0;
    let outcome = loop {
        let attempt = AssertUnwindSafe(|| attempt(ground, number, job, pool, shelf, &voice));
        let ended = catch_unwind(attempt).unwrap_or_else(|_| {
            let text = "this program has a fault: it stopped where it never should";
            Err(CliError::Internal(text.into()))
        });
        let e = match ended {
            Ok(outcome) => break Outcome { retries, ..outcome },
            Err(e) => e,
        };
        // A scene or option that is wrong stays wrong.
        if e.code() != 2 && retries < ground.retry && ground.signals.stop().is_none() {
            retries += 1;
            let text = format!("{e}; trying again, {retries} of {}", ground.retry);
            voice.insist(Level::Warning, &text);
            continue;
        }
        voice.say(Level::Error, &e.to_string());
        break Outcome {
            how: How::Failed(e.to_string()),
            code: e.code(),
            retries,
            ..Outcome::not_begun()
        };
    };
    voice.event("job", &outcome);
    ground.board.ended(number);
    outcome
}

fn attempt(
    ground: &Ground,
    number: usize,
    job: &Job,
    pool: &ThreadPool,
    shelf: &mut Shelf,
    voice: &Voice,
) -> Result<Outcome, CliError> {
    let store = ground.store;
    let settings = settings(job);
    let known = store
        .read(&job.name)
        .filter(|d| d.settings == settings && d.is_there());
    if let Some(done) = known.as_ref().filter(|d| d.is_of_these_files()) {
        return Ok(Outcome::of(done, How::Unchanged));
    }
    let (scene, loaded) = shelf.take(&job.args)?;
    let scene_hash = format!("{:016x}", scene.hash);
    if let Some(mut done) = known.filter(|d| d.scene_hash == scene_hash) {
        // Files were touched, and the scene is the same.
        done.files.clone_from(&loaded.files);
        store.write(&done)?;
        shelf.kept = Some((scene, loaded));
        return Ok(Outcome::of(&done, How::Unchanged));
    }
    let file = store.checkpoint(job, &scene_hash);
    let mut args = job.args.clone();
    args.threads = Some(pool.current_num_threads());
    (args.checkpoint, args.resume) = (Some(file.clone()), Some(ResumeArg::IfThere));
    args.every = ground.every;
    let prepared = Prepared::of(&args, scene, loaded.took)?;
    announce(&args, &prepared, voice);
    let outputs = &prepared.job.outputs;
    let written = written(&args, outputs);
    refuse_shared(
        &written,
        &each("the scene", &prepared.scene.files).collect(),
    )?;
    for (_, o) in &written {
        check_writable(o)?;
    }
    let how = if file.exists() {
        How::Resumed
    } else {
        How::Rendered
    };
    let mut keep = Keep::new(&args, outputs, ground.signals, voice)?.sparing(TRIFLE);
    let shown = ground.board.job(number, voice, &job.name);
    let rendered = engine::render_on(pool, &args, &prepared, &shown, &mut keep);
    shown.finish(rendered.is_ok() && keep.ended == Ended::Finished);
    let rendered = match rendered {
        Err(CliError::Output(ImageError::Bad { path, reason })) if path == file => {
            // Of another machine or library, or damaged: nobody is there to ask.
            let text = format!("{}: {reason}; the job begins anew", path.display());
            voice.insist(Level::Warning, &text);
            std::fs::remove_file(&path)
                .map_err(|source| ImageError::NotWritable { path, source })?;
            return attempt(ground, number, job, pool, shelf, voice);
        }
        other => other?,
    };
    if let Ended::Stopped(_) = keep.result()? {
        return Ok(Outcome {
            how: How::Cut,
            seconds: rendered.report.seconds(),
            ..Outcome::not_begun()
        });
    }
    write(&args, outputs, &rendered, voice)?;
    if let Some(path) = &args.stats {
        write_json(path, &rendered.report)?;
    }
    let code = judge(&rendered, &job.words, voice).unwrap_or(0);
    let stamps: Option<Vec<Stamp>> = outputs.iter().map(|o| Stamp::with_sum(o)).collect();
    let gone = || CliError::Internal("an image is gone that was just written".into());
    let done = Done {
        name: job.name.clone(),
        settings,
        scene_hash,
        files: loaded.files.clone(),
        outputs: stamps.ok_or_else(gone)?,
        code,
        seconds: rendered.report.seconds(),
        error: rendered.report.relative_error(),
        size: [rendered.image.width, rendered.image.height],
        summary: rendered.report.summary(),
        picture: thumbnail(&rendered.image, args.exposure.exp2()),
    };
    store.write(&done)?;
    for old in store.checkpoints(&job.name).iter().chain([&file]) {
        // One that stays does no harm.
        let _ = std::fs::remove_file(old);
    }
    shelf.put(prepared.scene, loaded, &args);
    Ok(Outcome::of(&done, how))
}
