//! Choosing an index in proportion to weights, with the probability of every index known exactly.

/// A finite distribution: alias table for sampling in constant time (Walker 1977, Vose 1991), cumulative sums for
/// sampling that keeps the order of the indices.
#[derive(Clone, Debug, PartialEq)]
pub struct Discrete {
    pmf: Vec<f64>,
    /// Σ of `pmf` before each index; one entry more than `pmf`.
    cdf: Vec<f64>,
    /// Share of a bin that its own index keeps, and who gets the rest.
    alias: Vec<(f64, u32)>,
    total: f64,
}

impl Discrete {
    /// From weights ≥ 0. `None` if there is none, their sum is 0, or one is negative or not finite.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut pmf: Vec<f64> = weights.into_iter().collect();
        if pmf.iter().any(|w| !w.is_finite() || *w < 0.0) || pmf.len() > u32::MAX as usize {
            return None;
        }
        let total: f64 = pmf.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        pmf.iter_mut().for_each(|w| *w /= total);
        let mut cdf = Vec::with_capacity(pmf.len() + 1);
        let mut sum = 0.0;
        cdf.push(0.0);
        for p in &pmf {
            sum += p;
            cdf.push(sum);
        }
        let alias = build_alias(&pmf);
        Some(Self {
            pmf,
            cdf,
            alias,
            total,
        })
    }

    /// Number of indices.
    pub fn len(&self) -> usize {
        self.pmf.len()
    }

    /// Never: a distribution has at least one index.
    pub fn is_empty(&self) -> bool {
        self.pmf.is_empty()
    }

    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Index and its probability, in constant time. `u` in [0, 1); it is f64 because 24 bits shared between the bin
    /// and the place in it would distort tables of many entries.
    #[inline]
    pub fn sample(&self, u: f64) -> (usize, f64) {
        let (i, pmf, _) = self.sample_reuse(u);
        (i, pmf)
    }

    /// As [`Self::sample`], with a fresh uniform number made from what `u` has left.
    #[inline]
    pub fn sample_reuse(&self, u: f64) -> (usize, f64, f64) {
        let x = u * self.alias.len() as f64;
        let bin = (x as usize).min(self.alias.len() - 1);
        let rest = x - bin as f64;
        let (keep, other) = self.alias[bin];
        let (i, left) = if rest < keep {
            (bin, rest / keep)
        } else {
            (other as usize, (rest - keep) / (1.0 - keep))
        };
        (i, self.pmf[i], left.clamp(0.0, 1.0 - f64::EPSILON / 2.0))
    }

    /// Index and its probability by inversion of the cumulative sums: a growing `u` never gives a smaller index.
    pub fn sample_ordered(&self, u: f64) -> (usize, f64) {
        // The first entry is 0 ≤ u; rounding may leave the last below 1, so the index is held inside.
        let mut i = (self.cdf.partition_point(|&c| c <= u) - 1).min(self.pmf.len() - 1);
        while self.pmf[i] == 0.0 && i > 0 {
            i -= 1;
        }
        (i, self.pmf[i])
    }

    /// Probability of index `i`.
    #[inline]
    pub fn pmf(&self, i: usize) -> f64 {
        self.pmf[i]
    }
}

/// Vose's two stacks: every small bin is filled up by one large one.
fn build_alias(pmf: &[f64]) -> Vec<(f64, u32)> {
    let n = pmf.len();
    let mut level: Vec<f64> = pmf.iter().map(|p| p * n as f64).collect();
    let mut alias: Vec<(f64, u32)> = (0..n as u32).map(|i| (1.0, i)).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| level[i] < 1.0);
    while let (Some(s), Some(&l)) = (small.pop(), large.last()) {
        alias[s] = (level[s], l as u32);
        level[l] -= 1.0 - level[s];
        if level[l] < 1.0 {
            large.pop();
            small.push(l);
        }
    }
    // Rounding can leave small bins without a partner. They are full, except that weight 0 must never be chosen.
    if let Some(best) = (0..n).max_by(|&a, &b| pmf[a].total_cmp(&pmf[b])) {
        for i in 0..n {
            if pmf[i] == 0.0 && alias[i].1 == i as u32 {
                alias[i] = (0.0, best as u32);
            }
        }
    }
    alias
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weights(n: usize) -> Vec<f64> {
        (0..n)
            .map(|i| {
                if i % 7 == 3 {
                    0.0
                } else {
                    (i as f64 * 1.7).sin().abs().powi(6)
                }
            })
            .collect()
    }

    #[test]
    fn alias_table_realises_the_stated_probabilities() {
        for n in [1, 2, 3, 8, 1000] {
            let d = Discrete::new(weights(n)).unwrap();
            let mut got = vec![0.0; n];
            for (bin, &(keep, other)) in d.alias.iter().enumerate() {
                got[bin] += keep / n as f64;
                got[other as usize] += (1.0 - keep) / n as f64;
            }
            for (i, g) in got.iter().enumerate() {
                // n roundings of numbers below n·max pmf.
                let tol = 4.0 * n as f64 * f64::EPSILON;
                assert!(
                    (g - d.pmf(i)).abs() <= tol,
                    "{n} {i}: {g} against {}",
                    d.pmf(i)
                );
            }
            assert!((d.pmf.iter().sum::<f64>() - 1.0).abs() < 4.0 * n as f64 * f64::EPSILON);
        }
    }

    #[test]
    fn both_samplings_hit_indices_in_proportion_and_never_one_of_weight_zero() {
        let n = 50;
        let d = Discrete::new(weights(n)).unwrap();
        let m = 1_000_000;
        let (mut a, mut o) = (vec![0usize; n], vec![0usize; n]);
        let mut last = 0;
        for k in 0..m {
            let u = (k as f64 + 0.5) / m as f64;
            let (i, p, left) = d.sample_reuse(u);
            assert_eq!(p, d.pmf(i));
            assert!((0.0..1.0).contains(&left));
            a[i] += 1;
            let (j, p) = d.sample_ordered(u);
            assert_eq!(p, d.pmf(j));
            assert!(j >= last);
            last = j;
            o[j] += 1;
        }
        for i in 0..n {
            // Equal spacing: an index owns at most n + 1 intervals of u, each off by one point.
            assert!((a[i] as f64 - d.pmf(i) * m as f64).abs() <= n as f64 + 1.0);
            assert!((o[i] as f64 - d.pmf(i) * m as f64).abs() <= 2.0);
            if d.pmf(i) == 0.0 {
                assert_eq!((a[i], o[i]), (0, 0));
            }
        }
    }

    #[test]
    fn ends_of_the_unit_interval_are_safe() {
        let d = Discrete::new([0.0, 1.0, 2.0, 0.0]).unwrap();
        for u in [0.0, 1.0 - f64::EPSILON / 2.0] {
            assert!(d.sample(u).1 > 0.0);
            assert!(d.sample_ordered(u).1 > 0.0);
        }
    }

    #[test]
    fn useless_weights_are_refused() {
        assert!(Discrete::new([]).is_none());
        assert!(Discrete::new([0.0, 0.0]).is_none());
        assert!(Discrete::new([1.0, -1.0]).is_none());
        assert!(Discrete::new([1.0, f64::NAN]).is_none());
        assert!(Discrete::new([f64::MAX, f64::MAX]).is_none());
    }
}
