//! Path tracing, bidirectional path tracing and Metropolis light transport find the same light.
//!
//! They share lobes, lights and rays. Path tracing stands apart from the path room's densities, so it checks those of
//! every strategy (s,t), light tracing included; the chains check the mutations. Each comparison states the relative
//! bias that it finds with 90 % probability; see `common::stats::agree`.

#[path = "../common/mod.rs"]
mod common;

mod boxes;
mod lights;
mod materials;
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
            direct: self.pt.max(16),
        }
    }
}

/// Largest relative bias that may stay unseen, by integrator, in a path length with 5 % of the light or more.
#[derive(Clone, Copy)]
struct Limits {
    pt: f64,
    /// Direct light in its own pass.
    mlt: f64,
    /// Direct light by the chain, which so spends its time in short paths.
    in_chain: f64,
    /// In a tile of 8 × 8 pixels.
    tile: f64,
}

/// A run with the bias that has to be seen in it.
struct Judged {
    name: String,
    run: Run,
    limit: f64,
}

/// Runs of a scene by integrator; the first is the reference.
fn runs<const N: usize, A: Accel>(
    world: &World<A>,
    work: Work,
    limits: Limits,
    chains: &[Direct],
) -> Vec<Judged> {
    let grid = Grid::new(world, 8);
    let timed = |name: String, limit: f64, f: &dyn Fn() -> Run| {
        let start = std::time::Instant::now();
        let run = f();
        println!("  {name}: {:.1} s", start.elapsed().as_secs_f64());
        Judged { name, run, limit }
    };
    let mut all = vec![timed("bdpt".into(), limits.pt, &|| {
        estimate::bdpt::<N, A>(world, grid, Heuristic::Balance, 21, REPEATS, work.bdpt)
    })];
    if work.pt > 0 {
        all.push(timed("pt".into(), limits.pt, &|| {
            estimate::pt::<N, A>(world, grid, 22, REPEATS, work.pt)
        }));
    }
    for &direct in chains {
        let limit = match direct {
            Direct::Separate => limits.mlt,
            Direct::InChain => limits.in_chain,
        };
        all.push(timed(format!("mlt {direct:?}"), limit, &|| {
            estimate::mlt::<N, A>(world, grid, work.chains(direct), 23, REPEATS)
        }));
    }
    all
}

/// All runs against the first: each path length, and each tile. Lengths with less than 5 % of the light are compared
/// without a limit: there is too little of them.
fn pairs(runs: &[Judged], tile: f64) -> Vec<Pair> {
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
            let limit = if lit(k) >= 0.05 * total {
                other.limit
            } else {
                f64::INFINITY
            };
            push(format!("{k} edges"), a, b, limit);
        }
        for t in 0..reference.tiles() {
            push(
                format!("tile {t}"),
                other.run.tile(t),
                reference.tile(t),
                tile,
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

/// Seconds.
const QUICK: Effort = Effort {
    work: Work {
        pt: 512,
        bdpt: 128,
        seeds: 8192,
        steps: 30_000,
    },
    limits: Limits {
        pt: 0.04,
        mlt: 0.1,
        in_chain: 0.2,
        tile: 0.1,
    },
};

/// Minutes.
const LONG: Effort = Effort {
    work: Work {
        pt: 4096,
        bdpt: 1024,
        seeds: 131_072,
        steps: 1_000_000,
    },
    limits: Limits {
        pt: 0.02,
        mlt: 0.02,
        in_chain: 0.04,
        tile: 0.1,
    },
};
