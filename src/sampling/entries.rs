//! Stratified entries for lens sub-paths: raster points that fill the image evenly, each dealt to a few chains
//! (Veach 11.4.4).
//!
//! Chain c's j-th entry is number j·⌈n'/n_e⌉ + ⌊π_j(c)/n_e⌋ with π_j a random permutation of the group's n' chains: each
//! entry goes to n_e different chains, and which it is depends on nothing that another chain does. Numbers run through
//! rounds. In a round every cell of the raster gets the same number of entries, its quota, in the order of a random
//! permutation of all of them: what a rover over full cells finds. Within a cell the point is that of a Poisson-disc
//! pattern, shifted anew for each of the quota's passes over the image, so that every entry is exactly uniform over the
//! raster domain.
//!
//! One chain's entries are not independent of each other: within a round the chance that two of them share a cell of P is
//! lowered from 1/P by 1/(P·quota). Where they would, the second is a second trial of the same change, which succeeds too
//! often by a(1−a) ≤ 1/4; to miss it shifts the chain's law by as much. So the law is off by at most 1/(4·P·quota) for each
//! pair among the entries that the chain's state still remembers. The quota keeps P·quota above [`ROUND`], so that fifty
//! entries remembered, more than a thousand pairs, make 3·10⁻³; between chains dependence does no harm.

use super::permutation::at_each;
use super::poisson::{Pattern, TILE};
use super::{Permutation, Rng};
use crate::real::{Convert, Real, Vec2};
use glam::DVec2;

/// Least number of entries in a round.
pub const ROUND: u64 = 100_000;

/// Whose entries: all chains with the same key are dealt from the same rounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Table {
    /// Seed of the run.
    pub seed: u64,
    /// Stage of the random streams.
    pub stage: u32,
    /// Group of chains.
    pub group: u32,
    /// Generation of the group.
    pub generation: u32,
    /// n': chains of the group.
    pub chains: u32,
    /// n_e: chains that get the same entry.
    pub uses: u32,
}

/// The raster domain cut into equal cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cells {
    lo: Vec2,
    hi: Vec2,
    /// Corner of the first cell; cells that reach over the upper border go on at the lower one.
    corner: DVec2,
    size: DVec2,
    count: [u64; 2],
}

impl Cells {
    /// Of the domain from `lo` to `hi`, pixels: as many cells as it has pixels. If a filter makes it a whole number of
    /// pixels wide, the cells are the pixels, those cut by opposite borders making one together.
    pub fn new(lo: Vec2, hi: Vec2) -> Self {
        let side = |lo: Real, hi: Real| {
            let width = f64::from(hi) - f64::from(lo);
            let n = width.round().max(1.0);
            let corner = if width == n { lo.ceil() } else { lo };
            (n as u64, width / n, f64::from(corner))
        };
        let (x, y) = (side(lo.x, hi.x), side(lo.y, hi.y));
        Self {
            lo,
            hi,
            corner: DVec2::new(x.2, y.2),
            size: DVec2::new(x.1, y.1),
            count: [x.0, y.0],
        }
    }

    /// Number of cells.
    pub fn len(&self) -> u64 {
        self.count[0] * self.count[1]
    }

    /// Never: a domain has a cell.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// The raster point at `u` in [0, 1)² of cell (x, y).
    #[inline]
    fn point(&self, [x, y]: [u64; 2], u: DVec2) -> Vec2 {
        let at = DVec2::new(x as f64, y as f64);
        let end = (self.corner + (at + 1.0) * self.size).real();
        let p = (self.corner + (at + u) * self.size).real();
        // Rounding to single precision may reach the next cell.
        let p = p.min(Vec2::new(end.x.next_down(), end.y.next_down()));
        Vec2::select(p.cmpge(self.hi), p - (self.hi - self.lo), p).max(self.lo)
    }
}

/// One entry.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Its number.
    pub number: u64,
    /// Raster point, pixels.
    pub raster: Vec2,
    /// For the rest of the lens sub-path: aperture, modes.
    pub rng: Rng,
}

/// The entries of one chain.
#[derive(Clone, Debug)]
pub struct Entries {
    table: Table,
    chain: u32,
    cells: Cells,
    quota: u64,
    pattern: &'static Pattern,
    /// The table's stream, before its step is chosen.
    base: Rng,
    /// The round last dealt from, and its order.
    rover: (u64, Permutation),
    /// j / [`AHEAD`] of the entries looked up last, and where they stand.
    ahead: (u64, [Place; AHEAD]),
    /// j: entries dealt.
    pub dealt: u64,
}

/// Entries looked up at once.
const AHEAD: usize = 8;

/// Where an entry stands in its round's order.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    number: u64,
    round: u64,
    place: u64,
}

/// What a stream of the table is for. Streams of one table differ by their step: a number of this kind.
#[derive(Clone, Copy)]
enum Use {
    Entry,
    Round,
    Pass,
    Chains,
}

