//! `metrolux bench-accel`.

use super::CliError;
use super::outlet::tell;
use super::parse::positive;
use crate::accel::record::{self, Kind};
use crate::accel::{Embree, EmbreeOptions, Ray};
use crate::output::{check_writable, write_atomic};
use crate::scene::flatten::flatten;
use crate::scene::load::{LoadOptions, load_scene, load_str};
use crate::scene::{Geometry, Scene};
use crate::study::bench_accel::contender::Contender;
use crate::study::bench_accel::machine::Machine;
use crate::study::bench_accel::measure::{Clock, Patience};
use crate::study::bench_accel::report::Report;
use crate::study::bench_accel::sets::{RaySet, of_scene};
use crate::study::bench_accel::thicket::Thicket;
use crate::study::bench_accel::{BenchError, Plan, bench, peak_of_build, terrain};
use clap::Args;
use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

/// Compare Embree and obvhs on the same rays
///
/// Builds every contender over each scene and times it on camera rays, shadow rays, diffuse bounces and the rays that a
/// Metropolis render asks. Contenders take turns; the table gives medians, quartiles and the ratio to the first contender
/// within a turn. Run it on a machine that does nothing else.
#[derive(Args, Debug)]
pub struct BenchAccelArgs {
    /// pbrt-v4 scene files
    #[arg(required_unless_present_any = ["rays", "terrain", "thicket"])]
    pub scenes: Vec<PathBuf>,
    /// Rays of an earlier run (--save-rays, or render --record-rays); the file holds its geometry too
    #[arg(long, value_name = "FILE")]
    pub rays: Vec<PathBuf>,
    /// Hills of at least so many triangles, made on the spot, with random rays
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=200_000_000))]
    pub terrain: Vec<u32>,
    /// A scene of instances, made on the spot: an object of some 4·RINGS² triangles in so many places, GAP of its size apart
    #[arg(long, value_name = "PLACES,RINGS,GAP")]
    pub thicket: Vec<Thicket>,
    /// Write each set of rays with its geometry into this folder, as SCENE-SET.rays, for use in other engines
    #[arg(long, value_name = "DIR")]
    pub save_rays: Option<PathBuf>,
    /// Write bench-accel.json, bench-accel.csv and bench-accel.html into this folder
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Print JSON instead of the table
    #[arg(long)]
    pub json: bool,
    /// Who takes part: few, all, or keys from the table with commas between
    #[arg(long, value_name = "LIST", default_value = "few", value_parser = contenders)]
    pub contenders: std::sync::Arc<Vec<Contender>>,
    /// Numbers of threads with commas between; 1 and all cores if not given
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Vec<u16>,
    /// Rays of a set
    #[arg(long, value_name = "N", default_value_t = 1 << 18, value_parser = clap::value_parser!(u32).range(64..=100_000_000))]
    pub count: u32,
    /// Turns of each contender
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u16).range(1..))]
    pub turns: u16,
    /// Least milliseconds of a turn
    #[arg(long, value_name = "MS", default_value_t = 50.0, value_parser = positive)]
    pub least: f64,
    /// What time is measured by
    #[arg(long, value_enum, default_value = "wall")]
    pub clock: Clock,
    /// Build this contender once, print the bytes it takes at most, and do nothing else
    #[arg(long, value_name = "KEY", hide = true)]
    pub peak: Option<String>,
    /// Also time every contender over the scene with its object instances put into the world, as KEY-flat
    #[arg(long)]
    pub flatten: bool,
    /// Treat unsupported directives as warnings
    #[arg(long)]
    pub lenient: bool,
    /// No progress on stderr
    #[arg(short, long)]
    pub quiet: bool,
}

fn contenders(list: &str) -> Result<std::sync::Arc<Vec<Contender>>, String> {
    let chosen = match list {
        "few" => Contender::few(),
        "all" => Contender::all(),
        keys => keys
            .split(',')
            .map(|k| {
                Contender::by_key(k).ok_or_else(|| {
                    let all: Vec<String> = Contender::all().iter().map(Contender::key).collect();
                    format!(
                        "found “{k}”, expected few, all, or some of {}",
                        all.join(", ")
                    )
                })
            })
            .collect::<Result<_, _>>()?,
    };
    Ok(chosen.into())
}

/// A geometry with rays, from a scene or from a file.
struct Work {
    name: String,
    geometry: Geometry,
    /// Without instances, if that is wanted and there are any.
    flat: Option<Geometry>,
    sets: Vec<RaySet>,
}

