//! How many rounds each setting gets, so that all of them take the same doubling times and together stay within a budget.

use super::fit::Pace;

/// Doubling budgets at most; the lowest of six takes a thirty-second part of the highest.
pub const LEVELS: usize = 6;

/// What a setting costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Rounds to seconds of rendering.
    pub pace: Pace,
    /// Seconds of everything around it: loading, building, writing, judging.
    pub around: f64,
}

/// Rounds of every setting at every level.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    /// `[setting][level]`, the lowest level first; `None` where a setting cannot be that fast, or would repeat itself.
    pub rounds: Vec<Vec<Option<u64>>>,
    /// Repeats of each.
    pub repeats: usize,
    /// Seconds of all of it, as expected.
    pub seconds: f64,
    /// Seconds of rendering at the highest level.
    pub longest: f64,
}

impl Schedule {
    /// Images to render.
    pub fn images(&self) -> usize {
        self.rounds.iter().flatten().flatten().count() * self.repeats
    }
}

/// The schedule whose highest level takes as long as `seconds` allow; `None` if not even one round of everything fits.
pub fn schedule(costs: &[Cost], repeats: usize, seconds: f64) -> Option<Schedule> {
    let cheapest = costs
        .iter()
        .map(|c| c.pace.seconds(1.0))
        .fold(f64::INFINITY, f64::min);
    let fits = |longest: f64| {
        let s = of_longest(costs, repeats, longest);
        (s.seconds <= seconds && s.images() > 0).then_some(s)
    };
    // Bisection in the logarithm: the total grows with the longest time, in steps.
    // A little more than one round of the cheapest, lest rounding make it less than one.
    let (mut low, mut high) = ((1.01 * cheapest).max(1e-6), seconds.max(cheapest) * 2.0);
    let mut best = fits(low)?;
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        match fits(middle) {
            Some(s) => (low, best) = (middle, s),
            None => high = middle,
        }
    }
    // One round each is not a curve.
    let two = |rounds: &Vec<Option<u64>>| rounds.iter().flatten().count() >= 2;
    best.rounds.iter().all(two).then_some(best)
}

/// All settings take about `longest` at the highest level and half as much on each level below.
fn of_longest(costs: &[Cost], repeats: usize, longest: f64) -> Schedule {
    let mut total = 0.0;
    let rounds = costs
        .iter()
        .map(|c| {
            let top = even(c.pace.work(longest));
            let level = |k: usize| top >> (LEVELS - 1 - k);
            (0..LEVELS)
                .map(|k| {
                    let n = level(k);
                    let seconds = c.pace.seconds(n as f64);
                    // Half the time is not to be had where most of it is the start.
                    let wanted = longest / 2f64.powi((LEVELS - 1 - k) as i32);
                    if n == 0 || seconds > 2.0 * wanted {
                        return None;
                    }
                    total += (seconds + c.around) * repeats as f64;
                    Some(n)
                })
                .collect()
        })
        .collect();
    Schedule {
        rounds,
        repeats,
        seconds: total,
        longest,
    }
}

/// The nearest of 1, 2, 3, 4, 5, 6, 7 times a power of two: a clock that errs by a little leads to the same rounds, and so
/// to a point that may be done already.
pub fn even(work: f64) -> u64 {
    if work < 1.0 {
        return 0;
    }
    let step = 2f64.powi((work.log2().floor() as i32 - 2).max(0));
    ((work / step).round() * step) as u64
}

/// A seed for some rounds and repeat, different for every doubling, so that no point repeats a part of another.
pub fn seed(rounds: u64, repeat: usize) -> u64 {
    1 + repeat as u64 + 1000 * (64 - rounds.leading_zeros() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(start: f64, each: f64) -> Cost {
        Cost {
            pace: Pace { start, each },
            around: 0.01,
        }
    }

    #[test]
    fn times_double_and_stay_within_the_budget() {
        let costs = [cost(0.0, 0.01), cost(0.3, 0.02), cost(0.05, 0.2)];
        let s = schedule(&costs, 3, 60.0).expect("it fits");
        assert!(s.seconds <= 60.0 && s.seconds > 50.0, "{s:?}");
        for (rounds, c) in s.rounds.iter().zip(&costs) {
            let top = rounds[LEVELS - 1].expect("the highest level");
            // Rounded to one of four numbers an octave: at most an eighth off.
            let off = c.pace.seconds(top as f64) / s.longest;
            assert!((0.87..=1.13).contains(&off), "{off} {s:?}");
            for pair in rounds.windows(2) {
                if let [Some(a), Some(b)] = pair {
                    assert!(*b == 2 * a || *b == 2 * a + 1);
                }
            }
        }
        // A start of 0.3 s leaves no room on the lowest levels.
        assert!(s.rounds[1][0].is_none() && s.rounds[0][0].is_some());
        assert_eq!(s.images(), 3 * s.rounds.iter().flatten().flatten().count());
        assert!(schedule(&costs, 3, 1.0).is_none());
        // Whatever the paces, enough time is enough.
        for i in 1..500 {
            let odd = [
                cost(i as f64 * 0.0137, 0.0071 * i as f64),
                cost(0.575_207_391, 0.093_984_258),
            ];
            assert!(schedule(&odd, 3, 1e4).is_some(), "{odd:?}");
        }
    }

    #[test]
    fn rounds_are_few_and_seeds_differ() {
        let set: std::collections::BTreeSet<u64> =
            (10..1000).map(|i| even(i as f64 * 0.1)).collect();
        assert!(set.len() < 28, "{set:?}");
        assert_eq!(
            [0.5, 1.0, 3.4, 7.6, 9.1, 1000.0].map(even),
            [0, 1, 3, 8, 10, 1024]
        );
        assert_ne!(seed(4, 0), seed(8, 0));
        assert_ne!(seed(4, 0), seed(4, 1));
    }
}