impl Entries {
    /// Those of chain number `chain` < `table.chains`.
    pub fn new(table: Table, chain: u32, cells: Cells) -> Self {
        assert!(chain < table.chains && table.uses > 0);
        let quota = ROUND.div_ceil(cells.len());
        let base = Rng::new(table.seed, table.stage, table.group, table.generation);
        let order = Permutation::new(cells.len() * quota, &mut stream(base, Use::Round, 0));
        Self {
            table,
            chain,
            cells,
            quota,
            pattern: Pattern::get(),
            base,
            rover: (0, order),
            ahead: (u64::MAX, [Place::default(); AHEAD]),
            dealt: 0,
        }
    }

    /// Entries of each cell in a round.
    pub fn quota(&self) -> u64 {
        self.quota
    }

    /// The chain's next entry.
    #[inline]
    pub fn deal(&mut self) -> Entry {
        let j = self.dealt;
        self.dealt += 1;
        let batch = j / AHEAD as u64;
        if self.ahead.0 != batch {
            self.look_ahead(batch);
        }
        self.entry(self.ahead.1[j as usize % AHEAD])
    }

    /// Finds the places of [`AHEAD`] entries.
    #[inline(never)]
    fn look_ahead(&mut self, batch: u64) {
        let Table { chains, uses, .. } = self.table;
        let js: [u64; AHEAD] = std::array::from_fn(|i| batch * AHEAD as u64 + i as u64);
        let orders =
            js.map(|j| Permutation::new(u64::from(chains), &mut self.stream(Use::Chains, j)));
        let dealt = at_each(&orders, u64::from(self.chain));
        let numbers = std::array::from_fn(|i| {
            js[i] * u64::from(chains.div_ceil(uses)) + dealt[i] / u64::from(uses)
        });
        self.ahead = (batch, self.places(numbers));
    }

    /// Where entries stand, their numbers rising.
    fn places<const B: usize>(&mut self, numbers: [u64; B]) -> [Place; B] {
        let length = self.cells.len() * self.quota;
        let round = numbers[0] / length;
        if numbers[B - 1] / length != round {
            return numbers.map(|n| self.places([n])[0]);
        }
        if self.rover.0 != round {
            let mut rng = self.stream(Use::Round, round);
            self.rover = (round, Permutation::new(length, &mut rng));
        }
        let places = self.rover.1.at_all(numbers.map(|n| n % length));
        std::array::from_fn(|i| Place {
            number: numbers[i],
            round,
            place: places[i],
        })
    }

    #[inline]
    fn entry(
        &self,
        Place {
            number,
            round,
            place,
        }: Place,
    ) -> Entry {
        let cells = self.cells.len();
        let (pass, cell) = (place / cells, place % cells);
        let cell = [cell % self.cells.count[0], cell / self.cells.count[0]];
        let mut shift = self.stream(Use::Pass, round * self.quota + pass);
        let (dx, dy) = (shift.next_below(TILE as u64), shift.next_below(TILE as u64));
        let [px, py] = self.pattern.part(cell[0] + dx, cell[1] + dy);
        let part = DVec2::new(f64::from(px), f64::from(py));
        let u = (part + shift.next_dvec2()) / TILE as f64;
        Entry {
            number,
            raster: self.cells.point(cell, u),
            rng: self.stream(Use::Entry, number),
        }
    }

    #[inline]
    fn stream(&self, what: Use, n: u64) -> Rng {
        stream(self.base, what, n)
    }
}

