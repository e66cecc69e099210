//! Who is quicker, on a machine whose speed drifts: the contenders take turns on the same rays, and what is compared is
//! their times within one turn.

use super::contender::Built;
use super::sets::RaySet;
use crate::study::process::processor_seconds;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// What time is measured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Clock {
    /// Wall time: what counts, on a machine that does nothing else
    Wall,
    /// Processor time of all threads: for a machine that others use too. It tells nothing of scaling with threads
    Cpu,
}

impl Clock {
    /// In a sentence.
    pub fn word(self) -> &'static str {
        match self {
            Self::Wall => "wall",
            Self::Cpu => "processor",
        }
    }
}

/// How long to look, and by what clock.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// The clock.
    pub clock: Clock,
    /// Turns of every contender, after one that does not count.
    pub turns: usize,
    /// Least time of a turn; rays are asked again and again until it is over.
    pub least: Duration,
}

/// Middle and middle half of some figures.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// First quartile.
    pub low: f64,
    /// Third quartile.
    pub high: f64,
}

impl Spread {
    /// Of some finite figures, at least one.
    pub fn of(figures: impl IntoIterator<Item = f64>) -> Self {
        let mut v: Vec<f64> = figures.into_iter().collect();
        v.sort_by(f64::total_cmp);
        // Linear between the two figures around the place.
        let at = |q: f64| {
            let x = q * (v.len() - 1) as f64;
            let (i, f) = (x.floor() as usize, x.fract());
            v[i] + f * (v[(i + 1).min(v.len() - 1)] - v[i])
        };
        Self {
            median: at(0.5),
            low: at(0.25),
            high: at(0.75),
        }
    }
}

/// What came out for one contender.
#[derive(Clone, Debug)]
pub struct Speed {
    /// Rays a second.
    pub rate: Spread,
    /// Rays a second over those of the first contender in the same turn.
    pub ratio: Spread,
    /// Rays that hit something.
    pub hits: u64,
}

/// Times all contenders on a set, on the threads of a pool.
pub fn measure(
    contenders: &[Built],
    set: &RaySet,
    pool: &rayon::ThreadPool,
    patience: Patience,
) -> Vec<Speed> {
    let pass = |b: &Built| pool.install(|| black_box(b.ask(set.kind, black_box(&set.rays))));
    let mut hits = Vec::new();
    let mut passes = Vec::new();
    for b in contenders {
        // The first pass brings pages and caches up, the second tells how many make a turn.
        hits.push(pass(b));
        let start = Instant::now();
        pass(b);
        let one = start.elapsed().as_secs_f64().max(1e-9);
        passes.push((patience.least.as_secs_f64() / one).ceil().max(1.0) as u32);
    }
    let mut times = vec![Vec::with_capacity(patience.turns); contenders.len()];
    for turn in 0..patience.turns {
        for k in 0..contenders.len() {
            // Who begins changes, and every other turn goes backwards: no one always follows the same neighbour.
            let k = if turn % 2 == 0 {
                k
            } else {
                contenders.len() - 1 - k
            };
            let i = (k + turn / 2) % contenders.len();
            let (start, cpu) = (Instant::now(), processor_seconds());
            for _ in 0..passes[i] {
                pass(&contenders[i]);
            }
            let seconds = match patience.clock {
                Clock::Wall => start.elapsed().as_secs_f64(),
                // Threads work side by side, so a pass takes the part of each.
                Clock::Cpu => (processor_seconds() - cpu) / pool.current_num_threads() as f64,
            };
            times[i].push(seconds.max(1e-9) / passes[i] as f64);
        }
    }
    let n = set.rays.len() as f64;
    let speed = |(i, t): (usize, &Vec<f64>)| Speed {
        rate: Spread::of(t.iter().map(|s| n / s)),
        ratio: Spread::of(t.iter().zip(&times[0]).map(|(s, first)| first / s)),
        hits: hits[i],
    };
    times.iter().enumerate().map(speed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_lie_between_the_figures() {
        let s = Spread::of([4.0, 1.0, 2.0, 3.0, 5.0]);
        assert_eq!((s.low, s.median, s.high), (2.0, 3.0, 4.0));
        let s = Spread::of([1.0, 2.0]);
        assert_eq!((s.low, s.median, s.high), (1.25, 1.5, 1.75));
        assert_eq!(Spread::of([7.0]).high, 7.0);
    }
}
