//! `metrolux job`: a render as a job of an engine that runs batches on many machines.
//!
//! What an engine is given is text: parts that share the render, each with a checkpoint, and the merge that waits for them.

mod openjd;
mod slurm;

use super::CliError;
use super::engine::Prepared;
use super::job::is_image;
use super::outlet::print;
use super::parse::{duration, parts};
use super::render_args::RenderArgs;
use super::study::parse;
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf, absolute};
use std::process::ExitCode;
use std::time::Duration;

/// Write a render as a job for a render farm or cluster.
///
/// The job renders the scene in parts, each with a checkpoint that it goes on from when it is stopped, and adds them up when
/// all are done: the image is that of one machine, bit for bit. The job is printed, not run.
#[derive(Args, Debug)]
pub struct FarmArgs {
    #[command(subcommand)]
    engine: Engine,
}

#[derive(Subcommand, Debug)]
enum Engine {
    /// A bash script that hands an array of parts and their merge to Slurm: metrolux job slurm SCENE > job.sh; bash job.sh
    Slurm(EngineArgs),
    /// A template of Open Job Description: metrolux job openjd SCENE > template.yaml
    Openjd(EngineArgs),
}

/// What every engine needs to know.
#[derive(Args, Debug)]
struct EngineArgs {
    /// pbrt-v4 scene file, where the machines find it too
    scene: PathBuf,
    /// Image to make in the job's folder, .exr or .png; may be given several times. SCENE.exr unless given
    #[arg(short, long, value_name = "NAME")]
    output: Vec<String>,
    /// Parts to share the render between
    #[arg(long, value_name = "N", default_value = "16", value_parser = parts)]
    shards: u32,
    /// Folder of all files of the job, which all machines see; SCENE.job unless given
    #[arg(long, value_name = "DIR")]
    dir: Option<PathBuf>,
    /// Name of the job; that of the scene unless given
    #[arg(long)]
    name: Option<String>,
    /// Cores of each part; what the engine gives if not said
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    cpus: Option<u32>,
    /// Longest time of a part at a stretch; then it writes its checkpoint and goes on in another run
    #[arg(long, value_name = "TIME", value_parser = duration)]
    time: Option<Duration>,
    /// Time between checkpoints
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "5m")]
    every: Duration,
    /// The program on the machines; this one unless given
    #[arg(long, value_name = "PATH")]
    metrolux: Option<PathBuf>,
    /// Options of `metrolux render`
    #[arg(last = true, value_name = "RENDER OPTIONS")]
    render: Vec<String>,
}

/// Runs the sub-command.
pub fn run(args: &FarmArgs) -> Result<ExitCode, CliError> {
    let text = match &args.engine {
        Engine::Slurm(a) => slurm::script(&Farm::new(a)?),
        Engine::Openjd(a) => openjd::template(&Farm::new(a)?)?,
    };
    print(text.trim_end_matches('\n'))?;
    Ok(ExitCode::SUCCESS)
}

/// A render in parts with every choice made. No text in it holds a control character, so none ends a line or a comment.
struct Farm {
    metrolux: String,
    scene: String,
    /// Where everything is kept; the names below are in it.
    dir: String,
    name: String,
    parts: u32,
    cpus: Option<u32>,
    time: Option<Duration>,
    /// Options of every part, besides those that name it.
    options: Vec<String>,
    /// Options of the merge, besides the parts.
    merge: Vec<String>,
}

impl Farm {
    /// Finds mistakes now rather than on every machine: the scene is loaded, the options are resolved.
    fn new(args: &EngineArgs) -> Result<Self, CliError> {
        let usage = |text: String| Err(CliError::Usage(text));
        let scene = text("the scene's path", &whole(&args.scene)?)?;
        let every = format!("{}s", args.every.as_secs_f64());
        let mut words = vec![scene.clone(), "--checkpoint=part.1.run".into()];
        words.extend(["--resume".into(), format!("--every={every}")]);
        words.extend([format!("--shard=1/{}", args.shards), "-opart.1".into()]);
        words.extend(args.render.iter().cloned());
        let render = parse(&words)?;
        let own = [
            (
                "--output: the job has -o of its own",
                render.output.len() > 1,
            ),
            ("--threads: the job has --cpus", render.threads.is_some()),
            (
                "--stats: the merge writes stats.json",
                render.stats.is_some(),
            ),
            ("--record-rays", render.record_rays.is_some()),
            (
                "--extend: parts of a job begin anew",
                !render.extend.is_empty(),
            ),
        ];
        if let Some((what, _)) = own.iter().find(|(_, given)| *given) {
            return usage(format!("cannot take after -- {what}"));
        }
        Prepared::new(&render)?;
        let stem = args.scene.file_stem().unwrap_or_default();
        let stem = text("the scene's name", Path::new(stem))?;
        let mut images = args.output.clone();
        if images.is_empty() {
            images.push(format!("{stem}.exr"));
        }
        for image in &images {
            let plain = Path::new(image)
                .file_name()
                .is_some_and(|n| n == image.as_str());
            if !plain || image.starts_with('-') || !is_image(Path::new(image)) {
                return usage(format!(
                    "cannot write {image:?} in the job's folder: expected a name that ends with .exr or .png, without a path"
                ));
            }
            text("an image's name", Path::new(image))?;
        }
        let exr = |name: &String| name.to_ascii_lowercase().ends_with(".exr");
        if render.spectral.is_some() && !images.iter().any(exr) {
            return usage("--spectral needs an EXR file: expected -o NAME.exr".into());
        }
        let dir = args.dir.clone().unwrap_or(format!("{stem}.job").into());
        let metrolux = match &args.metrolux {
            Some(path) => text("--metrolux", path)?,
            None => text(
                "the program's path",
                &std::env::current_exe().map_err(unknown)?,
            )?,
        };
        let mut options = vec![format!("--every={every}")];
        options.extend(args.render.iter().cloned());
        for option in &options {
            text("a render option", Path::new(option))?;
        }
        Ok(Self {
            metrolux,
            scene,
            dir: text("--dir", &absolute(dir).map_err(unknown)?)?,
            name: text("--name", Path::new(args.name.as_deref().unwrap_or(&stem)))?,
            parts: args.shards,
            cpus: args.cpus,
            time: args.time,
            options,
            merge: merge_options(&render, &images),
        })
    }
}

fn merge_options(render: &RenderArgs, images: &[String]) -> Vec<String> {
    let mut all: Vec<String> = images.iter().map(|i| format!("-o{i}")).collect();
    all.push("--stats=stats.json".into());
    if render.exposure != 0.0 {
        all.push(format!("--exposure={}", render.exposure));
    }
    if render.quiet {
        all.push("--quiet".into());
    }
    all
}

/// The absolute path of a file that is there.
fn whole(file: &Path) -> Result<PathBuf, CliError> {
    file.canonicalize()
        .map_err(|e| CliError::Usage(format!("cannot read {}: {e}", file.display())))
}

fn unknown(e: std::io::Error) -> CliError {
    CliError::Internal(format!("cannot tell where this is: {e}"))
}

/// A path or a word as text for a file that people and engines read.
fn text(what: &str, path: &Path) -> Result<String, CliError> {
    let readable = path
        .to_str()
        .filter(|s| !s.is_empty() && !s.contains(char::is_control));
    readable.map(str::to_owned).ok_or_else(|| {
        CliError::Usage(format!(
            "{what} is {path:?}: expected UTF-8 without control characters, for a job is a text"
        ))
    })
}
