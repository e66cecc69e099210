//! Short renders that tell what a long one will cost.

use super::CliError;
use super::decide::Decisions;
use super::engine::{self, Prepared, mlt_options};
use super::render_args::RenderArgs;
use crate::chain::MltOptions;
use crate::integrator::{Budget, FIRST_LOOK, Quiet};
use crate::scene::IntegratorKind;
use crate::study::fit::Pace;
use crate::study::interval::Interval;
use crate::study::predict::{Forecast, Pilot, forecast};

/// Work of a pilot: mutations a pixel, samples a pixel. The error of fewer than 32 samples a pixel is told as if they were
/// not stratified, so that a quarter of a pilot must not have fewer.
const MUTATIONS: f64 = 16.0;
const SAMPLES: u64 = 128;
/// Pilots that only tell the pace go on until they have lasted so long, seconds.
const PACE: f64 = 0.5;

/// Rounds to seconds, with a new seeding for each generation.
pub struct Clock {
    /// Seconds of a start, and of a round.
    pub pace: Pace,
    /// Rounds of a generation, with chains.
    pub generation: Option<u32>,
}

impl Clock {
    /// Seconds that so many rounds take.
    pub fn seconds(&self, rounds: f64) -> f64 {
        let starts = self
            .generation
            .map_or(1.0, |g| (rounds / f64::from(g)).ceil().max(1.0));
        self.pace.start * starts + self.pace.each * rounds
    }

    /// Rounds that can be made in so many seconds.
    pub fn rounds(&self, seconds: f64) -> f64 {
        let once = self.pace.work(seconds);
        let again = self
            .generation
            .map_or(0.0, |g| self.pace.start / f64::from(g));
        // Starts of further generations come off what one start leaves.
        (once * self.pace.each / (self.pace.each + again))
            .max(1.0)
            .floor()
    }
}

/// What pilots of one render told.
pub struct Pilots {
    /// Rounds of the longer ones; the others have a quarter.
    pub rounds: u64,
    /// What each stated.
    pub stated: Vec<Pilot>,
    /// Rounds and seconds of each.
    pub times: Vec<(f64, f64)>,
    generation: Option<u32>,
}

fn is_mlt(prepared: &Prepared) -> bool {
    prepared.job.integrator == IntegratorKind::Mlt
}

/// How chains are run, where there are any.
fn options(args: &RenderArgs, prepared: &Prepared) -> Option<MltOptions> {
    let options = || mlt_options(args, &prepared.job, &Decisions::asked(args, &prepared.job));
    is_mlt(prepared).then(options)
}

fn pixels(prepared: &Prepared) -> u64 {
    let [x0, y0, x1, y1] = prepared.scene.camera.crop;
    (x1 - x0) as u64 * (y1 - y0) as u64
}

/// Rounds, or samples a pixel, at which a render with a target error looks first.
pub fn first_look(chains: bool) -> u64 {
    if chains { 1 } else { FIRST_LOOK }
}

impl Pilots {
    /// Renders `count` pairs of pilots of the render that `args` ask for, each with a seed of its own; `tell` hears which part
    /// is done.
    ///
    /// # Errors
    /// Those of the render.
    pub fn of(args: &RenderArgs, count: u64, tell: &dyn Fn(f64)) -> Result<Self, CliError> {
        let prepared = Prepared::new(&bare(args))?;
        let options = options(args, &prepared);
        let rounds = match &options {
            Some(o) => {
                let rounds = o.rounds_for(MUTATIONS, pixels(&prepared));
                rounds.next_power_of_two().max(4)
            }
            None => SAMPLES,
        };
        let (mut stated, mut times) = (Vec::new(), Vec::new());
        for i in 0..count {
            for (k, rounds) in [rounds / 4, rounds].into_iter().enumerate() {
                let (pilot, seconds) = render(args, rounds, 2 * i + k as u64)?;
                stated.push(pilot);
                times.push((rounds as f64, seconds));
            }
            tell((i + 1) as f64 / count as f64);
        }
        Ok(Self {
            rounds,
            stated,
            times,
            generation: options.map(|o| o.rounds_per_generation),
        })
    }

    /// What they say of errors; nothing if they found no light.
    pub fn forecast(&self) -> Option<Forecast> {
        forecast(&self.stated)
    }

    /// What they say of time.
    pub fn clock(&self) -> Clock {
        // The first render of a process finds cold caches.
        Clock {
            pace: Pace::of(&self.times[2.min(self.times.len())..]),
            generation: self.generation,
        }
    }
}

/// The same render without an end of its own, and without anything to write.
fn bare(args: &RenderArgs) -> RenderArgs {
    let mut a = args.clone();
    (a.mutations, a.spp, a.time_limit) = (None, None, None);
    (a.rounds, a.target_error) = (None, None);
    (a.output, a.stats) = (vec!["pilot.exr".into()], None);
    a
}

/// A pilot with its wall time; `number` gives it its seed, far from those that people choose.
fn render(args: &RenderArgs, rounds: u64, number: u64) -> Result<(Pilot, f64), CliError> {
    let mut args = bare(args);
    args.rounds = Some(rounds);
    args.seed = (args.seed ^ 0x9e37_79b9_0000_0000).wrapping_add(number);
    let prepared = Prepared::new(&args)?;
    let rendered = engine::render(&args, &prepared, &Quiet)?;
    let error = rendered.report.relative_error().unwrap_or(f64::NAN);
    Ok((Pilot { rounds, error }, rendered.report.seconds().max(1e-6)))
}

/// How long a render will take, seconds: known where it has a time limit, else by pilots.
///
/// # Errors
/// Those of the render, and pilots that found no light where an error is to be reached.
pub fn seconds(args: &RenderArgs) -> Result<Interval, CliError> {
    let prepared = Prepared::new(args)?;
    let options = options(args, &prepared);
    let most = match prepared.job.stop.budget {
        Budget::Time(t) => return Ok(Interval::exact(t.as_secs_f64())),
        Budget::Rounds(r) => r as f64,
        Budget::PerPixel(n) => match &options {
            Some(o) => o.rounds_for(n, pixels(&prepared)) as f64,
            None => n.ceil(),
        },
    };
    if let Some(target) = args.target_error {
        let pilots = Pilots::of(args, 3, &|_| ())?;
        let clock = pilots.clock();
        let needed = pilots.forecast().map_or(Interval::exact(most), |f| {
            f.rounds_for(target, first_look(options.is_some()))
        });
        return Ok(needed.map(|r| clock.seconds(r.min(most))));
    }
    let mut times = Vec::new();
    while let Some(rounds) = Pace::next_pilot(&times, PACE) {
        let (_, seconds) = render(args, rounds as u64, times.len() as u64)?;
        times.push((rounds, seconds));
    }
    let warm = if times.len() > 2 { &times[1..] } else { &times };
    let clock = Clock {
        pace: Pace::of(warm),
        generation: options.map(|o| o.rounds_per_generation),
    };
    Ok(Interval::exact(clock.seconds(most)))
}