#[inline]
fn stream(mut base: Rng, what: Use, n: u64) -> Rng {
    base.set_step(n * 4 + what as u64);
    base
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    use std::collections::BTreeMap;

    fn table(group: u32, chains: u32, uses: u32) -> Table {
        Table {
            seed: 7,
            stage: 6,
            group,
            generation: 0,
            chains,
            uses,
        }
    }

    fn all(table: Table, cells: Cells) -> Vec<Entries> {
        let of = |c| Entries::new(table, c, cells);
        (0..table.chains).map(of).collect()
    }

    #[test]
    fn each_entry_goes_to_as_many_different_chains_as_it_should() {
        let cells = Cells::new(Vec2::ZERO, Vec2::splat(8.0));
        for (chains, uses) in [(16, 2), (16, 4), (15, 2), (5, 1)] {
            let mut entries = all(table(0, chains, uses), cells);
            let mut owners: BTreeMap<u64, Vec<(usize, Vec2)>> = BTreeMap::new();
            let steps = 500;
            // In any order: one chain runs ahead of the others.
            for (c, e) in entries.iter_mut().enumerate().rev() {
                for _ in 0..steps {
                    let d = e.deal();
                    owners.entry(d.number).or_default().push((c, d.raster));
                }
            }
            let each = chains.div_ceil(uses) as u64;
            assert!(owners.keys().copied().eq(0..steps * each));
            for (number, o) in &owners {
                // The last of a step takes the chains that are left.
                let left = chains - uses * (number % each) as u32;
                assert_eq!(o.len(), left.min(uses) as usize, "entry {number}");
                assert!(o.windows(2).all(|w| w[0].0 != w[1].0 && w[0].1 == w[1].1));
            }
            // The same chains do not always go together.
            let pairs = |c: usize| owners.values().filter(move |o| o.iter().any(|o| o.0 == c));
            let partners: std::collections::BTreeSet<usize> =
                pairs(0).flatten().map(|o| o.0).collect();
            assert!(uses == 1 || partners.len() == chains as usize);
        }
    }

    /// Every pixel gets its quota in every round, whatever the filter adds around the image.
    #[test]
    fn every_pixel_gets_its_quota_in_a_round() {
        for (radius, size) in [
            (0.5 as Real, [37u64, 23u64]),
            (1.5, [20, 31]),
            (2.0, [24, 10]),
        ] {
            let (lo, hi) = (
                Vec2::splat(0.5 - radius),
                Vec2::new(size[0] as Real, size[1] as Real) + radius - 0.5,
            );
            let cells = Cells::new(lo, hi);
            let mut one = Entries::new(table(1, 1, 1), 0, cells);
            let round = cells.len() * one.quota();
            assert!(round >= ROUND && round < ROUND + cells.len());
            for _ in 0..2 {
                let mut counts: BTreeMap<[i32; 2], u64> = BTreeMap::new();
                for _ in 0..round {
                    let r = one.deal().raster;
                    assert!(r.cmpge(lo).all() && r.cmplt(hi).all(), "{r}");
                    *counts.entry(r.floor().as_ivec2().to_array()).or_default() += 1;
                }
                let inner = counts.iter().filter(|(p, _)| {
                    let p = p.map(|v| v as Real);
                    p[0] >= lo.x && p[1] >= lo.y && p[0] + 1.0 <= hi.x && p[1] + 1.0 <= hi.y
                });
                let mut seen = 0;
                for (pixel, n) in inner {
                    assert_eq!(*n, one.quota(), "pixel {pixel:?}, radius {radius}");
                    seen += 1;
                }
                assert!(seen >= size[0] * size[1]);
            }
        }
        // Where pixels do not divide the domain, cells of nearly a pixel do.
        let cells = Cells::new(Vec2::splat(-0.8), Vec2::new(10.8, 20.8));
        assert_eq!(cells.len(), 12 * 22);
    }

    /// Entry number 5 of many tables: uniform over the domain, and within the pixel. A part of 1024 that is 5 % off
    /// everywhere on half of the domain adds 0.05²·10⁶ = 2500 to a statistic of mean 1023 and deviation 45.
    #[test]
    fn an_entry_is_uniform_over_the_domain() {
        let (lo, hi) = (Vec2::splat(-0.5), Vec2::new(6.5, 5.5));
        let cells = Cells::new(lo, hi);
        let runs = 1_000_000u32;
        let mut counts = [vec![0u32; 1024], vec![0u32; 1024]];
        let cell = |u: Vec2| (u.x * 32.0) as usize + 32 * (u.y * 32.0) as usize;
        for group in 0..runs {
            let mut e = Entries::new(table(group, 4, 2), 1, cells);
            let [place] = e.places([5]);
            let r = e.entry(place).raster;
            counts[0][cell((r - lo) / (hi - lo))] += 1;
            counts[1][cell(r - r.floor())] += 1;
        }
        let level = 1.0 - 0.99f64.powf(0.5);
        for c in counts {
            let e = f64::from(runs) / 1024.0;
            let x2: f64 = c.iter().map(|&n| (f64::from(n) - e).powi(2) / e).sum();
            let p = ChiSquared::new(1023.0).expect("positive").sf(x2);
            assert!(p > level, "χ² = {x2}, p = {p}");
        }
    }

    /// Each pass over the image keeps the pattern's distances.
    #[test]
    fn points_of_a_pass_lie_apart() {
        let cells = Cells::new(Vec2::ZERO, Vec2::new(320.0, 320.0));
        let mut one = Entries::new(table(2, 1, 1), 0, cells);
        assert_eq!(one.quota(), 1);
        let points: Vec<Vec2> = (0..cells.len()).map(|_| one.deal().raster).collect();
        let mut at = vec![Vec2::NAN; cells.len() as usize];
        for p in points {
            at[p.x as usize + 320 * p.y as usize] = p;
        }
        let mut least = Real::INFINITY;
        for y in 0..320i32 {
            for x in 0..320i32 {
                for (dx, dy) in [(1, 0), (-1, 1), (0, 1), (1, 1)] {
                    let (i, j) = (x + dx, y + dy);
                    if (0..320).contains(&i) && j < 320 {
                        let at = |x: i32, y: i32| at[(x + 320 * y) as usize];
                        least = least.min(at(x, y).distance(at(i, j)));
                    }
                }
            }
        }
        println!("least distance {least} pixels");
        assert!(least > 0.6, "{least}");
    }
}
