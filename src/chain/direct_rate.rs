//! How many samples the direct pass gets beside the mutations.

/// A direct pass of n samples a pixel beside m mutations a pixel leaves an error of A/m + V/n + k·E·n^(−3/2), in the
/// mean over the pixels: V the variance of a sample at a raster point, E what the edges within pixels add to it, k
/// [`EDGE`](crate::sampling::EDGE). With a sample c times as dear as a mutation, time is best spent where a little more of it lowers both parts by
/// as much:
///
/// n² = m²·(V + (3/2)·k·E·n^(−1/2)) / (c·A).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct DirectRate {
    /// V/(c·A).
    pub noise: f64,
    /// (3/2)·k·E/(c·A).
    pub edges: f64,
}

/// The most samples for a mutation: the direct pass then takes some three quarters of the time.
const MOST: f64 = 2.0;

impl DirectRate {
    /// Always so many samples for a mutation.
    pub fn constant(rate: f64) -> Self {
        Self {
            noise: rate * rate,
            edges: 0.0,
        }
    }

    /// Samples a pixel beside `m` mutations a pixel; at least one, and it never falls as m grows.
    pub fn samples(&self, m: f64) -> f64 {
        // x = √n: x⁵ = m²·(noise·x + edges). The right side less the left is positive between 0 and the one root.
        let short = |x: f64| m * m * (self.noise * x + self.edges) > x.powi(5);
        let (mut lo, mut hi) = (1.0, (MOST * m).sqrt());
        if hi <= lo || !short(lo) {
            return 1.0;
        }
        if short(hi) {
            return MOST * m;
        }
        // As many halvings as a double has digits.
        for _ in 0..f64::MANTISSA_DIGITS {
            let middle = 0.5 * (lo + hi);
            *(if short(middle) { &mut lo } else { &mut hi }) = middle;
        }
        lo * lo
    }

    /// Rounded to a few digits, so that what depends on it is the same for machines whose last digits differ.
    pub fn rounded(self) -> Self {
        // A quarter of a binary order of magnitude.
        let step = |v: f64| {
            if v > 0.0 {
                ((v.log2() * 4.0).round() / 4.0).exp2()
            } else {
                0.0
            }
        };
        Self {
            noise: step(self.noise),
            edges: step(self.edges),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::EDGE;

    #[test]
    fn a_constant_rate_is_kept() {
        for rate in [0.125, 0.5, 1.0] {
            for m in [16.0, 100.0, 1e6] {
                let n = DirectRate::constant(rate).samples(m);
                assert!((n / (rate * m) - 1.0).abs() < 1e-12, "{rate} {m} {n}");
            }
        }
    }

    /// At the samples given, moving a little time from one part to the other gains nothing.
    #[test]
    fn time_is_best_spent() {
        let (a, c) = (0.7, 1.3);
        for (v, e) in [(0.3, 0.0), (0.01, 2.0), (0.0, 0.5)] {
            let rate = DirectRate {
                noise: v / (c * a),
                edges: 1.5 * EDGE * e / (c * a),
            };
            for m in [30.0, 300.0, 3000.0] {
                let n = rate.samples(m);
                assert!(n > 1.0 && n < MOST * m);
                let error = |n: f64| {
                    let m = m + c * (rate.samples(m) - n);
                    a / m + v / n + EDGE * e * n.powf(-1.5)
                };
                assert!(error(n) < error(1.05 * n) && error(n) < error(n / 1.05));
            }
        }
    }

    #[test]
    fn samples_never_fall_and_stay_within_bounds() {
        let rates = [(0.0, 0.0), (1e-3, 10.0), (1e9, 0.0), (0.1, 1e9)];
        for (noise, edges) in rates {
            let rate = DirectRate { noise, edges };
            let mut last = 0.0;
            for i in 0..200 {
                let m = 1.1f64.powi(i) * 0.1;
                let n = rate.samples(m);
                assert!(n >= last && n >= 1.0 && n <= (MOST * m).max(1.0), "{m} {n}");
                last = n;
            }
        }
    }

    #[test]
    fn rounding_moves_a_rate_little() {
        for x in [1e-6, 0.3, 1.0, 77.0] {
            let r = DirectRate {
                noise: x,
                edges: 0.0,
            }
            .rounded();
            assert!((r.noise / x).log2().abs() <= 0.125 && r.edges == 0.0);
            assert_eq!(r, r.rounded());
        }
    }
}
