//! Sums of many and of very different numbers.

use glam::Vec2;
use metrolux::film::{Crop, Film, Filter, SplatBuffer, WideBuffer};
use metrolux::scene::{FilterKind, FilterSettings};

fn unit_filter() -> Filter {
    Filter::new(&FilterSettings {
        kind: FilterKind::Box,
        radius: [0.5, 0.5],
    })
}

/// 10¹⁰ splats into one pixel: 10⁵ at a time, 10⁵ times. The film holds their sum exactly; a single-precision sum of
/// ones stands still at 2²⁴, which it reaches after 0.2 % of them.
#[test]
fn ten_billion_splats_add_up() {
    let crop = Crop::from([0, 0, 2, 1]);
    let mut once = SplatBuffer::new(crop, unit_filter());
    for _ in 0..100_000 {
        once.splat(Vec2::new(0.5, 0.5), [1.0, 0.75, 2f32.powi(-30)], 1.0)
            .expect("taken");
    }
    let mut film = Film::new(crop);
    film.absorb(&mut once);
    let part = film.clone();
    for _ in 1..100_000 {
        film.merge(&part);
    }
    let n = 1e10;
    assert_eq!(film.to_xyz(1.0)[0], [n, 0.75 * n, n / 2f64.powi(30)]);
    assert_eq!(film.to_xyz(1.0)[1], [0.0; 3]);

    let mut single = 0.0f32;
    for _ in 0..(1 << 24) + 1000 {
        single += 1.0;
    }
    assert_eq!(single, 16_777_216.0);
}

/// Pixels that differ by 10¹² keep their digits beside each other, whatever order they are filled in: a unit of the wide
/// film is 2⁻⁶⁴, so 10⁻⁶ has 13 digits.
#[test]
fn dark_pixels_beside_bright_ones_keep_their_digits() {
    let crop = Crop::from([0, 0, 2, 1]);
    let fill = |order: [usize; 2]| {
        let mut b = WideBuffer::new(crop, unit_filter());
        for _ in 0..1000 {
            for i in order {
                let v = [1e6, 1.234_567_890_12e-6][i];
                b.splat(Vec2::new(i as f32 + 0.5, 0.5), [v; 3])
                    .expect("taken");
            }
        }
        let mut f = Film::new(crop);
        f.absorb_wide(&mut b);
        f
    };
    let (a, b) = (fill([0, 1]), fill([1, 0]));
    assert_eq!(a, b);
    let [bright, dark] = a.to_xyz(1e-3)[..] else {
        panic!("two pixels")
    };
    assert_eq!(bright, [1e6; 3]);
    assert!(
        (dark[1] / 1.234_567_890_12e-6 - 1.0).abs() < 1e-13,
        "{dark:?}"
    );
}