/// Runs the sub-command.
pub fn run(args: &BenchAccelArgs, out: &mut dyn Write) -> Result<ExitCode, CliError> {
    if let Some(key) = &args.peak {
        return print_peak(args, key, out);
    }
    let files = ["json", "csv", "html"].map(|e| {
        let folder = args.output.as_ref()?;
        Some(folder.join(format!("bench-accel.{e}")))
    });
    for folder in args.output.iter().chain(&args.save_rays) {
        std::fs::create_dir_all(folder).map_err(|e| CliError::not_writable(folder, e))?;
        check_writable(&folder.join("bench-accel.json"))?;
    }
    let say = |line: String| {
        if !args.quiet {
            tell(format_args!("{line}"));
        }
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut threads: Vec<usize> = match args.threads.as_slice() {
        [] => vec![1, cores],
        some => some.iter().map(|t| *t as usize).collect(),
    };
    threads.sort_unstable();
    threads.dedup();
    let plan = Plan {
        contenders: args.contenders.to_vec(),
        threads,
        patience: Patience {
            clock: args.clock,
            turns: args.turns as usize,
            least: Duration::from_secs_f64(args.least * 1e-3),
        },
    };
    let none = Geometry::default();
    let embree = Embree::new(&none, EmbreeOptions::default())?;
    let mut report = Report {
        machine: Machine::here(embree.version(), embree.isa()),
        clock: args.clock,
        turns: plan.patience.turns,
        least_seconds: plan.patience.least.as_secs_f64(),
        builds: Vec::new(),
        speeds: Vec::new(),
    };
    let mut taken = BTreeSet::new();
    for input in inputs(args) {
        say(format!("{}: reading", input.name()));
        let mut work = input.read(args)?;
        work.name = untaken(work.name, &mut taken);
        if let Some(folder) = &args.save_rays {
            save(&work, folder)?;
        }
        let peak = |c: &Contender, threads, flat| measured_peak(args, &input, c, (threads, flat));
        bench(
            &work.name,
            (&work.geometry, work.flat.as_ref()),
            &work.sets,
            &plan,
            &mut report,
            &say,
            &peak,
        )
        .map_err(failed)?;
    }
    let json = serde_json::to_string_pretty(&report).expect("plain numbers");
    let texts = [json.clone(), report.csv(), report.page()];
    for (file, text) in files.iter().zip(&texts) {
        if let Some(file) = file {
            write_atomic(file, text.as_bytes())?;
        }
    }
    let shown = if args.json { json } else { report.table() };
    writeln!(out, "{shown}").map_err(|e| CliError::not_writable(Path::new("stdout"), e))?;
    Ok(ExitCode::SUCCESS)
}

fn failed(e: BenchError) -> CliError {
    match e {
        BenchError::Accel(e) => CliError::Accel(e),
        other => CliError::Internal(other.to_string()),
    }
}

/// What a build takes at most, in a process of its own whose allocator gives back at once what is freed.
fn measured_peak(
    args: &BenchAccelArgs,
    input: &Input,
    contender: &Contender,
    (threads, flat): (usize, bool),
) -> Option<u64> {
    let mut command = std::process::Command::new(std::env::current_exe().ok()?);
    command
        .env("MALLOC_MMAP_THRESHOLD_", "65536")
        .env("MALLOC_TRIM_THRESHOLD_", "0")
        .args(["bench-accel", "--quiet", "--peak", &contender.key()])
        .args(["--threads", &threads.to_string()])
        .args(args.lenient.then_some("--lenient"))
        .args(flat.then_some("--flatten"));
    match input {
        Input::Scene(path) => command.arg(path),
        Input::Rays(path) => command.arg("--rays").arg(path),
        Input::Terrain(n) => command.args(["--terrain", &n.to_string()]),
        Input::Thicket(t) => command.args(["--thicket", &t.to_string()]),
    };
    let out = command.output().ok()?;
    String::from_utf8(out.stdout).ok()?.trim().parse().ok()
}

/// The other side of [`measured_peak`].
fn print_peak(args: &BenchAccelArgs, key: &str, out: &mut dyn Write) -> Result<ExitCode, CliError> {
    let contender = Contender::by_key(key)
        .ok_or_else(|| CliError::Usage(format!("found “{key}”, expected a contender")))?;
    let input = inputs(args).next().expect("clap asks for one");
    let geometry = input.geometry(args)?;
    let threads = args.threads.first().map_or(1, |t| *t as usize);
    if let Some(bytes) = peak_of_build(&contender, &geometry, threads).map_err(failed)? {
        writeln!(out, "{bytes}").map_err(|e| CliError::not_writable(Path::new("stdout"), e))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A file's name without folder and ending.
fn stem(path: &Path) -> String {
    path.file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// A name that no other input has: two scenes may have files of one name.
fn untaken(name: String, taken: &mut BTreeSet<String>) -> String {
    let numbered = (2..).map(|n| format!("{name}-{n}"));
    let mut names = std::iter::once(name.clone()).chain(numbered);
    let free = names.find(|n| taken.insert(n.clone()));
    free.expect("numbers do not end")
}

/// Where geometry and rays come from.
enum Input<'a> {
    Scene(&'a Path),
    Rays(&'a Path),
    Terrain(u32),
    Thicket(Thicket),
}

fn inputs(args: &BenchAccelArgs) -> impl Iterator<Item = Input<'_>> {
    let scenes = args.scenes.iter().map(|p| Input::Scene(p));
    let rays = args.rays.iter().map(|p| Input::Rays(p));
    let terrains = args.terrain.iter().map(|n| Input::Terrain(*n));
    let thickets = args.thicket.iter().map(|t| Input::Thicket(*t));
    scenes.chain(rays).chain(terrains).chain(thickets)
}

/// Options of loading.
fn with(lenient: bool) -> LoadOptions {
    LoadOptions {
        lenient,
        ..LoadOptions::default()
    }
}

impl Input<'_> {
    fn name(&self) -> String {
        match self {
            Self::Scene(path) | Self::Rays(path) => stem(path),
            Self::Terrain(n) => format!("terrain-{n}"),
            Self::Thicket(t) => format!("thicket-{t}"),
        }
    }

    /// The geometry without rays.
    fn geometry(&self, args: &BenchAccelArgs) -> Result<Geometry, CliError> {
        let of = |mut scene: Scene| {
            if args.flatten {
                flatten(&mut scene, |_| true);
            }
            scene.geometry
        };
        Ok(match self {
            Self::Scene(path) => of(load_scene(path, &with(args.lenient))?),
            Self::Thicket(t) => of(load_str(&t.text(), Path::new(""), &with(false))?),
            Self::Rays(path) => read_rays(path)?.0,
            Self::Terrain(n) => terrain::terrain(*n as usize),
        })
    }

    fn read(&self, args: &BenchAccelArgs) -> Result<Work, CliError> {
        let count = args.count as usize;
        let mut flat = None;
        let mut of = |scene: Scene| {
            if args.flatten && !scene.geometry.instances.is_empty() {
                let mut copies = scene.clone();
                flatten(&mut copies, |_| true);
                flat = Some(copies.geometry);
            }
            let embree = Embree::new(&scene.geometry, EmbreeOptions::default())?;
            let sets = of_scene(&scene, &embree, count);
            drop(embree);
            Ok::<_, CliError>((scene.geometry, sets))
        };
        let (geometry, sets) = match self {
            Self::Scene(path) => of(load_scene(path, &with(args.lenient))?)?,
            Self::Thicket(t) => of(load_str(&t.text(), Path::new(""), &with(false))?)?,
            Self::Rays(path) => {
                let (geometry, rays) = read_rays(path)?;
                (geometry, RaySet::split("recorded", &rays))
            }
            Self::Terrain(n) => (terrain::terrain(*n as usize), terrain::rays(count)),
        };
        let name = self.name();
        if sets.is_empty() {
            return Err(CliError::Usage(format!("{name}: found no rays to trace")));
        }
        Ok(Work {
            name,
            geometry,
            flat,
            sets,
        })
    }
}

/// A ray file.
pub(super) fn read_rays(path: &Path) -> Result<(Geometry, Vec<(Ray, Kind)>), CliError> {
    let bad = |e: std::io::Error| CliError::Usage(format!("{}: {e}", path.display()));
    let file = std::fs::File::open(path).map_err(bad)?;
    record::read(std::io::BufReader::with_capacity(1 << 20, file)).map_err(bad)
}

/// One file a scene and set: rays of different sets must not mix.
fn save(work: &Work, folder: &Path) -> Result<(), CliError> {
    for set in &work.sets {
        let path = folder.join(format!("{}-{}.rays", work.name, set.title()));
        let rays: Vec<(Ray, Kind)> = set.rays.iter().map(|r| (*r, set.kind)).collect();
        let file = std::fs::File::create(&path).map_err(|e| CliError::not_writable(&path, e))?;
        record::write(std::io::BufWriter::new(file), &work.geometry, &[&rays])
            .map_err(|e| CliError::not_writable(&path, e))?;
    }
    Ok(())
}
