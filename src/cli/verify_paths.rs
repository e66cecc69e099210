//! `metrolux verify --keep-steps` and `--against`: steps of one build made again in the numbers of another.

use super::CliError;
use super::engine::Prepared;
use super::identity::machine;
use super::inspect::{self, Work};
use super::keep::bad;
use super::render_args::RenderArgs;
use super::replay::quoted;
use crate::accel::Asked;
use crate::chain::{Found, KINDS, Kind, Setting, Specimens, WIDTH};
use crate::film::{Malformed, Reader};
use crate::output::{RunFile, write_run};
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::path::Path;

/// What the steps are of: all that the numbers of a path are a function of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Label {
    scene: String,
    resolution: [u32; 2],
    region: [u32; 4],
    max_depth: u32,
    lanes: usize,
    target: String,
    /// Effects forced and left out.
    plan: String,
    /// Wavelength of a scene without colour, nm.
    grey: Option<u32>,
    seed: u64,
    /// Bytes of a coordinate, and what the writer was compiled for.
    bytes: u8,
    machine: String,
}

impl Label {
    fn new(args: &RenderArgs, prepared: &Prepared) -> Self {
        let (scene, job) = (&prepared.scene, &prepared.job);
        Self {
            scene: format!("{:016x}", scene.hash),
            resolution: scene.camera.resolution,
            region: scene.camera.crop,
            max_depth: scene.settings.max_depth,
            lanes: job.plan.lanes,
            target: format!("{:?}", job.target),
            plan: format!("{:?} {:?}", args.effects.force, args.effects.without),
            grey: job.plan.grey.as_ref().map(|g| g.1.lambda as u32),
            seed: args.seed,
            bytes: WIDTH,
            machine: machine(),
        }
    }

    fn name(bytes: u8) -> &'static str {
        if bytes == 8 { "f64" } else { "f32" }
    }
}

/// Writes the steps that the groups kept.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    file: &Path,
    args: &RenderArgs,
    prepared: &Prepared,
    groups: &[Vec<u8>],
) -> Result<(), CliError> {
    let label = serde_json::to_string(&Label::new(args, prepared)).unwrap_or_default();
    write_run(file, &label, &mut |w| {
        groups.iter().try_for_each(|g| w.bytes(g))
    })?;
    Ok(())
}

/// Makes the steps of a file again. The findings, and whether none lies beyond its bound.
///
/// # Errors
/// A file that holds something else, or steps of another scene or other settings.
pub fn against(
    file: &Path,
    args: &RenderArgs,
    prepared: &Prepared,
) -> Result<(String, bool), CliError> {
    let read = RunFile::read(file)?;
    let label: Label = serde_json::from_str(read.label())
        .map_err(|_| bad(file, "holds no steps kept by `verify --keep-steps`".into()))?;
    let here = Label::new(args, prepared);
    let same = Label {
        bytes: here.bytes,
        machine: here.machine.clone(),
        ..label.clone()
    };
    if same != here {
        return Err(bad(
            file,
            format!("is of another render:\n{same:?} there\n{here:?} here"),
        ));
    }
    let accel = inspect::backend(args, &prepared.scene)?;
    let work = Against {
        bytes: label.bytes,
        steps: read.run(),
    };
    let found = inspect::work_on(args, prepared, accel.as_ref(), work)?;
    let mut s = found.map_err(|e| bad(file, e.0))?;
    let text = text(&mut s, &label, &here, &settings(super::parse::words()));
    Ok((text, s.over_bound <= 1.0))
}

/// Compares.
pub struct Against<'a> {
    bytes: u8,
    steps: Reader<'a>,
}

impl Work for Against<'_> {
    type Out = Result<Specimens, Malformed>;

    fn run<const N: usize>(mut self, set: &Setting<Asked>, _seed: u64) -> Self::Out {
        Specimens::read::<N, _>(set, self.bytes, &mut self.steps)
    }
}

/// The words after the name of this command without the file of steps: the settings of the render.
fn settings(words: impl Iterator<Item = String>) -> String {
    let mut words = words.skip(2);
    let mut left = Vec::new();
    while let Some(word) = words.next() {
        match word.as_str() {
            "--against" => drop(words.next()),
            w if w.starts_with("--against=") => {}
            w => left.push(quoted(w)),
        }
    }
    left.join(" ")
}

/// The command that shows the step, in the build that kept it.
fn replay(at: &Found, settings: &str) -> String {
    format!(
        "path {} of: metrolux replay {settings} --group {} --chain 0 --step {}",
        if at.proposal { "y" } else { "x" },
        at.group,
        at.step,
    )
}

fn text(s: &mut Specimens, there: &Label, here: &Label, settings: &str) -> String {
    let mut t = format!(
        "{} steps of {} ({}) made again in {} ({})\n\n{:<23}{:>9}{:>11}{:>11}{:>11}{:>9}\n",
        s.steps,
        Label::name(there.bytes),
        there.machine,
        Label::name(here.bytes),
        here.machine,
        "deviation of",
        "values",
        "median",
        "99 %",
        "largest",
        "0 in one"
    );
    for (kind, name) in KINDS {
        let i = kind as usize;
        let n = s.deviations[i].len();
        let (half, most) = (s.quantile(kind, 0.5), s.quantile(kind, 0.99));
        let (largest, lost) = (s.largest[i], s.lost[i]);
        let pad = 23 - name.chars().count();
        let _ = writeln!(
            t,
            "{name}{:pad$}{n:>9}{half:>11.1e}{most:>11.1e}{largest:>11.1e}{lost:>9}",
            ""
        );
    }
    let mark = if s.over_bound <= 1.0 {
        ""
    } else {
        "   <-- beyond its bound"
    };
    let _ = write!(
        t,
        "\nG: {:.3} at most of what roundings of f32 explain{mark}; of {} edges f32 does not resolve {}\n\
         paths that carry no light here: {}\n",
        s.over_bound, s.edges, s.unresolved, s.dark
    );
    let worst = [Kind::Contribution, Kind::Ratio];
    for (kind, name) in KINDS.iter().filter(|k| worst.contains(&k.0)) {
        let at = &s.worst[*kind as usize];
        let _ = writeln!(t, "{name} deviates most in {}", replay(at, settings));
    }
    if s.over_bound > 1.0 {
        let _ = writeln!(
            t,
            "G is beyond its bound in {}",
            replay(&s.over_bound_at, settings)
        );
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_shown_with_the_settings_of_its_render() {
        let words = "metrolux verify a.pbrt --against b.steps --seed 3";
        let at = Found {
            group: 2,
            step: 7,
            proposal: true,
        };
        assert_eq!(
            replay(&at, &settings(words.split(' ').map(str::to_owned))),
            "path y of: metrolux replay a.pbrt --seed 3 --group 2 --chain 0 --step 7"
        );
        let words = ["metrolux", "verify", "--against=b", "a b.pbrt"];
        assert_eq!(settings(words.map(str::to_owned).into_iter()), "'a b.pbrt'");
    }
}
