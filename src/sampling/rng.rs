//! Counter-based random streams: every number is a pure function of (seed, stage, group, chain, step, draw), so work
//! may be cut and resumed anywhere and still see the same numbers (the idea of Salmon et al. 2011).

use crate::real::{Real, Vec2};
use glam::DVec2;
use std::convert::Infallible;

/// Odd, with about as many ones as zeros in every byte: the stride between the draws of a step.
const STRIDE: u64 = 0xa076_1d64_78bd_642f;

/// One random stream.
///
/// A step starts at a hash of its number; its n-th draw is the folded 128-bit product of that start plus n strides with
/// itself under a second key (the construction of Wang Yi's wyrand). Two streams whose starts lie a few strides apart
/// still differ by the second key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rng {
    key: [u64; 2],
    state: u64,
}

impl Rng {
    /// The stream of one chain (or pixel block, or sample range) of one group in one stage of a render, at step 0.
    pub fn new(seed: u64, stage: u32, group: u32, chain: u32) -> Self {
        let absorb = |iv: u64| {
            [stage, group, chain]
                .iter()
                .fold(mix(seed ^ iv), |h, &w| mix(h.wrapping_add(u64::from(w))))
        };
        let mut rng = Self {
            key: [absorb(0x243f_6a88_85a3_08d3), absorb(0x1319_8a2e_0370_7344)],
            state: 0,
        };
        rng.set_step(0);
        rng
    }

    /// Jumps to the first draw of `step`.
    #[inline]
    pub fn set_step(&mut self, step: u64) {
        // The golden-ratio stride spreads neighbouring steps over all bits before they are mixed.
        self.state = mix(step
            .wrapping_mul(0x9e37_79b9_7f4a_7c15)
            .wrapping_add(self.key[0]));
    }

    /// Passes over `n` draws at no cost.
    #[inline]
    pub fn skip(&mut self, n: u32) {
        self.state = self.state.wrapping_add(STRIDE.wrapping_mul(u64::from(n)));
    }

    /// 64 random bits.
    #[inline]
    pub fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(STRIDE);
        let product = u128::from(self.state) * u128::from(self.state ^ self.key[1]);
        (product >> 64) as u64 ^ product as u64
    }

    /// 32 random bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        (self.next_u64() >> 32) as u32
    }

    /// Uniform in [0, 1), a multiple of 2⁻²⁴.
    #[inline]
    pub fn next_f32(&mut self) -> Real {
        unit24(self.next_u64() >> 40)
    }

    /// Uniform in [0, 1), a multiple of 2⁻⁵³.
    #[inline]
    pub fn next_f64(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in [0, 1)², 24 bits a coordinate, from one draw.
    #[inline]
    pub fn next_vec2(&mut self) -> Vec2 {
        let b = self.next_u64();
        Vec2::new(unit24(b >> 40), unit24((b >> 8) & 0xff_ffff))
    }

    /// Uniform in [0, 1)², 53 bits a coordinate, from two draws.
    #[inline]
    pub fn next_dvec2(&mut self) -> DVec2 {
        DVec2::new(self.next_f64(), self.next_f64())
    }

    /// Uniform in 0..n for n > 0, without bias beyond n/2⁶⁴.
    #[inline]
    pub fn next_below(&mut self, n: u64) -> u64 {
        ((u128::from(self.next_u64()) * u128::from(n)) >> 64) as u64
    }
}

impl rand::TryRng for Rng {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.next_u32())
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(self.next_u64())
    }

    fn try_fill_bytes(&mut self, dst: &mut [u8]) -> Result<(), Infallible> {
        for part in dst.chunks_mut(8) {
            part.copy_from_slice(&self.next_u64().to_le_bytes()[..part.len()]);
        }
        Ok(())
    }
}

#[inline]
fn unit24(bits: u64) -> Real {
    bits as Real * (1.0 / (1 << 24) as Real)
}

