//! Which strategy a step chooses: one of those that suit the path, by their shares.

use super::{Setting, Shares};
use crate::accel::Accel;
use crate::mutation::Strategy;
use crate::path::{Path, Pool};

const ALL: usize = Strategy::ALL.len();

/// The strategies that may be chosen at a path, a bit each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Suited(u32);

impl Suited {
    /// Those of a path. A strategy without a share is never asked.
    #[inline]
    pub(super) fn to<const N: usize, A: Accel>(
        set: &Setting<A>,
        x: &Path<N>,
        pool: &Pool<N>,
    ) -> Self {
        let mut bits = 0;
        for (i, s) in Strategy::ALL.into_iter().enumerate() {
            let suits = set.options.shares.0[i] > 0.0 && s.suits(set.world.dispersive, x, pool);
            bits |= (suits as u32) << i;
        }
        Self(bits)
    }

    /// Whether there are none.
    #[inline]
    pub(super) fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// 1 for one of them, 0 for others.
    #[inline]
    pub(super) fn has(self, strategy: usize) -> f64 {
        (self.0 >> strategy & 1) as f64
    }
}

/// What choosing among any strategies needs of their shares, worked out before the first step.
#[derive(Clone, Debug)]
pub(super) struct Choices([Choice; 1 << ALL]);

/// Among the strategies of one [`Suited`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    /// Sum of their shares: the probability of one is its own share over this.
    pub(super) total: f64,
    /// 1 over that; 0 if there are none.
    pub(super) inverse: f64,
    /// Sums of shares up to and with each strategy; infinite from the last one that suits on, so that no rounding chooses
    /// beyond it.
    ends: [f64; ALL],
}

impl Choices {
    pub(super) fn new(shares: &Shares) -> Self {
        Self(std::array::from_fn(|bits| Choice::new(bits, shares)))
    }

    #[inline]
    pub(super) fn among(&self, suited: Suited) -> &Choice {
        &self.0[suited.0 as usize % (1 << ALL)]
    }
}

impl Choice {
    fn new(bits: usize, shares: &Shares) -> Self {
        let suits = |i: usize| bits >> i & 1 == 1 && shares.0[i] > 0.0;
        let mut total = 0.0;
        let sums: [f64; ALL] = std::array::from_fn(|i| {
            if suits(i) {
                total += shares.0[i];
            }
            total
        });
        let last = (0..ALL).rfind(|&i| suits(i)).unwrap_or(0);
        let end = |i: usize| if i < last { sums[i] } else { f64::INFINITY };
        Self {
            total,
            inverse: if total > 0.0 { 1.0 / total } else { 0.0 },
            ends: std::array::from_fn(end),
        }
    }

    /// Which strategy, for a uniform `u` in [0, 1).
    #[inline]
    pub(super) fn pick(&self, u: f64) -> usize {
        let r = u * self.total;
        // Without a branch that nobody can foresee.
        self.ends.iter().map(|end| (*end <= r) as usize).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over equally spaced u every strategy is chosen as often as its share says, and none that does not suit or has no
    /// share ever is.
    #[test]
    fn strategies_are_chosen_by_their_shares() {
        const STEPS: usize = 100_000;
        for shares in [
            [0.35, 0.55, 0.0, 0.0, 0.05, 0.05],
            [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            [0.1, 0.0, 0.2, 0.0, 0.3, 0.0],
        ] {
            let choices = Choices::new(&Shares(shares));
            for bits in 1..1u32 << ALL {
                let some: Vec<usize> = (0..ALL)
                    .filter(|&i| bits >> i & 1 == 1 && shares[i] > 0.0)
                    .collect();
                if some.is_empty() {
                    continue;
                }
                let choice = choices.among(Suited(bits));
                let total: f64 = some.iter().map(|&i| shares[i]).sum();
                assert!((choice.total - total).abs() < 1e-12 * total);
                let mut counts = [0usize; ALL];
                for i in 0..STEPS {
                    counts[choice.pick(i as f64 / STEPS as f64)] += 1;
                }
                for (i, n) in counts.into_iter().enumerate() {
                    let expected = if some.contains(&i) {
                        shares[i] / total * STEPS as f64
                    } else {
                        0.0
                    };
                    // Either end of a stretch of u cuts off less than a step.
                    assert!((n as f64 - expected).abs() <= 1.0 + 1e-6, "{bits:b}, {i}");
                    assert!(n == 0 || some.contains(&i));
                }
                let last = choice.pick(1.0f64.next_down());
                assert_eq!(Some(&last), some.last());
            }
        }
    }
}
