//! What the samples of a pixel have added up, so that they tell their own variance.

/// Blocks of consecutive samples that are told apart.
const BLOCKS: usize = 8;

/// What the samples of a pixel have added up.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PixelSums {
    /// Σ w·X, w·Y, w·Z.
    pub xyz: [f64; 3],
    /// Σ w·Y of each block. Blocks are as long as a power of two and as short as goes with [`BLOCKS`] of them: n samples make
    /// whole blocks of [`block`]`(n)`, at least half of [`BLOCKS`] of them if there are so many samples, and one that is not
    /// whole yet.
    pub blocks: [f32; BLOCKS],
}

impl PixelSums {
    /// Adds sample number `i`.
    #[inline]
    pub fn add(&mut self, i: u64, xyz: [f64; 3]) {
        for (sum, v) in self.xyz.iter_mut().zip(xyz) {
            *sum += v;
        }
        let size = block(i + 1);
        if size > block(i) {
            // All blocks are whole: two make one.
            let whole = self.blocks;
            self.blocks = std::array::from_fn(|b| match whole.get(2 * b..2 * b + 2) {
                Some(two) => two[0] + two[1],
                None => 0.0,
            });
        }
        self.blocks[(i / size) as usize] += xyz[1] as f32;
    }

    /// How many bytes are saved.
    pub const BYTES: usize = 3 * 8 + BLOCKS * 4;

    /// Adds all of it, as it is saved.
    pub fn append(&self, bytes: &mut Vec<u8>) {
        let xyz = self.xyz.iter();
        xyz.for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()));
        let blocks = self.blocks.iter();
        blocks.for_each(|v| bytes.extend_from_slice(&v.to_le_bytes()));
    }

    /// What [`Self::append`] added.
    pub fn of_bytes(all: &[u8; Self::BYTES]) -> Self {
        let (xyz, blocks) = all.split_at(3 * 8);
        let (xyz, blocks) = (xyz.as_chunks().0, blocks.as_chunks().0);
        Self {
            xyz: std::array::from_fn(|c| f64::from_le_bytes(xyz[c])),
            blocks: std::array::from_fn(|b| f32::from_le_bytes(blocks[b])),
        }
    }

    /// Σ w·Y of each whole block of `n` samples, and the samples of a block.
    pub fn whole(&self, n: u64) -> (impl Iterator<Item = f64> + Clone + '_, u64) {
        let whole = whole_blocks(n) as usize;
        let sums = self.blocks[..whole].iter().map(|v| f64::from(*v));
        (sums, block(n))
    }
}

/// Whole blocks of `n` samples.
pub(super) fn whole_blocks(n: u64) -> u64 {
    n / block(n)
}

/// Samples of a block of `n`.
#[inline]
fn block(n: u64) -> u64 {
    (n.next_power_of_two() / BLOCKS as u64).max(1)
}
