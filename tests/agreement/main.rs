//! Path tracing, bidirectional path tracing and Metropolis light transport find the same light.
//!
//! They share lobes, lights and rays. Path tracing stands apart from the path room's densities, so it checks those of
//! every strategy (s,t), light tracing included; the chains check the mutations. Each comparison states the relative
//! bias that it finds with 90 % probability; see `common::stats::agree`.

#[path = "../common/mod.rs"]
mod common;

mod aperture;
mod boxes;
mod chains;
mod instances;
mod lights;
mod materials;
mod strategies;
mod variants;

use common::estimate::{self, Chains, Grid, Run};
use common::stats::{Estimate, Pair};
use metrolux::accel::Accel;
use metrolux::chain::{Direct, MltOptions};
use metrolux::path::{Heuristic, World};

/// How much work each integrator does: samples a pixel and steps a chain in each of 32 repeats.
#[derive(Clone, Copy)]
struct Work {
    pt: u32,
    bdpt: u32,
    /// Seeding samples and steps of a group's 8 chains.
    seeds: u32,
    steps: u32,
}

/// Independent repeats of each estimate.
const REPEATS: u32 = 32;

impl Work {
    fn chains(&self, direct: Direct) -> Chains {
        Chains {
            options: MltOptions {
                chains: 8,
                seeds: self.seeds,
                direct,
                ..MltOptions::default()
            },
            steps: self.steps,
            direct: self.pt.max(self.bdpt),
        }
    }
}

/// Largest relative bias that may stay unseen, by integrator, in a path length with a share of the light above `least`.
#[derive(Clone, Copy)]
struct Limits {
    least: f64,
    pt: f64,
    /// Direct light in its own pass.
    mlt: f64,
    /// Direct light by the chain, which so spends its time in short paths.
    in_chain: f64,
    /// In all lengths from 3 together, which a chain with separate direct light makes alone; twice that with direct
    /// light in the chain.
    indirect: f64,
    /// In a tile of 8 × 8 pixels.
    tile: f64,
}

/// A run with the bias that has to be seen in it.
struct Judged {
    name: String,
    run: Run,
    limit: f64,
    indirect: f64,
}

/// Runs of a scene by integrator; the first is the reference.
fn runs<const N: usize, A: Accel>(
    world: &World<A>,
    work: Work,
    limits: Limits,
    chains: &[Direct],
) -> Vec<Judged> {
    let grid = Grid::new(world, 8);
    let timed = |name: String, [limit, indirect]: [f64; 2], f: &dyn Fn() -> Run| {
        let start = std::time::Instant::now();
        let run = f();
        println!("  {name}: {:.1} s", start.elapsed().as_secs_f64());
        Judged {
            name,
            run,
            limit,
            indirect,
        }
    };
    let mut all = vec![timed("bdpt".into(), [limits.pt, limits.indirect], &|| {
        estimate::bdpt::<N, A>(world, grid, Heuristic::Balance, 21, REPEATS, work.bdpt)
    })];
    if work.pt > 0 {
        all.push(timed("pt".into(), [limits.pt, limits.indirect], &|| {
            estimate::pt::<N, A>(world, grid, 22, REPEATS, work.pt)
        }));
    }
    for &direct in chains {
        let limit = match direct {
            Direct::Separate => [limits.mlt, limits.indirect],
            Direct::InChain => [limits.in_chain, 2.0 * limits.indirect],
        };
        all.push(timed(format!("mlt {direct:?}"), limit, &|| {
            estimate::mlt::<N, A>(world, grid, work.chains(direct), 23, REPEATS)
        }));
    }
    all
}

/// All runs against the first: each path length, and each tile. Lengths with less than `least` of the light are compared
/// without a limit on what stays unseen.
fn pairs(runs: &[Judged], limits: Limits) -> Vec<Pair> {
    let reference = &runs[0].run;
    let lit = |k: usize| reference.length(k..=k).mean;
    let total: f64 = (1..=reference.edges()).map(lit).sum();
    let mut all = Vec::new();
    for other in &runs[1..] {
        let mut push = |what: String, found: Estimate, reference: Estimate, limit| {
            all.push(Pair {
                name: format!("{} and {}, {what}", other.name, runs[0].name),
                found,
                reference,
                limit,
            });
        };
        for k in (1..=reference.edges()).filter(|&k| lit(k) > 0.0) {
            let (a, b) = (other.run.length(k..=k), reference.length(k..=k));
            let limit = if lit(k) >= limits.least * total {
                other.limit
            } else {
                f64::INFINITY
            };
            push(format!("{k} edges"), a, b, limit);
        }
        let all_from_3 = 3..=reference.edges();
        push(
            "3 edges and more".into(),
            other.run.length(all_from_3.clone()),
            reference.length(all_from_3),
            other.indirect,
        );
        for t in 0..reference.tiles() {
            push(
                format!("tile {t}"),
                other.run.tile(t),
                reference.tile(t),
                limits.tile,
            );
        }
    }
    all
}

/// Each scene as two tests: one of seconds, and one that sees 2 % in every length and 10 % in every tile.
macro_rules! quick_and_long {
    ($($(#[$doc:meta])* $name:ident = $what:expr;)*) => {
        $($(#[$doc])*
        #[test]
        fn $name() {
            $what(crate::QUICK);
        })*
        mod long {
            $($(#[$doc])*
            #[test]
            #[ignore = "minutes; make test-long"]
            fn $name() {
                use super::*;
                $what(crate::LONG);
            })*
        }
    };
}
pub(crate) use quick_and_long;

/// Work for a small scene of 16 × 16 pixels and what it must show.
#[derive(Clone, Copy)]
struct Effort {
    work: Work,
    limits: Limits,
}

/// Seconds. Limits leave room for the error of the standard errors: from 32 repeats it is 13 %, and other machines
/// draw other chains.
const QUICK: Effort = Effort {
    work: Work {
        pt: 256,
        bdpt: 96,
        seeds: 4096,
        steps: 12_000,
    },
    limits: Limits {
        least: 0.05,
        pt: 0.06,
        mlt: 0.12,
        in_chain: 0.12,
        indirect: 0.2,
        tile: 0.2,
    },
};

/// Minutes.
const LONG: Effort = Effort {
    work: Work {
        pt: 2048,
        bdpt: 512,
        seeds: 65_536,
        steps: 300_000,
    },
    limits: Limits {
        least: 0.05,
        pt: 0.02,
        mlt: 0.02,
        in_chain: 0.02,
        indirect: 0.04,
        tile: 0.1,
    },
};
