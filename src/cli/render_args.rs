//! What `metrolux render` takes.

use super::layers::LayerArg;
use super::parse::{duration, positive, region, size};
use super::preview::{ViewerArg, viewer};
use crate::chain::Shares;
use crate::scene::load::{LoadOptions, Setting};
use clap::{Args, FromArgMatches, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

/// Integrators by name.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum IntegratorArg {
    /// Metropolis light transport
    Mlt,
    /// Bidirectional path tracing
    Bdpt,
    /// Path tracing
    Pt,
}

/// Backends by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AccelArg {
    /// Intel Embree
    Embree,
    /// The pure-Rust obvhs
    Obvhs,
    /// Embree, each of its answers compared with obvhs'
    Checked,
}

/// Number of wavelengths a path carries.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum LanesArg {
    /// 1 in a scene without colour, else 4
    Auto,
    /// One wavelength
    #[value(name = "1")]
    One,
    /// Four wavelengths
    #[value(name = "4")]
    Four,
    /// Eight wavelengths
    #[value(name = "8")]
    Eight,
    /// Sixteen wavelengths
    #[value(name = "16")]
    Sixteen,
}

impl LanesArg {
    /// The number; `None` where the plan chooses.
    pub fn count(self) -> Option<usize> {
        match self {
            Self::Auto => None,
            Self::One => Some(1),
            Self::Four => Some(4),
            Self::Eight => Some(8),
            Self::Sixteen => Some(16),
        }
    }
}

/// Who computes direct light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DirectArg {
    /// Whoever a look at the scene says does it with less noise
    Auto,
    /// A separate pass of stratified sampling
    Separate,
    /// The Markov chain
    Chain,
}

/// Whether a coarse image evens out the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TwoStageArg {
    /// Where a look at the scene says that its dark parts gain by it
    Auto,
    /// Always
    On,
    /// Never
    Off,
}

/// The target of a chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TargetArg {
    /// Luminance alone, as in Veach's text
    Luminance,
    /// Luminance with a part of X and Z, and a floor under the bins of --spectral
    Mixed,
}

/// How chains are seeded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum MltArg {
    /// 16 chains in each of 16 groups, from seeds that are weighted against start-up bias
    #[default]
    Full,
    /// One chain in each group, from one weighted seed (n' = 1)
    Plain,
    /// One chain in each group, from the first path found: the image is known but for a factor, and its mean is 1
    Relative,
}

