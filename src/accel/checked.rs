//! Asks two backends the same, and judges and counts where they differ.

use super::canonical::settled;
use super::record::Kind;
use super::referee::{Class, Fault, judge_nearest, judge_occluded};
use super::{Accel, Ray};
use crate::scene::{Geometry, PrimId};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

/// Leaves out no triangle.
const NOTHING: [PrimId; 2] = [PrimId::NONE; 2];

/// Disagreements that are kept word for word.
const KEPT: usize = 16;
/// Ties whose rays are kept.
const TIES: usize = 1 << 16;

/// How often two backends were asked and disagreed.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Disagreement {
    /// The two.
    pub backends: [String; 2],
    /// Rays asked for the closest hit.
    pub rays_closest: u64,
    /// Rays asked for visibility.
    pub rays_visibility: u64,
    /// Different faces around an edge that the ray passes within the roundings, of which the shared routine then chose
    /// the same for both: hits are the same, bit for bit.
    pub settled: u64,
    /// Different primitives at the same place, also in the hits: coincident faces, edges.
    pub ties: u64,
    /// Those of the ties where each backend, with the primitive that it named left out, names the other's: both find
    /// the same two and only begin with another. 0 where backends cannot leave out ([`Geometry::leave_out`]).
    pub reversed: u64,
    /// Rays of the first ties, to be asked again where backends can.
    #[serde(skip)]
    pub tied: Vec<Ray>,
    /// One of the two takes for a hit what passes an edge or a corner within the roundings.
    pub edges: u64,
    /// The same for a primitive at the very beginning or end of the ray.
    pub ends: u64,
    /// Something surely hit was passed over, by the first and by the second.
    pub missed: [u64; 2],
    /// Something surely not hit was named, by the first and by the second.
    pub false_hits: [u64; 2],
    /// The first of them, wrong ones before others, with the ray as `check-rays --ray` takes it.
    pub first: Vec<String>,
}

impl Disagreement {
    /// Answers that are wrong, not only different.
    pub fn wrong(&self) -> u64 {
        let pairs = self.missed.iter().chain(&self.false_hits);
        pairs.sum()
    }

    /// All differences of hits.
    pub fn different(&self) -> u64 {
        self.ties + self.edges + self.ends + self.wrong()
    }

    /// Part of the rays on which the two name the same primitive at once.
    pub fn same_at_once(&self) -> f64 {
        self.part_but(self.different() + self.settled)
    }

    /// Part of the rays on which the two give the same hit, or find the same two coincident primitives.
    pub fn agreement(&self) -> f64 {
        self.part_but(self.different() - self.reversed)
    }

    fn part_but(&self, differences: u64) -> f64 {
        let rays = (self.rays_closest + self.rays_visibility).max(1);
        1.0 - differences as f64 / rays as f64
    }

    /// For people: a line of counts, then the first differences.
    pub fn lines(&self) -> Vec<String> {
        let [a, b] = &self.backends;
        let mut lines = vec![format!(
            "{} rays asked of {a} and of {b}: {} edges settled alike, {} differences, {} ties ({} of them the same two primitives in \
             another order), {} at edges, {} at ends; {} and {} missed, {} and {} false",
            self.rays_closest + self.rays_visibility,
            self.settled,
            self.different(),
            self.ties,
            self.reversed,
            self.edges,
            self.ends,
            self.missed[0],
            self.missed[1],
            self.false_hits[0],
            self.false_hits[1],
        )];
        lines.extend(self.first.iter().cloned());
        lines
    }
}

/// Answers as `A`, compares with `B`.
pub struct Checked<A, B> {
    first: A,
    second: B,
    closest: AtomicU64,
    visibility: AtomicU64,
    settled: AtomicU64,
    found: Mutex<Found>,
}

#[derive(Default)]
struct Found {
    counts: Disagreement,
    wrong: Vec<String>,
    other: Vec<String>,
}

impl<A: Accel, B: Accel> Checked<A, B> {
    /// Both must be built over the same geometry.
    pub fn new(first: A, second: B) -> Self {
        Self {
            first,
            second,
            closest: AtomicU64::new(0),
            visibility: AtomicU64::new(0),
            settled: AtomicU64::new(0),
            found: Mutex::default(),
        }
    }

    /// The counts so far.
    pub fn disagreement(&self) -> Disagreement {
        let found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        let first = found.wrong.iter().chain(&found.other).take(KEPT);
        Disagreement {
            backends: [self.first.name(), self.second.name()],
            rays_closest: self.closest.load(Relaxed),
            rays_visibility: self.visibility.load(Relaxed),
            settled: self.settled.load(Relaxed),
            first: first.cloned().collect(),
            ..found.counts.clone()
        }
    }

