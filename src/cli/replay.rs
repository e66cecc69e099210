//! `metrolux replay`: a step of a chain again, with every quantity in it.

use super::CliError;
use super::engine::Prepared;
use super::inspect::{self, Work};
use super::render_args::RenderArgs;
use super::replay_text::{line, path_text};
use super::while_running;
use crate::accel::Asked;
use crate::chain::{Seen, Setting, Which, Witness, chain_again, step_seen};
use crate::path::{Site, Tally};
use clap::Args;
use std::fmt::Write as _;
use std::io::Write;
use std::process::ExitCode;

/// Make a step of a chain again and print every quantity in it.
///
/// Takes the settings of the render; those that say when to stop and which image to write make no difference, and those that say
/// how it is kept are refused. Ends with exit code 3
/// if an impossible value is met, as the render does.
#[derive(Args, Debug)]
pub struct ReplayArgs {
    #[command(flatten)]
    render: RenderArgs,
    /// Generation of the chain
    #[arg(long, default_value_t = 0)]
    generation: u32,
    /// Group of the chain
    #[arg(long, default_value_t = 0)]
    group: u32,
    /// Number of the chain in its group
    #[arg(long)]
    chain: u32,
    /// Step, counted from the chain's start
    #[arg(long)]
    step: u64,
    /// Look at this many steps from there on, and print those in which an impossible value is met, or the last one
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    steps: u64,
}

/// Runs the sub-command.
pub fn run(args: &ReplayArgs, out: &mut impl Write) -> Result<ExitCode, CliError> {
    while_running::refuse(&args.render, "replay")?;
    let prepared = Prepared::new(&args.render)?;
    let accel = inspect::backend(&args.render, &prepared.scene)?;
    let (text, faults) = inspect::work_on(&args.render, &prepared, accel.as_ref(), Again(args))??;
    let written = out.write_all(text.as_bytes());
    written.map_err(CliError::Stdout)?;
    Ok(ExitCode::from(if faults > 0 { 3 } else { 0 }))
}

/// A word as a shell reads it.
pub fn quoted(a: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,=:+".contains(c);
    if !a.is_empty() && a.chars().all(plain) {
        return a.to_owned();
    }
    format!("'{}'", a.replace('\'', "'\\''"))
}

/// How to look at the work in which an impossible value was met, for a person: the command that makes it again, for a
/// render with these words after its name.
pub fn told(site: &Site, words: &[String]) -> String {
    match *site {
        Site::Step {
            generation,
            group,
            chain,
            step,
            steps,
        } => {
            // The settings of this render, as they were given.
            let words = while_running::without(words);
            let settings: Vec<String> = words.iter().map(|w| quoted(w)).collect();
            let many = if steps > 1 {
                format!(" --steps {steps}")
            } else {
                String::new()
            };
            format!(
                "replay: metrolux replay {} --generation {generation} --group {group} --chain {chain} --step {step}{many}",
                settings.join(" ")
            )
        }
        Site::Seed {
            generation,
            group,
            sample,
        } => format!("met in seeding sample {sample} of group {group}, generation {generation}"),
        Site::Pixel {
            direct,
            pixel: [x, y],
            sample,
        } => {
            let of = if direct { " of direct light" } else { "" };
            format!("met in sample {sample}{of} of pixel {x}, {y}")
        }
    }
}

struct Again<'a>(&'a ReplayArgs);

impl Work for Again<'_> {
    /// What there is to print, and how many impossible values were met.
    type Out = Result<(String, u64), CliError>;

    fn run<const N: usize>(self, set: &Setting<Asked>, seed: u64) -> Self::Out {
        let args = self.0;
        let (groups, chains) = (set.options.groups, set.options.chains);
        if args.group >= groups || args.chain >= chains {
            return Err(CliError::Usage(format!(
                "there is no such chain: found group {}, chain {}, expected less than {groups} and {chains}",
                args.group, args.chain
            )));
        }
        let which = Which {
            seed,
            generation: args.generation,
            group: args.group,
            chain: args.chain,
        };
        let mut tally = Tally::default();
        let Some(mut chain) = chain_again::<N, _>(set, which, &mut tally) else {
            return Err(CliError::Usage(format!(
                "group {} of generation {} found no light: it has no chains",
                args.group, args.generation
            )));
        };
        let mut witness = Witness::new(set.world);
        while chain.steps() < args.step {
            step_seen(&mut chain, set, &mut witness, |_| ());
        }
        let (mut text, mut faults) = (String::new(), 0);
        for i in 0..args.steps {
            let (mut seen, mut met) = (String::new(), 0);
            step_seen(&mut chain, set, &mut witness, |s| {
                seen = describe(s);
                met = s.tally.impossible();
            });
            for g in &witness.given {
                let fault = g
                    .fault
                    .map_or(String::new(), |f| format!(", refused: {f:?}"));
                met += g.fault.is_some() as u64;
                let _ = writeln!(
                    seen,
                    "splat at {} of XYZ {:?}, weight {:e}{fault}",
                    g.raster, g.xyz, g.weight
                );
            }
            faults += met;
            if met > 0 || i + 1 == args.steps {
                text += &seen;
            }
        }
        Ok((text, faults))
    }
}

/// Everything there is to know of a step.
fn describe<const N: usize>(s: &Seen<N>) -> String {
    let mut t = String::new();
    line(&mut t, "step", s.step);
    t += &path_text("x", s.x, s.pool);
    let turn = s.turn;
    let Some(strategy) = turn.strategy else {
        t += "no strategy suits x\n";
        return t;
    };
    line(&mut t, "strategy", strategy.name());
    line(&mut t, "shares that suit x", turn.there);
    match turn.ratio {
        None => t += "no path was made: a rejection\n",
        Some(ratio) => {
            t += &path_text("y", s.y, s.pool);
            line(&mut t, "T(y→x)τ(y) / T(x→y)τ(x)", format!("{ratio:e}"));
            line(&mut t, "1 / shares that suit y", turn.back);
            line(
                &mut t,
                "I0 at x, at y",
                format!("{:e} {:e}", turn.stay, turn.go),
            );
            line(&mut t, "a", format!("{:e}", turn.a));
            line(&mut t, "accepted", turn.accepted);
        }
    }
    let tally = &s.tally;
    line(
        &mut t,
        "rays",
        format!(
            "{} closest, {} visibility",
            tally.rays_closest, tally.rays_visibility
        ),
    );
    line(
        &mut t,
        "faults",
        format!(
            "{} NaN, {} negative, {} infinite, {} zero density",
            tally.fault_nan, tally.fault_negative, tally.fault_infinite, tally.fault_zero_density
        ),
    );
    t
}
