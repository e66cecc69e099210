//! How many samples each pixel has where their mean is no whole number.

/// The R2 sequence's steps in units of 2⁻³².
const DITHER: [u32; 2] = [3_242_174_889, 2_447_445_414];

/// A pixel's threshold in units of 2⁻³².
#[inline]
pub(super) fn threshold(shift: u32, x: u32, y: u32) -> u32 {
    shift
        .wrapping_add(x.wrapping_mul(DITHER[0]))
        .wrapping_add(y.wrapping_mul(DITHER[1]))
}

/// Samples of a pixel when there are `mean` of them in the mean. Thresholds in [0, 1) lie on a lattice over the image, so
/// any part of the pixels that is one ahead is spread evenly; each is uniform over the seeds, so who is ahead does not
/// depend on what is there to see. Whole numbers are whole for every pixel; a pixel never has fewer as `mean` grows.
#[inline]
pub(super) fn samples_at(mean: f64, shift: u32, x: u32, y: u32) -> u64 {
    let t = threshold(shift, x, y);
    (mean + t as f64 / (1u64 << 32) as f64) as u64
}

#[cfg(test)]
mod tests {
    use super::samples_at;

    const SIZE: u32 = 64;

    fn counts(mean: f64, shift: u32) -> Vec<u64> {
        let at = |i| samples_at(mean, shift, i % SIZE, i / SIZE);
        (0..SIZE * SIZE).map(at).collect()
    }

    #[test]
    fn whole_numbers_are_the_same_for_all_pixels() {
        for shift in [0, 1, 0x8000_0000, u32::MAX] {
            for n in [0u64, 1, 7, 1 << 20] {
                assert!(counts(n as f64, shift).iter().all(|c| *c == n));
            }
        }
    }

    /// The budget is met in the whole image and in every 8 × 8 pixels of it, and no sample is ever taken back.
    #[test]
    fn parts_are_met_in_the_mean_everywhere() {
        for shift in [0, 0x1234_5678, u32::MAX] {
            let mut last = counts(0.0, shift);
            for tenths in 1..40 {
                let mean = tenths as f64 / 10.0;
                let now = counts(mean, shift);
                assert!(last.iter().zip(&now).all(|(a, b)| a <= b));
                let total = now.iter().sum::<u64>() as f64;
                // The discrepancy of n points of the lattice is O(ln n / n); 3 ln n counts of n leave room for it.
                let off = (total - mean * now.len() as f64).abs();
                assert!(off < 3.0 * (now.len() as f64).ln(), "{mean}: {off}");
                for tile in 0..64 {
                    let (x0, y0) = (tile % 8 * 8, tile / 8 * 8);
                    let sum: u64 = (0..64)
                        .map(|i| now[((y0 + i / 8) * SIZE + x0 + i % 8) as usize])
                        .sum();
                    let off = (sum as f64 - 64.0 * mean).abs();
                    assert!(off < 3.0 * 64f64.ln(), "{mean}, tile {tile}: {off}");
                }
                last = now;
            }
        }
    }

    /// Every pixel is as often ahead as the part asked for, over all shifts.
    #[test]
    fn every_pixel_has_its_share_over_the_seeds() {
        let n = 1000u32;
        for (x, y) in [(0, 0), (5, 3), (1919, 1079)] {
            for mean in [0.3, 1.75] {
                let shifts = (0..n).map(|i| i.wrapping_mul(u32::MAX / n));
                let sum: u64 = shifts.map(|s| samples_at(mean, s, x, y)).sum();
                // Equally spaced thresholds: off by one at either end of the interval.
                assert!((sum as f64 - mean * n as f64).abs() <= 2.0);
            }
        }
    }
}
