//! A pattern of points for tiling the image: one in each pixel of the tile, none near another.

use super::Rng;
use std::sync::LazyLock;

/// Pixels of the tile each way; also the parts into which a pixel is cut each way.
pub const TILE: usize = 16;

/// Exchanges tried while the pattern is made.
const EXCHANGES: u64 = 60_000;

/// Points of a tile that repeats for ever: one in each of TILE × TILE pixels, each in another of the TILE × TILE parts of
/// its pixel.
///
/// Because every part occurs once, a uniform shift by whole pixels takes the point of any fixed pixel to all parts alike;
/// with a uniform shift below the size of a part besides, its density is exactly uniform. Neither shift changes a
/// distance.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Part of each pixel, row by row.
    parts: [[u8; 2]; TILE * TILE],
}

impl Pattern {
    /// The one pattern; making it takes some milliseconds, once.
    pub fn get() -> &'static Self {
        static PATTERN: LazyLock<Pattern> = LazyLock::new(Pattern::make);
        &PATTERN
    }

    /// The part that holds the point of pixel (x, y) of the endless tiling.
    #[inline]
    pub fn part(&self, x: u64, y: u64) -> [u8; 2] {
        self.parts[(y as usize % TILE) * TILE + x as usize % TILE]
    }

    /// A random arrangement of the parts; then pairs change places wherever that does not bring a point nearer to its
    /// neighbours than the nearer of the two was.
    fn make() -> Self {
        let mut rng = Rng::new(0x705_55aa, 0, 0, 0);
        let mut p = Self {
            parts: std::array::from_fn(|i| [(i % TILE) as u8, (i / TILE) as u8]),
        };
        let any = |rng: &mut Rng| rng.next_below((TILE * TILE) as u64) as usize;
        for i in (1..TILE * TILE).rev() {
            p.parts.swap(i, rng.next_below(i as u64 + 1) as usize);
        }
        for _ in 0..EXCHANGES {
            let (i, j) = (any(&mut rng), any(&mut rng));
            let before = p.nearest(i).min(p.nearest(j));
            p.parts.swap(i, j);
            if p.nearest(i).min(p.nearest(j)) < before {
                p.parts.swap(i, j);
            }
        }
        p
    }

    /// Squared distance from the point of pixel `i` to its nearest neighbour, in parts.
    fn nearest(&self, i: usize) -> i32 {
        let t = TILE as i32;
        let (x, y) = (i as i32 % t, i as i32 / t);
        let [u, v] = self.parts[i];
        let mut least = i32::MAX;
        for dy in -2..=2 {
            for dx in -2..=2 {
                if (dx, dy) != (0, 0) {
                    let other = (y + dy).rem_euclid(t) * t + (x + dx).rem_euclid(t);
                    let [a, b] = self.parts[other as usize];
                    let (px, py) = (dx * t + a as i32 - u as i32, dy * t + b as i32 - v as i32);
                    least = least.min(px * px + py * py);
                }
            }
        }
        least
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_occurs_once() {
        let mut parts = Pattern::get().parts.to_vec();
        parts.sort_unstable();
        parts.dedup();
        assert_eq!(parts.len(), TILE * TILE);
    }

    /// Jittered points lie 0.05 pixels apart somewhere in a tile; a hexagonal grid, the best there is, 1.07.
    #[test]
    fn points_keep_their_distance() {
        let p = Pattern::get();
        let least = (0..TILE * TILE).map(|i| p.nearest(i)).min();
        let distance = f64::from(least.expect("points")).sqrt() / TILE as f64;
        println!("least distance {distance:.3} pixels");
        assert!(distance > 0.6, "{distance}");
    }
}