/// Render a scene to EXR and PNG.
///
/// Settings come from the command line, else from the scene file's Film, Integrator and Sampler, else from defaults.
#[derive(Args, Clone, Debug)]
pub struct RenderArgs {
    /// pbrt-v4 scene file
    pub scene: PathBuf,
    /// File to write, .exr or .png; may be given several times
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// How light is found
    #[arg(long, value_enum)]
    pub integrator: Option<IntegratorArg>,
    /// Who answers rays
    #[arg(long, value_enum, default_value = "embree")]
    pub accel: AccelArg,
    /// Mutations per pixel (mlt)
    #[arg(long, value_name = "N", value_parser = positive, conflicts_with_all = ["time_limit", "rounds"])]
    pub mutations: Option<f64>,
    /// Samples per pixel (pt, bdpt)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), conflicts_with_all = ["time_limit", "rounds", "mutations"])]
    pub spp: Option<u32>,
    /// Stop after this much wall time: 30s, 10m, 2h
    #[arg(long, value_name = "TIME", value_parser = duration, conflicts_with = "rounds")]
    pub time_limit: Option<Duration>,
    /// Stop when the image's relative error is estimated to be at most E: 0.05 for 5 %
    ///
    /// The error is √(mean over the pixels of their squared standard error) / mean luminance. It is looked at only when
    /// the rounds (samples per pixel with pt and bdpt, from 16 on) have doubled: 1, 2, 4, 8 …, so that looking does not
    /// choose a lucky moment. --time-limit, --mutations, --spp or --rounds stop the render earlier; without any of them
    /// it goes on until the target is met. Either way the exit code is 0, and a message says which it was; --rounds with
    /// the number of rounds told there makes the same image.
    #[arg(long, value_name = "E", value_parser = positive)]
    pub target_error: Option<f64>,
    /// Make exactly this many rounds; stats.json tells how many a time limit allowed
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u64).range(1..))]
    pub rounds: Option<u64>,
    /// Keep a checkpoint here, from which --resume goes on to the same image, bit for bit
    ///
    /// It is written every --every, when the render ends, and on INT and TERM, which stop it with exit code 75; on HUP
    /// it is written, with the image so far, and the render goes on. A file that is there already needs --resume.
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    /// Time between checkpoints
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "5m", requires = "checkpoint")]
    pub every: Duration,
    /// Go on from the checkpoint if it is there; with =require it must be
    #[arg(long, value_enum, num_args = 0..=1, require_equals = true, default_missing_value = "if-there", requires = "checkpoint")]
    pub resume: Option<ResumeArg>,
    /// Go on from these finished checkpoints or parts, to more mutations or samples than they have
    ///
    /// The image is that of one longer render, bit for bit. All parts of a render must be named, or with --shard that
    /// part alone.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub extend: Vec<PathBuf>,
    /// Do only part K of N and write it to -o PART, for `metrolux merge`
    ///
    /// Any N gives the same image, bit for bit. With more than 256 parts some have no chains.
    #[arg(long, value_name = "K/N", value_parser = super::parse::shard, conflicts_with_all = ["time_limit", "target_error"])]
    pub shard: Option<(u32, u32)>,
    /// Same seed, same bits, whatever the number of threads
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Worker threads; one per core if not given
    #[arg(long, value_name = "N", value_parser = super::parse::threads)]
    pub threads: Option<usize>,
    /// Image size in pixels
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub resolution: Option<[u32; 2]>,
    /// Render only these pixels (x1, y1 excluded)
    #[arg(long, value_name = "x0,y0,x1,y1", value_parser = region)]
    pub region: Option<[u32; 4]>,
    /// Most scattering events on a path
    #[arg(long, value_name = "D")]
    pub max_depth: Option<u32>,
    /// Wavelengths carried by a path
    #[arg(long, value_enum, default_value = "auto")]
    pub lanes: LanesArg,
    /// Who computes direct light (mlt)
    #[arg(long, value_enum, default_value = "auto")]
    pub direct: DirectArg,
    /// Even out samples between bright and dark pixels by a coarse image rendered first (mlt); without a value: on
    #[arg(long, value_enum, default_value = "auto", num_args = 0..=1, require_equals = true, default_missing_value = "on")]
    pub two_stage: TwoStageArg,
    /// Also write this many spectral bins over 360–830 nm into EXR files
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=128))]
    pub spectral: Option<u32>,
    /// What a chain's visits are proportional to (mlt); mixed unless given
    #[arg(long, value_enum)]
    pub target: Option<TargetArg>,
    /// How the chains are seeded (mlt)
    #[arg(long, value_enum, default_value = "full")]
    pub mlt: MltArg,
    /// Shares of the mutation strategies (mlt), as bidirectional=0.5,lens=0.3,caustic=0.1,multichain=0.1,lenssubpath=0.1,wavelength=0.05
    ///
    /// Relative to each other; 0 removes a strategy, and so does not naming it (wavelength then has 5 %). Bidirectional
    /// must be > 0. By default a pilot whose image is thrown away fixes them before the first mutation, each above a floor,
    /// with caustic and multichain only where the scene calls for them.
    #[arg(long, value_name = "STRATEGY=SHARE,…", value_parser = super::mutate::shares)]
    pub mutate: Option<Shares>,
    /// Effects to force or to leave out
    #[command(flatten)]
    pub effects: super::plan::EffectArgs,
    /// Layers to add to EXR files, for compositing
    ///
    /// albedo, normal and depth are of what camera rays hit first. direct is what the separate pass of direct light makes and
    /// indirect the rest (mlt); asking for them asks for --direct separate.
    #[arg(long, value_enum, value_name = "LAYER,…", value_delimiter = ',')]
    pub layers: Vec<LayerArg>,
    /// Show the image in a viewer while it is rendered: tev, on this machine unless HOST is given
    #[arg(long, value_name = "tev[:HOST[:PORT]]", value_parser = viewer, conflicts_with = "shard")]
    pub preview: Option<ViewerArg>,
    /// Exposure of PNG files in stops
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = super::parse::stops)]
    pub exposure: f32,
    /// Treat unsupported directives as warnings
    #[arg(long)]
    pub lenient: bool,
    /// Change the scene: 'camera="float fov" 30' sets a parameter, 'view=LookAt …' moves the camera; may be given several
    /// times
    ///
    /// TEXT is as in a scene file. Targets are view (all transforms before Camera), camera, film, filter, sampler,
    /// integrator, material NAME, texture NAME, and light N and arealight N for the Nth LightSource and AreaLightSource.
    #[arg(long, value_name = "TARGET=TEXT", value_parser = Setting::parse)]
    pub set: Vec<Setting>,
    /// Embree's precision; fast may let a ray through an edge
    #[arg(long, value_enum, default_value = "robust")]
    pub accel_precision: PrecisionArg,
    /// Write counters and timings as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Write the rays traced to a file that `cargo bench --bench rays` replays
    #[arg(long, value_name = "FILE", hide = true)]
    pub record_rays: Option<PathBuf>,
    #[command(flatten)]
    pub tuning: super::tuning::Tuning,
    #[command(flatten)]
    pub voice: super::voice::VoiceArgs,
    /// No progress bar, no messages but errors
    #[arg(short, long)]
    pub quiet: bool,
}

fn command() -> clap::Command {
    RenderArgs::augment_args(clap::Command::new("metrolux render").no_binary_name(true))
}

/// Arguments as the command line would give them.
///
/// # Errors
/// What clap says of them.
pub fn parse(words: &[String]) -> Result<RenderArgs, clap::Error> {
    let matches = command().try_get_matches_from(words)?;
    RenderArgs::from_arg_matches(&matches)
}

/// The long names of all options, hidden ones too.
pub fn long_names() -> Vec<String> {
    let command = command();
    let all = command.get_arguments().filter_map(clap::Arg::get_long);
    all.map(str::to_owned).collect()
}

impl RenderArgs {
    /// Who computes direct light: what is to be told apart must be computed apart.
    pub fn direct(&self) -> DirectArg {
        if self.layers.iter().any(|l| l.is_of_transport()) && self.direct == DirectArg::Auto {
            return DirectArg::Separate;
        }
        self.direct
    }

    /// How the scene is to be read.
    pub fn load_options(&self) -> LoadOptions {
        LoadOptions {
            lenient: self.lenient,
            settings: self.set.clone(),
        }
    }
}

/// What to do without a checkpoint to go on from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ResumeArg {
    /// Begin
    IfThere,
    /// Stop
    Require,
}

/// Embree's ray-triangle precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PrecisionArg {
    /// Watertight
    Robust,
    /// Faster
    Fast,
}
