//! The densities of all bidirectional strategies that could make a path, and what follows from them: the unweighted
//! contribution and the weights with which sub-paths are deleted.

use super::Path;
use crate::scatter::Mode;

/// p_d1: the probability weight of deleting a sub-path of `d` ≥ 1 edges (Veach 11.4.2).
#[inline]
pub fn deletion_length(d: usize) -> f64 {
    match d {
        1 => 0.25,
        2 => 0.5,
        _ => HALVES[d.min(63)],
    }
}

/// 2^−i, i = 0 … 63; beyond that a sub-path is never deleted at once.
static HALVES: [f64; 64] = {
    let mut t = [1.0; 64];
    let mut i = 1;
    while i < 63 {
        t[i] = t[i - 1] * 0.5;
        i += 1;
    }
    t[63] = 0.0;
    t
};

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
            self.weigh_deletions();
            self.known = true;
        }
        self.sum[self.rho.len()] > 0.0
    }

    fn weigh_strategies(&mut self) {
        let k = self.k();
        // The first strategy whose eye part has positive density; going up from it divides by positive numbers only.
        let mut first = k + 1;
        while first > 0 && self.links[first - 1].pe > 0.0 {
            first -= 1;
        }
        let possible = self.links[..first].iter().all(|l| l.pl > 0.0);
        self.rho.clear();
        self.rho.resize(k + 2, 0.0);
        self.sum.clear();
        self.sum.resize(k + 3, 0.0);
        self.total = 0.0;
        if !possible {
            return;
        }
        let mut scale = 1.0f64;
        let mut p = 1.0;
        for s in first..=k + 1 {
            if self.connects(s) {
                self.rho[s] = p;
            }
            if s <= k {
                p *= self.links[s].pl / self.links[s].pe;
                if p > 1e200 {
                    p *= 1e-200;
                    scale *= 1e-200;
                    self.rho.iter_mut().for_each(|r| *r *= 1e-200);
                }
            }
        }
        self.total = self.contribution(first) * scale;
        let mut acc = 0.0;
        for (sum, r) in self.sum[1..].iter_mut().zip(&self.rho) {
            acc += r;
            *sum = acc;
        }
    }

    /// p_d1·p_d2 summed over the sub-paths of each length.
    fn weigh_deletions(&mut self) {
        let n = self.rho.len();
        self.area.clear();
        let mut acc = 0.0;
        self.area.push(acc);
        for &s in &self.sum {
            acc += s;
            self.area.push(acc);
        }
        self.deletion.clear();
        self.deletion.push(0.0);
        let mut total = 0.0;
        for d in 1..=n {
            // Σ_a (sum[a+d] − sum[a]): all but the first d entries less all but the last d.
            let parts = (acc - self.area[d]) - self.area[n + 1 - d];
            let w = deletion_length(d) * parts.max(0.0);
            self.deletion.push(w);
            total += w;
        }
        self.deletion_sum = total;
    }

    /// A connection (or the absence of one at the ends) is possible after `s` light vertices.
    #[inline]
    fn connects(&self, s: usize) -> bool {
        let k = self.k();
        let specular = |i: usize| i > 0 && i < k && self.links[i].mode != Mode::NonSpecular;
        s == 0 || s == k + 1 || !(specular(s - 1) || specular(s))
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
