//! `metrolux merge`.

use super::CliError;
use super::distinct::{each, refuse_shared};
use super::engine::Rendered;
use super::identity::Identity;
use super::job::is_image;
use super::keep::{bad, list, read_run, refuse_others, understand};
use super::lab::{GreyBins, Lab};
use super::layers::Separation;
use super::render::names;
use super::report::{Report, write_json};
use super::voice::{Level, Voice, VoiceArgs};
use crate::chain::Shares;
use crate::film::Bins;
use crate::integrator::{Progress, State};
use crate::mutation::Strategy;
use crate::output::{RunFile, check_writable, write_run};
use crate::scene::spectrum::Target;
use crate::study::process::processor_seconds;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Add up the parts of a render that machines shared.
///
/// All parts together make the image that one machine would have made, bit for bit, in whatever order they are named.
#[derive(Args, Debug)]
pub struct MergeArgs {
    /// Parts that `render --shard K/N` wrote
    #[arg(required = true, value_name = "PART")]
    pub parts: Vec<PathBuf>,
    /// File to write, .exr or .png; may be given several times
    #[arg(
        short,
        long,
        value_name = "FILE",
        required_unless_present = "checkpoint"
    )]
    pub output: Vec<PathBuf>,
    /// Also write a checkpoint of the whole render, for `render --extend`
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    /// Make an image of the parts that are there; it is unbiased, and noisier
    #[arg(long)]
    pub allow_missing: bool,
    /// Exposure of PNG files in stops
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = super::parse::stops)]
    pub exposure: f32,
    /// Write counters as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    #[command(flatten)]
    pub voice: VoiceArgs,
    /// No messages but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Runs the sub-command.
pub fn run(args: &MergeArgs) -> Result<ExitCode, CliError> {
    let voice = Voice::new(&args.voice, args.quiet)?;
    Ok(voice.conclude(work(args, &voice)))
}

fn work(args: &MergeArgs, voice: &Voice) -> Result<u8, CliError> {
    let start = Instant::now();
    for o in &args.output {
        if !is_image(o) {
            let text = format!("cannot write {}: expected .exr or .png", o.display());
            return Err(CliError::Usage(text));
        }
    }
    if let Some(file) = args.checkpoint.as_ref().filter(|f| f.exists()) {
        let text = format!("{}: is there already", file.display());
        return Err(CliError::Usage(text));
    }
    let written = each("--output", &args.output)
        .chain(each("--checkpoint", &args.checkpoint))
        .chain(each("--stats", &args.stats))
        .collect();
    refuse_shared(&written, &each("a part", &args.parts).collect())?;
    for (_, o) in &written {
        check_writable(o)?;
    }
    let told = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "parts": names(&args.parts),
        "outputs": names(&args.output),
    });
    voice.event("start", &told);
    let (identity, mut state) = add_up(args, voice)?;
    // A file that cannot be written must not take the others with it.
    let saved = args.checkpoint.as_ref().map_or(Ok(()), |file| {
        write_run(file, &identity.label(), &mut |w| state.save(w)).map_err(CliError::from)
    });
    let rendered = picture(&identity, &mut state, start).map_err(|e| bad(&args.parts[0], e))?;
    let mut written = saved;
    for o in &args.output {
        match rendered.write(o, args.exposure) {
            Ok(()) => voice.event("written", &json!({ "file": o.display().to_string() })),
            Err(e) => written = written.and(Err(e)),
        }
    }
    written?;
    if let Some(path) = &args.stats {
        write_json(path, &rendered.report)?;
    }
    voice.event("counters", &rendered.report);
    let parts = args.parts.len();
    voice.say(
        Level::Note,
        &format!("{parts} parts, {} rounds", state.rounds()),
    );
    if let Some(line) = rendered.report.error_line() {
        voice.say(Level::Note, &line);
    }
    let impossible = rendered.report.faults_impossible();
    if impossible > 0 {
        let text = format!("{impossible} impossible values were met in the parts");
        voice.say(Level::Error, &text);
        return Ok(3);
    }
    Ok(0)
}

/// Reads all parts, one in memory at a time beside the sum.
fn add_up(args: &MergeArgs, voice: &Voice) -> Result<(Identity, State), CliError> {
    let (first, others) = args.parts.split_first().expect("clap asks for one");
    let shown = voice.shown("merging");
    let (identity, mut sum) = read_run(first)?;
    for (i, file) in others.iter().enumerate() {
        shown.update((i + 1) as f64 / args.parts.len() as f64);
        let (found, state) = read_run(file)?;
        refuse_others(file, &found, &identity)?;
        sum.merge(state).map_err(|e| bad(file, e.0))?;
    }
    shown.finish(true);
    let missing: Vec<u32> = sum.shards().missing().collect();
    if !missing.is_empty() {
        let (names, of) = (list(missing.iter().copied()), sum.shards().of());
        let text = format!("parts {names} of {of} are missing");
        if !args.allow_missing {
            return Err(CliError::Usage(format!(
                "{text}; --allow-missing makes a noisier image without them"
            )));
        }
        if args.checkpoint.is_some() {
            return Err(CliError::Usage(format!(
                "{text}: --checkpoint is for a whole render"
            )));
        }
        voice.insist(Level::Warning, &text);
    }
    Ok((identity, sum))
}

/// Whether the bytes of one part have a picture: all that `merge` does with them, but for the writing. It is there for the
/// fuzz target.
///
/// # Errors
/// What `merge` says of such a file.
pub fn is_part(bytes: Vec<u8>) -> Result<(), String> {
    let file = RunFile::of_bytes(bytes).map_err(|e| e.0)?;
    let (identity, mut state) = understand(&file)?;
    picture(&identity, &mut state, Instant::now()).map(drop)
}

/// The picture of a render that was done elsewhere.
fn picture(identity: &Identity, state: &mut State, start: Instant) -> Result<Rendered, String> {
    let lab = lab(identity, start)?;
    let tally = state.whole_tally();
    Ok(lab.develop(state.outcome(), &tally))
}

/// What makes that picture.
fn lab(i: &Identity, start: Instant) -> Result<Lab, String> {
    let number = |s: &String| {
        let found = s.parse::<f64>().ok().filter(|v| v.is_finite());
        found.ok_or_else(|| format!("has a label with “{s}” for a number"))
    };
    let numbers = |all: &[String]| all.iter().map(number).collect::<Result<Vec<f64>, _>>();
    let chains = i.chains.as_ref();
    let target = match chains.map(|c| c.target.as_str()) {
        Some("luminance") => Target::Luminance,
        Some("bins") => Target::Bins,
        _ => Target::Mixed,
    };
    let mut shares = Shares([0.0; Strategy::ALL.len()]);
    if let Some(c) = chains {
        let found = numbers(&c.mutate)?;
        shares.0 = found
            .try_into()
            .map_err(|f: Vec<f64>| format!("has a label with {} shares", f.len()))?;
    }
    let grey = i.illuminant.as_deref().map(numbers).transpose()?;
    Ok(Lab {
        report: Report::of(i),
        shares,
        target,
        bins: i.spectral.map(Bins::new),
        grey: grey.map(GreyBins),
        target_error: None,
        layers: Separation::default(),
        scale: number(&i.film_scale)?,
        begun: (start, processor_seconds()),
    })
}
