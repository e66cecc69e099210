//! Which part of a render's work sums hold, when machines share it.

use super::{Malformed, Reader, Writer};
use std::io;

/// Some of `of` equal parts of the work.
///
/// A block of work goes to a part by its place among all blocks, a pixel by a threshold that is uniform over the seeds.
/// Neither depends on how long the render is, so that a longer one is cut in the same way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shards {
    of: u32,
    /// Ascending.
    here: Vec<u32>,
}

/// Most parts a render is cut into.
pub const MOST_SHARDS: u32 = 65536;

impl Default for Shards {
    /// All the work.
    fn default() -> Self {
        Self::one(0, 1)
    }
}

impl Shards {
    /// Part number `index` < `of` alone.
    pub fn one(index: u32, of: u32) -> Self {
        assert!(index < of && of <= MOST_SHARDS);
        Self {
            of,
            here: vec![index],
        }
    }

    /// Nothing is missing.
    pub fn is_whole(&self) -> bool {
        self.here.len() == self.of as usize
    }

    /// Into how many parts the work is cut.
    pub fn of(&self) -> u32 {
        self.of
    }

    /// Numbers of the parts that are here, from 0, ascending.
    pub fn here(&self) -> &[u32] {
        &self.here
    }

    /// Numbers of the parts that are not.
    pub fn missing(&self) -> impl Iterator<Item = u32> {
        (0..self.of).filter(|i| self.here.binary_search(i).is_err())
    }

    /// Part of the work that is here.
    pub fn portion(&self) -> f64 {
        self.here.len() as f64 / self.of as f64
    }

    /// Block number `block` of `blocks` is here.
    pub fn has_block(&self, block: u32, blocks: u32) -> bool {
        let part = block as u64 * self.of as u64 / blocks.max(1) as u64;
        self.has(part as u32)
    }

    /// What has the threshold `t`, in units of 2⁻³², is here.
    #[inline]
    pub fn has_threshold(&self, t: u32) -> bool {
        self.has(((t as u64 * self.of as u64) >> 32) as u32)
    }

    #[inline]
    fn has(&self, part: u32) -> bool {
        self.of == 1 || self.here.binary_search(&part).is_ok()
    }

    /// Takes in the parts of another render of the same cut.
    ///
    /// # Errors
    /// Another cut, or a part that is here already.
    pub fn merge(&mut self, other: &Self) -> Result<(), Malformed> {
        if self.of != other.of {
            return Err(Malformed(format!(
                "is of a render cut into {} parts, the others into {}",
                other.of, self.of
            )));
        }
        if let Some(twice) = other.here.iter().find(|i| self.has(**i)) {
            return Err(Malformed(format!(
                "holds part {}/{}, which is there already",
                twice + 1,
                self.of
            )));
        }
        self.here.extend(&other.here);
        self.here.sort_unstable();
        if self.is_whole() {
            *self = Self::default();
        }
        Ok(())
    }

    /// Writes which parts are here.
    pub fn save(&self, w: &mut Writer) -> io::Result<()> {
        w.u32(self.of)?;
        w.u32(self.here.len() as u32)?;
        self.here.iter().try_for_each(|i| w.u32(*i))
    }

    /// What [`Self::save`] wrote.
    pub fn read(r: &mut Reader) -> Result<Self, Malformed> {
        let of = r.u32()?;
        let n = r.count(4)?;
        let here = (0..n).map(|_| r.u32()).collect::<Result<Vec<_>, _>>()?;
        let rises = here.windows(2).all(|w| w[0] < w[1]);
        if here.is_empty() || !rises || here[n - 1] >= of || of > MOST_SHARDS {
            return Err(Malformed(format!("names parts {here:?} of {of}")));
        }
        Ok(Self { of, here })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_block_and_threshold_is_in_one_part() {
        for of in [1, 2, 3, 7, 16, 300] {
            let parts: Vec<Shards> = (0..of).map(|i| Shards::one(i, of)).collect();
            let owners = |f: &dyn Fn(&Shards) -> bool| parts.iter().filter(|p| f(p)).count();
            for block in 0..256 {
                assert_eq!(owners(&|p| p.has_block(block, 256)), 1);
                let t = block.wrapping_mul(0x9e37_79b9);
                assert_eq!(owners(&|p| p.has_threshold(t)), 1);
            }
            let mut all = parts[0].clone();
            for p in parts[1..].iter().rev() {
                assert!(!all.is_whole() && all.merge(p).is_ok());
            }
            assert_eq!(all, Shards::default());
        }
    }

    #[test]
    fn strangers_and_doubles_are_refused() {
        let mut a = Shards::one(1, 3);
        assert!(a.merge(&Shards::one(1, 3)).is_err());
        assert!(a.merge(&Shards::one(1, 4)).is_err());
        assert!(a.merge(&Shards::one(2, 3)).is_ok());
        assert_eq!(a.missing().collect::<Vec<_>>(), [0]);
        assert_eq!(a.portion(), 2.0 / 3.0);
    }
}
