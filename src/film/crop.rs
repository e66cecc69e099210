//! The pixel rectangle a film covers.

use super::{Malformed, Reader, Writer};
use glam::Vec2;
use std::io;

/// A half-open rectangle of pixels of the full image; pixel (x, y) covers `[x, x+1) × [y, y+1)` of the raster.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// One past the last column.
    pub x1: u32,
    /// One past the last row.
    pub y1: u32,
}

impl From<[u32; 4]> for Crop {
    /// From x0, y0, x1, y1, as the camera stores it. An end before its start makes an empty rectangle.
    fn from([x0, y0, x1, y1]: [u32; 4]) -> Self {
        Self {
            x0,
            y0,
            x1: x1.max(x0),
            y1: y1.max(y0),
        }
    }
}

impl Crop {
    /// Columns.
    pub fn width(&self) -> usize {
        (self.x1 - self.x0) as usize
    }

    /// Rows.
    pub fn height(&self) -> usize {
        (self.y1 - self.y0) as usize
    }

    /// Pixels.
    pub fn pixels(&self) -> usize {
        self.width() * self.height()
    }

    /// Row-major index of an image pixel, if inside.
    #[inline]
    pub fn index(&self, x: i64, y: i64) -> Option<usize> {
        let (cx, cy) = (x - self.x0 as i64, y - self.y0 as i64);
        (cx >= 0 && cy >= 0 && cx < self.width() as i64 && cy < self.height() as i64)
            .then(|| cy as usize * self.width() + cx as usize)
    }

    /// What of the `n` pixels from (x, y) on in their row is inside: how many are not before the first one that is, the
    /// index of that, and how many are.
    #[inline]
    pub fn stretch(&self, x: i64, n: usize, y: i64) -> (usize, usize, usize) {
        let (cx, cy) = (x - self.x0 as i64, y - self.y0 as i64);
        let (lo, hi) = (cx.max(0), (cx + n as i64).min(self.width() as i64));
        if cy < 0 || cy >= self.height() as i64 || lo >= hi {
            return (0, 0, 0);
        }
        (
            (lo - cx) as usize,
            cy as usize * self.width() + lo as usize,
            (hi - lo) as usize,
        )
    }

    /// Writes the corners.
    pub fn save(&self, w: &mut Writer) -> io::Result<()> {
        [self.x0, self.y0, self.x1, self.y1]
            .into_iter()
            .try_for_each(|v| w.u32(v))
    }

    /// What [`Self::save`] wrote: not empty.
    pub fn read(r: &mut Reader) -> Result<Self, Malformed> {
        let [x0, y0, x1, y1] = [r.u32()?, r.u32()?, r.u32()?, r.u32()?];
        // A film is indexed by 32 bits.
        let pixels = (x1.saturating_sub(x0) as u64).checked_mul(y1.saturating_sub(y0) as u64);
        if !pixels.is_some_and(|n| n > 0 && n <= u32::MAX as u64) {
            return Err(Malformed(format!("claims pixels {x0},{y0} to {x1},{y1}")));
        }
        Ok(Self { x0, y0, x1, y1 })
    }

    /// The raster domain: lower and upper corner of the crop dilated by a filter's radius. Every point that can touch a
    /// pixel of the crop lies inside.
    pub fn domain(&self, radius: [f32; 2]) -> (Vec2, Vec2) {
        let r = Vec2::from(radius) - 0.5;
        (
            Vec2::new(self.x0 as f32, self.y0 as f32) - r.max(Vec2::ZERO),
            Vec2::new(self.x1 as f32, self.y1 as f32) + r.max(Vec2::ZERO),
        )
    }
}
