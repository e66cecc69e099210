//! Who takes part: every backend with the settings that change its speed.

use crate::accel::obvhs::{Preset, Tree};
use crate::accel::record::Kind;
use crate::accel::{Accel, Embree, EmbreeError, EmbreeOptions, Obvhs, ObvhsOptions, Quality, Ray};
use crate::scene::Geometry;
use rayon::prelude::*;
use std::time::Duration;

/// Rays one thread takes at a time: small enough to share the work evenly, large enough to keep what lies near together.
const PIECE: usize = 1024;

/// A backend with its settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contender {
    /// Embree; `threads` is set for each build.
    Embree(EmbreeOptions),
    /// obvhs.
    Obvhs(ObvhsOptions),
}

impl Contender {
    /// All of them; the first is what the others are compared with: Embree as a render uses it.
    pub fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for quality in [Quality::High, Quality::Medium, Quality::Low] {
            for (robust, compact) in [(true, false), (false, false), (true, true)] {
                all.push(Self::Embree(EmbreeOptions {
                    robust,
                    compact,
                    quality,
                    threads: 0,
                }));
            }
        }
        for tree in [Tree::Wide, Tree::Binary] {
            for preset in Preset::ALL {
                for splits in [false, true] {
                    all.push(Self::Obvhs(ObvhsOptions {
                        tree,
                        preset,
                        splits,
                    }));
                }
            }
        }
        all
    }

    /// The ones worth a look first.
    pub fn few() -> Vec<Self> {
        let keys = [
            "embree-high",
            "embree-medium",
            "embree-low",
            "embree-high-fast",
            "embree-high-compact",
            "obvhs-cwbvh-fast",
            "obvhs-cwbvh-medium",
            "obvhs-cwbvh-very-slow",
            "obvhs-cwbvh-medium-splits",
            "obvhs-bvh2-medium",
        ];
        let all = Self::all();
        let chosen = all.into_iter().filter(|c| keys.contains(&c.key().as_str()));
        chosen.collect()
    }

    /// The contender of this key.
    pub fn by_key(key: &str) -> Option<Self> {
        Self::all().into_iter().find(|c| c.key() == key)
    }

    /// What it is called on the command line and in tables: backend, build, then what differs from a render's settings.
    pub fn key(&self) -> String {
        match self {
            Self::Embree(o) => {
                let quality = match o.quality {
                    Quality::Low => "low",
                    Quality::Medium => "medium",
                    Quality::High => "high",
                };
                let fast = if o.robust { "" } else { "-fast" };
                let compact = if o.compact { "-compact" } else { "" };
                format!("embree-{quality}{fast}{compact}")
            }
            Self::Obvhs(o) => {
                let plain = o.to_string().to_lowercase().replace(", ", "-");
                format!("obvhs-{}", plain.replace(' ', "-"))
            }
        }
    }

    /// Builds with so many threads; the rayon pool it is called in should have as many.
    ///
    /// # Errors
    /// What Embree refuses.
    pub fn build<'a>(
        &self,
        geometry: &'a Geometry,
        threads: usize,
    ) -> Result<Built<'a>, EmbreeError> {
        Ok(match *self {
            Self::Embree(o) => {
                Built::Embree(Embree::new(geometry, EmbreeOptions { threads, ..o })?)
            }
            Self::Obvhs(o) => Built::Obvhs(Obvhs::with_options(geometry, o)),
        })
    }
}

/// A backend that stands.
pub enum Built<'a> {
    /// Embree.
    Embree(Embree<'a>),
    /// obvhs.
    Obvhs(Obvhs<'a>),
}

impl Built<'_> {
    /// Wall time of its build.
    pub fn build_time(&self) -> Duration {
        match self {
            Self::Embree(a) => a.build_time(),
            Self::Obvhs(a) => a.build_time(),
        }
    }

    /// Bytes beside the geometry.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Embree(a) => a.memory_bytes(),
            Self::Obvhs(a) => a.memory_bytes(),
        }
    }

    /// Asks all rays on the threads of the pool it is called in; the number that hit something.
    pub fn ask(&self, kind: Kind, rays: &[Ray]) -> u64 {
        match self {
            Self::Embree(a) => ask(a, kind, rays),
            Self::Obvhs(a) => ask(a, kind, rays),
        }
    }
}

fn ask(accel: &impl Accel, kind: Kind, rays: &[Ray]) -> u64 {
    let piece = |part: &[Ray]| {
        let hits = match kind {
            Kind::Closest => part.iter().filter(|r| accel.nearest(r).is_some()).count(),
            Kind::Any => part.iter().filter(|r| accel.occluded(r)).count(),
        };
        hits as u64
    };
    rays.par_chunks(PIECE).map(piece).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn keys_are_different_and_find_their_contender() {
        let all = Contender::all();
        let keys: BTreeSet<String> = all.iter().map(Contender::key).collect();
        assert_eq!(keys.len(), all.len());
        assert!(all.iter().all(|c| Contender::by_key(&c.key()) == Some(*c)));
        assert_eq!(Contender::few().len(), 10);
        assert_eq!(all[0].key(), "embree-high");
        assert!(Contender::few().contains(&Contender::Obvhs(ObvhsOptions::default())));
    }
}
