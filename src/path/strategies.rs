//! The densities of all bidirectional strategies that could make a path, and what follows from them: the unweighted
//! contribution and the weights with which sub-paths are deleted.

use super::Path;
use crate::scatter::Mode;

/// p_d1: the probability weight of deleting a sub-path of `d` ≥ 1 edges (Veach 11.4.2).
#[inline]
pub fn deletion_length(d: usize) -> f64 {
    DELETIONS[d.min(63)]
}

/// 0.25, 0.5, then 2^−d; 0 at 63 and at index 0.
static DELETIONS: [f64; 64] = {
    let mut t = halves();
    t[0] = 0.0;
    t[1] = 0.25;
    t[2] = 0.5;
    t
};

/// 2^−i for i < 63, 0 beyond: a sub-path as long as that is neither deleted nor inserted at once.
#[inline]
pub fn half_to(i: usize) -> f64 {
    HALVES[i.min(63)]
}

static HALVES: [f64; 64] = halves();

const fn halves() -> [f64; 64] {
    let mut t = [1.0; 64];
    let mut i = 1;
    while i < 63 {
        t[i] = t[i - 1] * 0.5;
        i += 1;
    }
    t[63] = 0.0;
    t
}

/// 2^e.
#[inline]
pub fn exp2i(e: i32) -> f64 {
    if e == 0 { 1.0 } else { 2f64.powi(e) }
}

impl<const N: usize> Path<N> {
    /// Computes `rho`, `sum`, `total` and the weights of deletions. False if no strategy can make this path.
    #[inline]
    pub fn strategies(&mut self) -> bool {
        if !self.known {
            self.weigh_strategies();
            self.known = true;
        }
        self.sum[self.k() + 2] > 0.0
    }

    /// Sum of `rho`.
    #[inline]
    pub fn rho_sum(&self) -> f64 {
        self.sum[self.k() + 2]
    }

    fn weigh_strategies(&mut self) {
        let k = self.k();
        let n = k + 2;
        // The first strategy whose eye part has positive density; going up from it divides by positive numbers only.
        let mut first = k + 1;
        while first > 0 && self.links[first - 1].pe > 0.0 {
            first -= 1;
        }
        let (rho, links) = (&mut self.rho[..n], &self.links[..n - 1]);
        rho[..first].fill(0.0);
        let mut scale = 1.0f64;
        let possible = links[..first].iter().all(|l| l.pl > 0.0);
        if possible {
            let mut p = 1.0;
            // A connection is possible after s light vertices if neither of its ends is specular; the ends of the path
            // are not.
            let mut open = first <= 1 || links[first - 1].mode == Mode::NonSpecular;
            for s in first..n - 1 {
                let l = &links[s];
                let next = s == k || l.mode == Mode::NonSpecular;
                rho[s] = if s == 0 || (open && next) { p } else { 0.0 };
                open = next || s == 0;
                p *= l.pl / l.pe;
                if p > 1e200 {
                    p *= 1e-200;
                    scale *= 1e-200;
                    rho[first..=s].iter_mut().for_each(|r| *r *= 1e-200);
                }
            }
            rho[n - 1] = p;
        } else {
            rho.fill(0.0);
        }
        self.weigh_deletions();
        self.total = if possible {
            self.contribution(first) * scale
        } else {
            0.0
        };
    }

    /// `sum`, and p_d1·p_d2 summed over the sub-paths of each length.
    fn weigh_deletions(&mut self) {
        let n = self.k() + 2;
        let (rho, sum) = (&self.rho[..n], &mut self.sum[..n + 1]);
        let (area, deletion) = (&mut self.area[..n + 2], &mut self.deletion[..n + 1]);
        let (mut one, mut two) = (0.0, 0.0);
        for ((r, s), a) in rho.iter().zip(&mut *sum).zip(&mut *area) {
            *s = one;
            *a = two;
            two += one;
            one += r;
        }
        sum[n] = one;
        area[n] = two;
        two += one;
        area[n + 1] = two;
        let mut total = 0.0;
        // Σ_a (sum[a+d] − sum[a]): all but the first d entries less all but the last d.
        let parts = area[1..=n].iter().zip(area[1..=n].iter().rev());
        for (d, ((first, last), w)) in parts.zip(&mut deletion[1..]).enumerate() {
            let all = (two - first) - last;
            *w = deletion_length(d + 1) * all.max(0.0);
            total += *w;
        }
        self.deletion_sum = total;
    }

    /// τ of C*_{s,t} as f / (Π p^L · Π p^E), each density paired with the geometry term it came through.
    fn contribution(&self, s: usize) -> f64 {
        let k = self.k();
        let l = &self.links;
        let mut c = 1.0;
        if s > 0 {
            c /= l[0].pl;
        }
        for j in 1..s.min(k + 1) {
            c *= l[j - 1].g / l[j].pl;
        }
        if s >= 1 && s <= k {
            c *= l[s - 1].g;
        }
        for e in &l[s.min(k)..k] {
            c *= e.g / e.pe;
        }
        if s <= k {
            c /= l[k].pe;
        }
        c * self.shape_tau * exp2i(self.shape_exp)
    }
}
