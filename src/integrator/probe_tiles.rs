//! What a look at a scene sees on each part of the image.
//!
//! Errors are told relative to the light around them, as the eye sees them: a square root of 64 that a lamp's edge is off
//! matters less than one that a wall is.

use glam::Vec2;

/// Tiles each way of the image.
const TILES: usize = 8;

/// A tile is taken for at least this part of the image's mean, so that black ones do not decide.
const FLOOR: f64 = 0.1;

/// Sums over the samples of one tile.
#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    /// Samples of direct light, and their sum.
    direct: (f64, f64),
    /// Samples of all other light, and their sum.
    indirect: (f64, f64),
}

/// Mean light of a tile: (direct, indirect, the two but no less than a tenth of the image's).
pub(super) type Light = (f64, f64, f64);

/// Three samples of direct light.
#[derive(Clone, Copy, Debug)]
struct Triple {
    tile: usize,
    /// At one raster point.
    point: [f64; 2],
    /// Elsewhere in its pixel.
    beside: f64,
    /// Of the first and the last of them, what does not come from lamps that are seen themselves.
    scattered: [f64; 2],
}

/// The tiles of an image, row by row, and samples on them.
#[derive(Clone, Debug, Default)]
pub(super) struct Tiles {
    tiles: [[Tile; TILES]; TILES],
    triples: Vec<Triple>,
}

impl Tiles {
    /// The other's samples after its own.
    pub fn append(&mut self, o: &mut Self) {
        let mine = self.tiles.as_flattened_mut().iter_mut();
        for (a, b) in mine.zip(o.tiles.as_flattened()) {
            a.direct = (a.direct.0 + b.direct.0, a.direct.1 + b.direct.1);
            a.indirect = (a.indirect.0 + b.indirect.0, a.indirect.1 + b.indirect.1);
        }
        self.triples.append(&mut o.triples);
    }

    /// Takes three samples of direct light at a place of the unit square: two at one raster point, one in the same pixel.
    /// `lamps` is how much of the first and the last comes from lamps that are seen themselves.
    pub fn direct(&mut self, at: Vec2, point: [f64; 2], beside: f64, lamps: [f64; 2]) {
        let tile = tile(at);
        self.triples.push(Triple {
            tile,
            point,
            beside,
            scattered: [point[0] - lamps[0], beside - lamps[1]],
        });
        let (n, sum) = &mut self.tiles.as_flattened_mut()[tile].direct;
        (*n, *sum) = (*n + 3.0, *sum + point[0] + point[1] + beside);
    }

    /// Takes a sample of the other light.
    pub fn indirect(&mut self, at: Vec2, light: f64) {
        let (n, sum) = &mut self.tiles.as_flattened_mut()[tile(at)].indirect;
        (*n, *sum) = (*n + 1.0, *sum + light);
    }

    /// Mean direct and other light of the image.
    pub fn means(&self) -> [f64; 2] {
        let all = self.tiles.as_flattened();
        let mean = |f: fn(&Tile) -> (f64, f64)| {
            let (n, sum) = all
                .iter()
                .map(f)
                .fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
            sum / f64::max(n, 1.0)
        };
        [mean(|t| t.direct), mean(|t| t.indirect)]
    }

    fn lights(&self) -> Vec<Light> {
        let least = FLOOR * self.means().iter().sum::<f64>();
        let mean = |(n, sum): (f64, f64)| sum / n.max(1.0);
        let light = |t: &Tile| {
            let (d, i) = (mean(t.direct), mean(t.indirect));
            (d, i, (d + i).max(least))
        };
        self.tiles.as_flattened().iter().map(light).collect()
    }

    /// Mean of `f` over the tiles; 0 without light.
    pub fn mean(&self, f: impl Fn(Light) -> f64) -> f64 {
        let lights = self.lights();
        let lit = lights[0].2 > 0.0;
        let sum = |l: Vec<Light>| l.into_iter().map(f).sum::<f64>();
        if lit {
            sum(lights) / (TILES * TILES) as f64
        } else {
            0.0
        }
    }

