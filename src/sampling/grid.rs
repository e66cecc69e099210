//! A density on the unit square that is constant on each cell of a grid (PBRT A.5.5), for environment maps.

use crate::real::{Real, Vec2};

/// A piecewise-constant density over [0, 1)².
///
/// The density is read off the cumulative sums that sampling inverts, so the two cannot disagree.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid2d {
    nx: usize,
    ny: usize,
    /// Cumulative sums along each row: `ny` times `nx + 1` values from 0 to 1.
    rows: Vec<f64>,
    /// Cumulative sums of the row totals: `ny + 1` values from 0 to 1.
    marginal: Vec<f64>,
    total: f64,
}

impl Grid2d {
    /// From weights ≥ 0 in rows of `nx`; row j covers y in [j/ny, (j+1)/ny). `None` if the sum is 0, a weight is
    /// negative or not finite, or the count is not a positive multiple of `nx`.
    pub fn new(nx: usize, weights: &[f32]) -> Option<Self> {
        if nx == 0 || weights.is_empty() || !weights.len().is_multiple_of(nx) {
            return None;
        }
        if weights.iter().any(|w| !w.is_finite() || *w < 0.0) {
            return None;
        }
        let ny = weights.len() / nx;
        let mut rows = Vec::with_capacity(ny * (nx + 1));
        let mut sums = Vec::with_capacity(ny);
        for row in weights.chunks_exact(nx) {
            sums.push(cumulate(row.iter().map(|&w| f64::from(w)), &mut rows));
        }
        let mut marginal = Vec::with_capacity(ny + 1);
        let total = cumulate(sums.into_iter(), &mut marginal);
        (total > 0.0).then(|| Self {
            nx,
            ny,
            rows,
            marginal,
            total: total / weights.len() as f64,
        })
    }

    /// Integral of the weight function over the unit square: the mean weight.
    pub fn integral(&self) -> f64 {
        self.total
    }

    /// A point and its density per unit area of the square.
    pub fn sample(&self, u: Vec2) -> (Vec2, Real) {
        let (j, fy, py) = invert(&self.marginal, f64::from(u.y));
        let (i, fx, px) = invert(self.row(j), f64::from(u.x));
        let point = Vec2::new(place(i, fx, self.nx), place(j, fy, self.ny));
        let pdf = px * py * (self.nx * self.ny) as f64;
        (point, pdf as Real)
    }

    /// Density of [`Self::sample`] at a point; 0 outside the square.
    pub fn pdf(&self, p: Vec2) -> Real {
        if !(p.x >= 0.0 && p.x <= 1.0 && p.y >= 0.0 && p.y <= 1.0) {
            return 0.0;
        }
        let i = ((p.x * self.nx as Real) as usize).min(self.nx - 1);
        let j = ((p.y * self.ny as Real) as usize).min(self.ny - 1);
        let row = self.row(j);
        let px = row[i + 1] - row[i];
        let py = self.marginal[j + 1] - self.marginal[j];
        (px * py * (self.nx * self.ny) as f64) as Real
    }

    fn row(&self, j: usize) -> &[f64] {
        &self.rows[j * (self.nx + 1)..(j + 1) * (self.nx + 1)]
    }
}

/// Appends the running sums of `w` divided by their total, and returns the total. All zero gives equal steps.
fn cumulate(w: impl ExactSizeIterator<Item = f64>, out: &mut Vec<f64>) -> f64 {
    let (start, n) = (out.len(), w.len());
    let mut sum = 0.0;
    out.push(0.0);
    for v in w {
        sum += v;
        out.push(sum);
    }
    for (k, c) in out[start..].iter_mut().enumerate() {
        *c = if sum > 0.0 {
            *c / sum
        } else {
            k as f64 / n as f64
        };
    }
    sum
}

/// Cell that holds `u`, the place in it, and the cell's probability.
fn invert(cdf: &[f64], u: f64) -> (usize, f64, f64) {
    // Cells of probability 0 are stepped over, because the search returns the last entry ≤ u.
    let i = (cdf.partition_point(|&c| c <= u) - 1).min(cdf.len() - 2);
    let p = cdf[i + 1] - cdf[i];
    (i, (u - cdf[i]) / p, p)
}