/// A bijection of 64-bit words in which every input bit flips every output bit with probability near 1/2
/// (multipliers and shifts: Stafford's variant 13 of the MurmurHash3 finaliser).
#[inline]
pub fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ChiSquared, ContinuousCDF};

    /// p-value of counts against equal expectations.
    fn p_uniform(counts: &[u64]) -> f64 {
        let n: u64 = counts.iter().sum();
        let e = n as f64 / counts.len() as f64;
        let x2: f64 = counts.iter().map(|&c| (c as f64 - e).powi(2) / e).sum();
        ChiSquared::new((counts.len() - 1) as f64).unwrap().sf(x2)
    }

    /// Family-wise level 1 % over the eight statistics below.
    fn level() -> f64 {
        1.0 - 0.99f64.powf(1.0 / 8.0)
    }

    #[test]
    fn numbers_are_equidistributed_in_one_and_two_dimensions_along_and_across_streams() {
        const N: u32 = 1 << 18;
        type Draw = fn(u32) -> (Real, Real);
        let draws: [Draw; 4] = [
            // Along a step, across steps, across chains, across seeds.
            |i| {
                let mut r = Rng::new(1, 2, 3, 4);
                r.skip(2 * i);
                (r.next_f32(), r.next_f32())
            },
            |i| {
                let mut r = Rng::new(1, 2, 3, 4);
                r.set_step(u64::from(i));
                let v = r.next_vec2();
                (v.x, v.y)
            },
            |i| {
                let mut r = Rng::new(1, 2, 3, i);
                (r.next_f32(), r.next_f32())
            },
            |i| {
                let mut r = Rng::new(u64::from(i), 0, 0, 0);
                (r.next_f64() as Real, r.next_f32())
            },
        ];
        for (k, draw) in draws.iter().enumerate() {
            let mut one = vec![0u64; 1024];
            let mut two = vec![0u64; 64 * 64];
            for i in 0..N {
                let (x, y) = draw(i);
                one[(x * 1024.0) as usize] += 1;
                two[(x * 64.0) as usize * 64 + (y * 64.0) as usize] += 1;
            }
            assert!(p_uniform(&one) > level(), "draw {k}, one dimension");
            assert!(p_uniform(&two) > level(), "draw {k}, two dimensions");
        }
    }

    #[test]
    fn streams_that_differ_in_one_word_differ_everywhere() {
        let base = Rng::new(7, 1, 2, 3);
        for other in [
            Rng::new(8, 1, 2, 3),
            Rng::new(7, 2, 2, 3),
            Rng::new(7, 1, 3, 3),
            Rng::new(7, 1, 2, 4),
            Rng::new(7, 2, 1, 3),
        ] {
            let (mut a, mut b) = (base, other);
            // Each of 64·1000 bit pairs agrees with probability 1/2: 6 standard deviations are 6·√64000/2.
            let same: u32 = (0..1000)
                .map(|_| (a.next_u64() ^ b.next_u64()).count_zeros())
                .sum();
            assert!((f64::from(same) - 32000.0).abs() < 6.0 * 64000f64.sqrt() / 2.0);
        }
    }

    #[test]
    fn a_jump_equals_walking_there() {
        let mut walk = Rng::new(5, 0, 1, 9);
        for _ in 0..1000 {
            walk.next_u64();
        }
        let mut jump = Rng::new(5, 0, 1, 9);
        jump.skip(1000);
        assert_eq!(walk, jump);
        assert_eq!(walk.next_u64(), jump.next_u64());

        jump.set_step(77);
        let first = jump.next_u64();
        walk.set_step(76);
        assert_ne!(walk.next_u64(), first);
        walk.set_step(77);
        assert_eq!(walk.next_u64(), first);
    }

    #[test]
    fn floats_stay_below_one() {
        assert!(unit24(0xff_ffff) < 1.0);
        let mut r = Rng::new(0, 0, 0, 0);
        assert!((0..10_000).all(|_| r.next_below(3) < 3));
    }

    #[test]
    fn the_traits_of_rand_give_the_same_bits() {
        use rand::Rng as _;
        let (mut a, mut b) = (Rng::new(3, 1, 4, 1), Rng::new(3, 1, 4, 1));
        let mut bytes = [0u8; 12];
        a.fill_bytes(&mut bytes);
        assert_eq!(bytes[..8], b.next_u64().to_le_bytes());
        assert_eq!(bytes[8..], b.next_u64().to_le_bytes()[..4]);
    }
}
