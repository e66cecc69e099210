//! Where in a run a value that cannot be was met, so that the very same work can be done again.

use serde::Serialize;
use std::collections::BTreeSet;
use std::sync::Mutex;

/// A piece of work that is a pure function of the scene, the settings and these numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Site {
    /// A seeding sample.
    Seed {
        /// Generation.
        generation: u32,
        /// Group.
        group: u32,
        /// Number of the sample in the group's batch.
        sample: u32,
    },
    /// Steps of a chain.
    Step {
        /// Generation.
        generation: u32,
        /// Group.
        group: u32,
        /// Number of the chain in its group.
        chain: u32,
        /// First step, counted from the chain's start.
        step: u64,
        /// How many: 1 unless it is not known better.
        steps: u64,
    },
    /// A camera sample of a pixel.
    Pixel {
        /// Of the direct-lighting pass beside chains.
        direct: bool,
        /// Column and row.
        pixel: [u32; 2],
        /// Number of the sample in its pixel.
        sample: u64,
    },
}

/// Sites kept at most: the first ones, in the order of [`Site`], so that threads leave no trace.
const KEPT: usize = 8;

/// The sites of a run.
#[derive(Debug, Default)]
pub struct Sites(Mutex<BTreeSet<Site>>);

impl Sites {
    /// Remembers a site.
    #[cold]
    pub fn note(&self, site: Site) {
        let mut all = self.0.lock().expect("no thread panicked");
        all.insert(site);
        if all.len() > KEPT {
            all.pop_last();
        }
    }

    /// The first sites, at most 8.
    pub fn first(&self) -> Vec<Site> {
        let all = self.0.lock().expect("no thread panicked");
        all.iter().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_sites_are_kept_whatever_the_order() {
        let site = |step| Site::Step {
            generation: 0,
            group: 1,
            chain: 2,
            step,
            steps: 1,
        };
        let (a, b) = (Sites::default(), Sites::default());
        (0..100).for_each(|i| a.note(site(i)));
        (0..100).rev().for_each(|i| b.note(site(i)));
        assert_eq!(a.first(), b.first());
        assert_eq!(a.first(), (0..8).map(site).collect::<Vec<_>>());
    }
}