/// (i + f)/n, held inside cell i as f32 sees cells, so that `pdf` finds the same cell again.
fn place(i: usize, f: f64, n: usize) -> Real {
    let mut x = ((i as f64 + f) / n as f64) as Real;
    while (x * n as Real) as usize > i {
        x = x.next_down();
    }
    while ((x * n as Real) as usize) < i {
        x = x.next_up();
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Rng;

    fn grid(nx: usize, ny: usize) -> Grid2d {
        let w: Vec<f32> = (0..nx * ny)
            .map(|k| {
                let (i, j) = (k % nx, k / nx);
                match (i, j) {
                    (_, 2) => 0.0,
                    (3, 4) => 500.0,
                    _ => ((i * 7 + j * 13) % 5) as f32,
                }
            })
            .collect();
        Grid2d::new(nx, &w).unwrap()
    }

    #[test]
    fn sample_returns_the_density_that_pdf_returns() {
        for (nx, ny) in [(1, 5), (8, 8), (13, 7), (300, 200)] {
            let g = grid(nx, ny);
            let mut rng = Rng::new(1, 0, 0, 0);
            for _ in 0..20_000 {
                let (p, pdf) = g.sample(rng.next_vec2());
                assert!(pdf > 0.0);
                assert_eq!(pdf, g.pdf(p), "{p}");
                assert!(p.x >= 0.0 && p.x < 1.0 && p.y >= 0.0 && p.y < 1.0);
            }
        }
    }

    #[test]
    fn density_integrates_to_one_and_follows_the_weights() {
        let g = grid(13, 7);
        let mut sum = 0.0;
        for j in 0..7 {
            for i in 0..13 {
                let p = Vec2::new((i as Real + 0.5) / 13.0, (j as Real + 0.5) / 7.0);
                sum += f64::from(g.pdf(p)) / 91.0;
                if j == 2 {
                    assert_eq!(g.pdf(p), 0.0);
                }
            }
        }
        // 91 roundings to f32.
        assert!((sum - 1.0).abs() < 91.0 * f64::from(Real::EPSILON));
        let ratio =
            g.pdf(Vec2::new(3.5 / 13.0, 4.5 / 7.0)) / g.pdf(Vec2::new(4.5 / 13.0, 0.5 / 7.0));
        let want = 500.0 / ((4 * 7) % 5) as Real;
        assert!((ratio / want - 1.0).abs() < 4.0 * Real::EPSILON);
        assert_eq!(g.pdf(Vec2::new(1.5, 0.5)), 0.0);
    }

    #[test]
    fn a_stratified_square_lands_in_proportion() {
        let g = grid(8, 8);
        let m = 1024;
        let mut count = vec![0u32; 64];
        for b in 0..m {
            for a in 0..m {
                let u = Vec2::new(a as Real + 0.5, b as Real + 0.5) / m as Real;
                let p = g.sample(u).0;
                count[(p.y * 8.0) as usize * 8 + (p.x * 8.0) as usize] += 1;
            }
        }
        for (k, &c) in count.iter().enumerate() {
            let mid = Vec2::new((k % 8) as Real + 0.5, (k / 8) as Real + 0.5) / 8.0;
            let want = f64::from(g.pdf(mid)) / 64.0 * f64::from(m * m);
            // Each edge of the cell's preimage moves by less than one row or column of points.
            assert!((f64::from(c) - want).abs() <= 4.0 * f64::from(m));
        }
    }

    #[test]
    fn useless_weights_are_refused() {
        assert!(Grid2d::new(2, &[0.0; 4]).is_none());
        assert!(Grid2d::new(2, &[1.0; 3]).is_none());
        assert!(Grid2d::new(0, &[]).is_none());
        assert!(Grid2d::new(1, &[-1.0]).is_none());
        assert!(Grid2d::new(1, &[f32::INFINITY]).is_none());
    }
}