    /// Variance of one sample of direct light at a raster point, relative to the square of its tile's light; and what is
    /// added by sampling anywhere in the pixel, relative to the pixel's own light where that is brighter. At an edge the two
    /// sides are what the pixel consists of, and count 2 at most; a point that is bright once in many samples is not bright.
    /// The edges of lamps themselves do not count: gazes see to them.
    pub fn variances(&self) -> [f64; 2] {
        let lights = self.lights();
        let mean = |triples: &dyn Fn(&Triple) -> f64| {
            self.triples.iter().map(triples).sum::<f64>() / self.triples.len().max(1) as f64
        };
        let relative = |a: f64, b: f64, light: f64| {
            let v = 0.5 * ((a - b) / light).powi(2);
            if light > 0.0 { v } else { 0.0 }
        };
        let noise = |t: &Triple| relative(t.point[0], t.point[1], lights[t.tile].2);
        let own = |t: &Triple, b: f64, [c, d]: [f64; 2]| {
            relative(c, d, lights[t.tile].2.max(0.5 * (t.point[0] + b)))
        };
        let edges = |t: &Triple| own(t, t.beside, t.scattered) - own(t, t.point[1], t.point);
        // A difference of two estimates, so that it may come out below 0 where there is nothing.
        [mean(&noise), mean(&edges).max(0.0)]
    }
}

/// The tile of a place of the unit square.
fn tile(at: Vec2) -> usize {
    let place = |v: f32| ((v * TILES as f32) as usize).min(TILES - 1);
    place(at.y) * TILES + place(at.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall of 1 with a lamp of 30 in one tile; one triple in four passes the lamp's edge, and one in eight noise.
    #[test]
    fn edges_and_noise_are_told_apart() {
        let mut tiles = Tiles::default();
        let wall = Vec2::splat(0.9);
        for i in 0..64 {
            tiles.indirect(wall, 1.0);
            let at = Vec2::new((i % 8) as f32, (i / 8) as f32) / 8.0;
            tiles.indirect(at, 0.0);
            for _ in 0..8 {
                tiles.direct(at, [1.0, 1.0], 1.0, [0.0; 2]);
            }
        }
        let [noise, edges] = tiles.variances();
        assert_eq!([noise, edges], [0.0, 0.0]);
        // Both of a triple's points on one side: no noise, all of it edge, and no more than 2 however bright the lamp.
        let mut edge = tiles.clone();
        edge.direct(Vec2::ZERO, [1.0, 1.0], 1e6, [0.0; 2]);
        let [noise, edges] = edge.variances();
        let n = 513.0;
        assert!(noise == 0.0 && (edges * n - 2.0).abs() < 1e-4, "{edges}");
        // If it is the lamp's own edge, gazes find it.
        let mut lamp = tiles.clone();
        lamp.direct(Vec2::ZERO, [1.0, 1.0], 1e6, [0.0, 1e6 - 1.0]);
        assert_eq!(lamp.variances(), [0.0, 0.0]);
        // A point that is bright once in two samples is noise, relative to the tile's light and not to its own.
        let mut bright = tiles.clone();
        bright.direct(Vec2::ZERO, [100.0, 0.0], 0.0, [0.0; 2]);
        let [noise, _] = bright.variances();
        let light = (24.0 + 100.0) / 27.0;
        assert!((noise * n / (0.5 * (100.0f64 / light).powi(2)) - 1.0).abs() < 1e-12);
    }

    /// Light without spread has range and loss 1; nothing is divided by 0 in the dark.
    #[test]
    fn means_are_over_the_tiles() {
        let mut tiles = Tiles::default();
        assert_eq!(tiles.mean(|(_, _, l)| 1.0 / l), 0.0);
        for i in 0..64 {
            let at = Vec2::new((i % 8) as f32, (i / 8) as f32) / 8.0;
            tiles.indirect(at, if i < 32 { 3.0 } else { 1.0 });
        }
        assert_eq!(tiles.means(), [0.0, 2.0]);
        assert_eq!(tiles.mean(|(d, i, l)| (d + i) * l), 5.0);
        // Less than a tenth of the mean counts as a tenth.
        tiles.indirect(Vec2::ZERO, 1e9);
        let dark = tiles.mean(|(_, i, l)| if i == 1.0 { l } else { 0.0 });
        assert!((dark / (0.5 * 0.1 * (1e9 + 128.0) / 65.0) - 1.0).abs() < 1e-12);
    }
}
