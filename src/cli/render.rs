//! `metrolux render`.

use super::distinct::{Files, each, refuse_shared};
use super::engine::{self, Prepared, Rendered, is_png};
use super::keep::{Ended, Keep};
use super::preview::Preview;
use super::render_args::RenderArgs;
use super::signals::Signals;
use super::voice::{Level, Voice};
use super::{CliError, replay, report};
use crate::plan::Strategy;
use crate::scene::IntegratorKind;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Runs the sub-command.
pub fn run(args: &RenderArgs) -> Result<ExitCode, CliError> {
    let voice = Voice::new(&args.voice, args.quiet)?;
    Ok(voice.conclude(work(args, &voice)))
}

fn work(args: &RenderArgs, voice: &Voice) -> Result<u8, CliError> {
    let prepared = Prepared::new(args)?;
    announce(args, &prepared, voice);
    let outputs = &prepared.job.outputs;
    let written = written(args, outputs);
    refuse_shared(
        &written,
        &each("the scene", &prepared.scene.files).collect(),
    )?;
    for (_, o) in &written {
        crate::output::check_writable(o)?;
    }
    let signals = Signals::catch()?;
    let mut keep = Keep::new(args, outputs, &signals, voice)?;
    keep.preview = args.preview.as_ref().map(|to| {
        let name = outputs[0].display().to_string();
        let camera = &prepared.scene.camera;
        let [x, y, ..] = camera.crop;
        Preview::new(to, &name, camera.resolution, [x, y])
    });
    let shown = voice.shown("rendering");
    let rendered = engine::render_watched(args, &prepared, &shown, &mut keep);
    let finished = keep.ended == Ended::Finished;
    shown.finish(rendered.is_ok() && finished);
    let mut rendered = rendered?;
    let unsaved = rendered.unsaved.take();
    let preview = keep.preview.take();
    // A checkpoint that could not be written must not take the image with it.
    let kept = keep.result();
    let begun = rendered.report.begun() || finished;
    let ended = kept.as_ref().copied().unwrap_or(Ended::Finished);
    let stopped = stopped(args, ended, begun, voice);
    let (mut file, mut written) = (None, Ok(()));
    // A part is written where it is known whether it is whole; the image of a render that goes on later is not.
    // Nor is one that has not begun: it would be black, in the place of what may be there.
    if args.shard.is_none() && begun && !(stopped.is_some() && args.checkpoint.is_some()) {
        written = write(args, outputs, &rendered, voice);
        file = outputs.iter().find(|o| !is_png(o));
    }
    if let Some(preview) = preview {
        preview.finish(voice, rendered.image.clone(), file.map(PathBuf::as_path));
    }
    if let Some(path) = &args.stats {
        report::write_json(path, &rendered.report)?;
    }
    kept?;
    written?;
    if let Some(e) = unsaved {
        return Err(e);
    }
    let words: Vec<String> = super::parse::words().skip(2).collect();
    let wrong = judge(&rendered, &words, voice);
    Ok(wrong.or(stopped).unwrap_or(0))
}

/// What a render writes, but for its log.
pub fn written<'a>(args: &'a RenderArgs, outputs: &'a [PathBuf]) -> Files<'a> {
    each("--output", outputs)
        .chain(each("--stats", &args.stats))
        .chain(each("--checkpoint", &args.checkpoint))
        .chain(each("--record-rays", &args.record_rays))
        .collect()
}

/// Files by names that can be told, whatever bytes they are of.
pub fn names(files: &[PathBuf]) -> Vec<String> {
    files.iter().map(|f| f.display().to_string()).collect()
}

/// Tells what will be done.
pub fn announce(args: &RenderArgs, prepared: &Prepared, voice: &Voice) {
    let Prepared { scene, job, loaded } = prepared;
    let integrator = format!("{:?}", job.integrator).to_lowercase();
    voice.event(
        "start",
        &json!({
            "version": env!("CARGO_PKG_VERSION"),
            "scene": args.scene.display().to_string(),
            "scene_hash": format!("{:016x}", scene.hash),
            "load_seconds": loaded.as_secs_f64(),
            "integrator": integrator,
            "seed": args.seed,
            "resolution": scene.camera.resolution,
            "region": scene.camera.crop,
            "outputs": names(&job.outputs),
        }),
    );
    let chains = job.integrator == IntegratorKind::Mlt;
    let wrongs = job.plan.wrongs();
    let all = scene.warnings.iter().chain(&wrongs);
    all.for_each(|w| voice.say(Level::Warning, w));
    voice.say(Level::Note, &job.plan.short(chains));
    let on = job.plan.findings.iter().filter(|f| f.verdict.on());
    let effects: Vec<_> = on.map(|f| f.effect).collect();
    let shared = |s: &Strategy| (chains && job.plan.shares.get(*s) > 0.0).then(|| s.name());
    let strategies: Vec<_> = Strategy::ALL.iter().filter_map(shared).collect();
    let lanes = job.plan.lanes;
    voice.event(
        "plan",
        &json!({ "effects": effects, "lanes": lanes, "strategies": strategies }),
    );
}

/// Writes the images, all that can be.
///
/// # Errors
/// The first file that cannot be written.
pub fn write(
    args: &RenderArgs,
    outputs: &[impl AsRef<Path>],
    rendered: &Rendered,
    voice: &Voice,
) -> Result<(), CliError> {
    let mut all = Ok(());
    for o in outputs {
        let o = o.as_ref();
        match rendered.write(o, args.exposure) {
            Ok(()) => voice.event("written", &json!({ "file": o.display().to_string() })),
            Err(e) => all = all.and(Err(e)),
        }
    }
    all
}

/// Tells what was rendered by the command with these words, and gives the exit code if something in it must not be.
pub fn judge(rendered: &Rendered, words: &[String], voice: &Voice) -> Option<u8> {
    let report = &rendered.report;
    voice.event("counters", report);
    voice.say(Level::Note, &report.summary());
    if let Some(line) = report.error_line() {
        voice.say(Level::Note, &line);
    }
    let mut wrong = false;
    if let Some(found) = report.disagreement() {
        wrong = found.wrong() > 0;
        for line in found.lines() {
            if wrong {
                voice.insist(Level::Note, &line);
            } else {
                voice.say(Level::Note, &line);
            }
        }
        if wrong {
            let text = "a backend missed a primitive or named one that is not there";
            voice.say(Level::Error, text);
        }
    }
    let impossible = report.faults_impossible();
    if impossible > 0 {
        let text =
            format!("{impossible} impossible values were met; see the fault counters in the stats");
        voice.say(Level::Error, &text);
        for site in report.fault_sites() {
            voice.insist(Level::Note, &replay::told(site, words));
        }
    }
    (wrong || impossible > 0).then_some(3)
}

/// The exit code of a render that a signal stopped, with a line that says what there is.
fn stopped(args: &RenderArgs, ended: Ended, begun: bool, voice: &Voice) -> Option<u8> {
    let Ended::Stopped(signal) = ended else {
        return None;
    };
    let (what, code) = match (&args.checkpoint, args.shard) {
        (Some(file), _) => (format!("--resume goes on from {}", file.display()), 75),
        (None, Some(_)) => ("nothing was written".into(), 128 + signal),
        (None, None) if begun => ("the image so far was written".into(), 128 + signal),
        (None, None) => ("there is no image yet".into(), 128 + signal),
    };
    voice.insist(Level::Note, &format!("stopped by a signal: {what}"));
    Some(code as u8)
}
