//! `metrolux verify`: chains with everything recomputed from scratch, every ray asked of both backends; and their steps in
//! numbers of another precision.

use super::CliError;
use super::engine::Prepared;
use super::inspect::{self, Work};
use super::outlet::tell;
use super::render_args::RenderArgs;
use super::verify_paths;
use super::while_running;
use crate::accel::checked::Disagreement;
use crate::accel::{Asked, Checked, Embree, Obvhs};
use crate::chain::{Deviations, Setting, Which, Witness, chain_again, keep, step_seen, verify};
use crate::film::Writer;
use crate::path::Tally;
use clap::Args;
use rayon::prelude::*;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Run chains with everything recomputed from scratch and every ray asked of two backends.
///
/// Takes the settings of a render; how long that is to last makes no difference, and both backends are asked whatever --accel
/// says. Ends with exit code 3 if something lies beyond its bound.
///
/// What f32 does to the paths of a scene is told by two builds: --keep-steps writes the steps with every quantity of their paths,
/// --against, in a build with `--features double` and with the same settings, makes the paths again in f64 and prints by how
/// much each quantity deviates.
#[derive(Args, Debug)]
pub struct VerifyArgs {
    #[command(flatten)]
    render: RenderArgs,
    /// Steps of each of 16 chains, one of every group
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..))]
    steps: u64,
    /// Also write the steps to this file, for --against in another build
    #[arg(long, value_name = "FILE", conflicts_with = "against")]
    keep_steps: Option<PathBuf>,
    /// Instead make the steps in this file again in the numbers of this build, and print what deviates by how much
    #[arg(long, value_name = "FILE", conflicts_with = "steps")]
    against: Option<PathBuf>,
}

/// Runs the sub-command.
pub fn run(args: &VerifyArgs, out: &mut impl Write) -> Result<ExitCode, CliError> {
    while_running::refuse(&args.render, "verify")?;
    let prepared = Prepared::new(&args.render)?;
    if let Some(file) = &args.against {
        let (text, fine) = verify_paths::against(file, &args.render, &prepared)?;
        print(out, &text)?;
        return Ok(ExitCode::from(if fine { 0 } else { 3 }));
    }
    let geometry = &prepared.scene.geometry;
    let embree = Embree::new(geometry, inspect::embree_options(&args.render))?;
    let both = Checked::new(embree, Obvhs::new(geometry));
    let work = Steps {
        steps: args.steps,
        keep: args.keep_steps.is_some(),
    };
    let (d, kept) = inspect::work_on(&args.render, &prepared, &both, work)?;
    if let Some(file) = &args.keep_steps {
        verify_paths::write(file, &args.render, &prepared, &kept)?;
    }
    let rays = both.disagreement();
    print(out, &text(&d, &rays))?;
    let fine = d.fine() && rays.wrong() == 0;
    if d.proposals == 0 && !args.render.quiet {
        tell(format_args!(
            "warning: no chain made a proposal, so nothing was verified"
        ));
    }
    Ok(ExitCode::from(if fine { 0 } else { 3 }))
}

fn print(out: &mut impl Write, text: &str) -> Result<(), CliError> {
    let written = out.write_all(text.as_bytes());
    written.map_err(CliError::Stdout)
}

struct Steps {
    steps: u64,
    keep: bool,
}

impl Work for Steps {
    /// What was found, and the steps if they are kept.
    type Out = (Deviations, Vec<Vec<u8>>);

    fn run<const N: usize>(self, set: &Setting<Asked>, seed: u64) -> Self::Out {
        let of = |group: u32| {
            let (mut d, mut tally) = (Deviations::default(), Tally::default());
            let mut kept: Vec<u8> = Vec::new();
            let which = Which {
                seed,
                generation: 0,
                group,
                chain: 0,
            };
            if let Some(mut chain) = chain_again::<N, _>(set, which, &mut tally) {
                let mut witness = Witness::new(set.world);
                for _ in 0..self.steps {
                    step_seen(&mut chain, set, &mut witness, |s| {
                        verify(set, s, &mut d);
                        if self.keep {
                            keep(set, group, s, &mut Writer::new(&mut kept))
                                .expect("memory takes all that is written to it");
                        }
                    });
                    d.impossible +=
                        witness.given.iter().filter(|g| g.fault.is_some()).count() as u64;
                }
            }
            d.impossible += tally.impossible();
            (d, kept)
        };
        let groups = (0..set.options.groups).into_par_iter();
        let (found, kept): (Vec<Deviations>, Vec<Vec<u8>>) = groups.map(of).unzip();
        let mut all = Deviations::default();
        found.into_iter().for_each(|d| all += d);
        (all, kept)
    }
}

/// The findings.
fn text(d: &Deviations, rays: &Disagreement) -> String {
    let mut told = rays.lines();
    // Ties and the like are only counted here; `check-rays` tells of each.
    told.truncate(if rays.wrong() == 0 { 1 } else { told.len() });
    let mark = |fine: bool| if fine { "" } else { "   <-- beyond its bound" };
    format!(
        "{} steps, {} proposals, {} vertices computed again\n\
         carried quantities that differ from recomputed ones: {}, by {:e} at most (bound 0){}\n\
         densities of both directions: {:.3} of their bound at most{}\n\
         edges of paths that are blocked: {} (bound 0){}\n\
         edges followed by a ray: {}, of which {} graze an edge of the geometry; the others hit the other vertex within {:.3} \
         of what roundings explain\n\
         impossible values: {} (bound 0){}\n\
         {} (bound 0 missed, 0 false){}\n",
        d.steps,
        d.proposals,
        d.links,
        d.stale,
        d.stale_by,
        mark(d.stale == 0),
        d.way_back,
        mark(d.way_back <= 1.0),
        d.blocked,
        mark(d.blocked == 0),
        d.followed,
        d.missed,
        d.missed_by,
        d.impossible,
        mark(d.impossible == 0),
        told.join("\n  "),
        mark(rays.wrong() == 0),
    )
}