    /// The first of two answers about the nearest primitive.
    fn nearest_of(
        &self,
        ray: &Ray,
        but: [PrimId; 2],
        [a, b]: [Option<PrimId>; 2],
    ) -> Option<PrimId> {
        self.closest.fetch_add(1, Relaxed);
        if a != b {
            if let (Some(a), Some(b)) = (a, b)
                && settled(&self.first, ray, but, a) == settled(&self.second, ray, but, b)
            {
                self.settled.fetch_add(1, Relaxed);
                return Some(a);
            }
            let class = judge_nearest(self.geometry(), ray, but, [a, b]);
            let word = |p: Option<PrimId>| p.map_or("nothing".to_owned(), |p| p.to_string());
            let tie = class == Class::Tie;
            let reversed = tie && self.geometry().leave_out && self.find_both(ray, but, [a, b]);
            self.note(class, reversed, Kind::Closest, ray, [word(a), word(b)]);
        }
        a
    }

    /// Whether each backend finds the other's primitive once its own is left out.
    fn find_both(&self, ray: &Ray, but: [PrimId; 2], [a, b]: [Option<PrimId>; 2]) -> bool {
        // One place beside the one that may be taken already.
        let without = |p: Option<PrimId>| Some([but[0], p?]).filter(|_| but[1] == PrimId::NONE);
        let (Some(not_a), Some(not_b)) = (without(a), without(b)) else {
            return false;
        };
        self.first.nearest_but(ray, not_a) == b && self.second.nearest_but(ray, not_b) == a
    }

    /// The first of two answers about visibility.
    fn occluded_of(&self, ray: &Ray, but: [PrimId; 2], [a, b]: [bool; 2]) -> bool {
        self.visibility.fetch_add(1, Relaxed);
        if a != b {
            let class = judge_occluded(self.geometry(), ray, but, b);
            let word = |o| if o { "occluded" } else { "free" };
            self.note(
                class,
                false,
                Kind::Any,
                ray,
                [word(a).into(), word(b).into()],
            );
        }
        a
    }

    #[cold]
    fn note(&self, class: Class, reversed: bool, kind: Kind, ray: &Ray, answers: [String; 2]) {
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        let c = &mut found.counts;
        let what = match class {
            Class::Tie => {
                c.ties += 1;
                c.reversed += u64::from(reversed);
                if c.tied.len() < TIES {
                    c.tied.push(*ray);
                }
                "tie".to_owned()
            }
            Class::Edge => {
                c.edges += 1;
                "edge".to_owned()
            }
            Class::End => {
                c.ends += 1;
                "end".to_owned()
            }
            Class::Wrong { second, fault } => {
                let (counter, word) = match fault {
                    Fault::Missed => (&mut c.missed, "missed by"),
                    Fault::False => (&mut c.false_hits, "false hit of"),
                };
                counter[usize::from(second)] += 1;
                let name = if second {
                    self.second.name()
                } else {
                    self.first.name()
                };
                format!("{word} {name}")
            }
        };
        let wrong = matches!(class, Class::Wrong { .. });
        let list = if wrong {
            &mut found.wrong
        } else {
            &mut found.other
        };
        if list.len() < KEPT {
            let [a, b] = answers;
            list.push(format!(
                "{what}: --ray {} answered {a} and {b}",
                told(kind, ray)
            ));
        }
    }
}

/// A ray as `check-rays --ray` takes it; every bit is in it.
pub fn told(kind: Kind, ray: &Ray) -> String {
    let kind = match kind {
        Kind::Closest => "closest",
        Kind::Any => "any",
    };
    let (o, d) = (ray.o, ray.d);
    let numbers = [o.x, o.y, o.z, d.x, d.y, d.z, ray.t_max];
    numbers
        .iter()
        .fold(kind.to_owned(), |s, v| format!("{s},{v:?}"))
}

impl<A: Accel, B: Accel> Accel for Checked<A, B> {
    fn geometry(&self) -> &Geometry {
        self.first.geometry()
    }

    fn nearest(&self, ray: &Ray) -> Option<PrimId> {
        let answers = [self.first.nearest(ray), self.second.nearest(ray)];
        self.nearest_of(ray, NOTHING, answers)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let answers = [self.first.occluded(ray), self.second.occluded(ray)];
        self.occluded_of(ray, NOTHING, answers)
    }

    fn nearest_but(&self, ray: &Ray, but: [PrimId; 2]) -> Option<PrimId> {
        let answers = [
            self.first.nearest_but(ray, but),
            self.second.nearest_but(ray, but),
        ];
        self.nearest_of(ray, but, answers)
    }

    fn occluded_but(&self, ray: &Ray, but: [PrimId; 2]) -> bool {
        let answers = [
            self.first.occluded_but(ray, but),
            self.second.occluded_but(ray, but),
        ];
        self.occluded_of(ray, but, answers)
    }

    fn name(&self) -> String {
        format!("{} checked by {}", self.first.name(), self.second.name())
    }

    fn memory_bytes(&self) -> usize {
        self.first.memory_bytes() + self.second.memory_bytes()
    }
}
