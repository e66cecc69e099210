//! What is decided by a look at the scene with rays: who computes direct light, whether a coarse image evens out the
//! samples, and how often each strategy is proposed. The look is a fixed number of samples and mutations, so the decisions
//! depend on scene, options and seed alone.

use super::engine::mlt_options;
use super::job::Job;
use super::render_args::{DirectArg, MltArg, RenderArgs, TwoStageArg};
use crate::accel::Accel;
use crate::chain::{Direct, DirectRate, MltOptions, Pilot, Shares};
use crate::integrator::Probe;
use crate::mutation::Strategy;
use crate::path::{Tally, World};
use crate::plan::Effect;
use serde::Serialize;

/// The gain of dark tiles (see [`Probe::range`]) from which a second stage is worth its coarse image.
const GAIN: f64 = 2.0;

/// The chain takes direct light where a pass of its own would leave this many times its squared error: the look knows that
/// no better, and a pass of its own is the safer way, as it cannot stay with a rare bright path.
const NEAR: f64 = 1.3;

/// Decisions of a run of Metropolis light transport.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Decisions {
    /// Who computes direct light.
    pub direct: Direct,
    /// The command line says so.
    pub asked: bool,
    /// Samples of the direct pass, if there is one.
    pub direct_rate: DirectRate,
    /// The target is divided by a coarse image.
    pub two_stage: bool,
    /// There are paths for a Markov chain to own; otherwise the direct pass is the image.
    pub chain: bool,
    /// Shares of the strategies; reports tell them with what the strategies did.
    #[serde(skip)]
    pub shares: Shares,
    /// What the look saw; without one the command line decided.
    pub probe: Option<Probe>,
    /// What the pilot saw that decided on the shares, if one did.
    pub pilot: Option<Pilot>,
}

impl Decisions {
    /// What the command line says, and where it says nothing what is done without a look.
    pub fn asked(args: &RenderArgs, job: &Job) -> Self {
        Self {
            direct: match args.direct() {
                DirectArg::Chain => Direct::InChain,
                _ if args.mlt == MltArg::Relative => Direct::InChain,
                DirectArg::Auto | DirectArg::Separate => Direct::Separate,
            },
            asked: true,
            direct_rate: MltOptions::default().direct_rate,
            two_stage: args.two_stage == TwoStageArg::On,
            chain: true,
            shares: job.plan.shares,
            probe: None,
            pilot: None,
        }
    }

    /// Decides what the command line leaves open; rays and faults of a look go into `tally`.
    pub fn new<const N: usize, A: Accel>(
        args: &RenderArgs,
        job: &Job,
        world: &World<A>,
        tally: &mut Tally,
    ) -> Self {
        let chain = job.plan.on(Effect::Indirect)
            || args.direct() == DirectArg::Chain
            || args.mlt == MltArg::Relative;
        let open = args.direct() != DirectArg::Chain || args.two_stage == TwoStageArg::Auto;
        // An image without a scale of its own takes no light from another pass.
        let relative = args.mlt == MltArg::Relative;
        let open = open && chain && !relative;
        let probe = open.then(|| Probe::new::<N, A>(world, args.seed, tally));
        let direct = match (args.direct(), &probe) {
            (DirectArg::Chain, _) => Direct::InChain,
            _ if relative => Direct::InChain,
            (DirectArg::Auto, Some(p)) if p.separate_over_chain() > NEAR => Direct::InChain,
            _ => Direct::Separate,
        };
        let two_stage = match (args.two_stage, &probe) {
            (TwoStageArg::On, _) => true,
            // Sums in single precision are of one stage.
            (TwoStageArg::Auto, Some(p)) if args.tuning.sums.is_none() => p.range > GAIN * p.loss,
            _ => false,
        };
        let constant = MltOptions::default().direct_rate;
        let decided = Self {
            direct,
            asked: args.direct() != DirectArg::Auto || relative,
            direct_rate: probe.as_ref().map_or(constant, Probe::rate),
            two_stage: two_stage && chain,
            chain,
            shares: job.plan.shares,
            probe,
            pilot: None,
        };
        if !chain || args.mutate.is_some() {
            return decided;
        }
        let options = mlt_options(args, job, &decided);
        let pilot = Pilot::new::<N, A>(world, &options, args.seed, tally);
        Self {
            shares: pilot.shares(&job.plan.shares),
            pilot: Some(pilot),
            ..decided
        }
    }

    /// The shares, and where they come from.
    pub fn shares(&self) -> String {
        let of = |s: Strategy| match self.shares.get(s) {
            share if share > 0.0 => Some(format!("{} {:.0} %", s.name(), 100.0 * share)),
            _ => None,
        };
        let all: Vec<String> = Strategy::ALL.into_iter().filter_map(of).collect();
        let why = match &self.pilot {
            _ if !self.chain => return "none: there is no other light".into(),
            None => ", as the command line says".into(),
            Some(pilot) => {
                let worth = |s: &Strategy| format!("{:.0} %", 100.0 * pilot.worth(*s));
                let shared = |s: &Strategy| self.shares.get(*s) > 0.0 && *s != Strategy::Wavelength;
                let worth: Vec<String> = Strategy::ALL
                    .iter()
                    .filter(|s| shared(s))
                    .map(worth)
                    .collect();
                format!(
                    ": above their floors by what went to another pixel in a pilot, {} of the proposals",
                    worth.join(", ")
                )
            }
        };
        all.join(", ") + &why
    }

    /// A line about direct light and one about the stages, each with its reason.
    pub fn text(&self) -> [String; 2] {
        let direct = match self.direct {
            Direct::Separate => "separate",
            Direct::InChain => "in the chain",
        };
        let stages = if self.two_stage { "two" } else { "one" };
        if !self.chain {
            let alone = "there is no other light";
            return [format!("{direct}: {alone}"), format!("{stages}: {alone}")];
        }
        let Some(p) = &self.probe else {
            let asked = "as the command line says";
            return [format!("{direct}, {asked}"), format!("{stages}, {asked}")];
        };
        let all = p.direct + p.indirect;
        let samples = p.rate().samples(100.0);
        let why = if self.asked {
            let pass = format!(", with {samples:.0} samples beside 100 mutations");
            let separate = self.direct == Direct::Separate;
            format!(
                "as the command line says{}",
                if separate { &pass } else { "" }
            )
        } else if p.direct > 0.0 {
            format!(
                "it is {:.0} % of the light, {:.0} % of connections carry some; a separate pass, with {samples:.0} samples beside \
                 100 mutations, leaves {:.2} times the squared error that the chain alone would",
                100.0 * p.direct / all,
                100.0 * p.success,
                p.separate_over_chain()
            )
        } else {
            format!("none was found in {} samples", p.samples)
        };
        let colon = if self.asked { "," } else { ":" };
        [
            format!("{direct}{colon} {why}"),
            format!(
                "{stages}: samples spread evenly would divide the relative variance by {:.1} and multiply the absolute one by \
                 {:.1}; {:.0} % of the indirect light meets a delta",
                p.range,
                p.loss,
                100.0 * p.specular
            ),
        ]
    }
}
