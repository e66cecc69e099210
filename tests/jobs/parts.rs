//! Renders that machines share.

use super::runs::{Cut, RUNS, Run, bits, go, in_room, room, state};
use metrolux::film::Shards;
use metrolux::integrator::{Nobody, Outcome, State};
use metrolux::sampling::Rng;

const ROUNDS: u64 = 5;

fn part(scene: &metrolux::scene::Scene, run: Run, k: u32, n: u32) -> Vec<u8> {
    let mut cut = Cut::after(u64::MAX);
    cut.shards = Shards::one(k, n);
    in_room(1, scene, run, |w| {
        go(w, run, ROUNDS, &mut cut).expect("nothing was read");
    });
    cut.bytes
}

/// All but the strategies' longest stay is a sum; that is a maximum.
#[test]
fn any_number_of_parts_in_any_order_is_one_machine() {
    let scene = room();
    let mut rng = Rng::new(1, 2, 3, 4);
    for run in RUNS {
        let whole = in_room(2, &scene, run, |w| {
            bits(&go(w, run, ROUNDS, &mut Nobody).expect("nothing was read").0)
        });
        for n in [1, 2, 3, 7, 16] {
            let mut parts: Vec<State> = (0..n).map(|k| state(&part(&scene, run, k, n))).collect();
            for i in (1..parts.len()).rev() {
                parts.swap(i, rng.next_below(i as u64 + 1) as usize);
            }
            let mut sum = parts.pop().expect("one at least");
            for p in parts {
                assert!(!sum.shards().is_whole());
                sum.merge(p).expect("a part of the same render");
            }
            assert!(sum.shards().is_whole());
            assert!(bits(&sum.outcome()) == whole, "{run:?} in {n} parts");
            if n == 3 {
                // The sum is a state like any other.
                let mut more = Cut::after(u64::MAX);
                more.start = Some(sum);
                let longer = in_room(2, &scene, run, |w| {
                    let a = bits(&go(w, run, ROUNDS + 4, &mut more).expect("whole").0);
                    (
                        a,
                        bits(&go(w, run, ROUNDS + 4, &mut Nobody).expect("new").0),
                    )
                });
                assert!(longer.0 == longer.1, "{run:?} extended");
            }
        }
    }
}

#[test]
fn doubles_and_strangers_are_refused() {
    let scene = room();
    let run = Run::Mlt(metrolux::chain::Direct::Separate);
    let of = |k, n| state(&part(&scene, run, k, n));
    let mut sum = of(0, 3);
    assert!(sum.merge(of(0, 3)).is_err());
    let mut sum = of(0, 3);
    assert!(sum.merge(of(1, 2)).is_err());
    let mut sum = of(0, 3);
    assert!(sum.merge(state(&part(&scene, Run::Pt, 1, 3))).is_err());
    let mut sum = of(0, 3);
    assert!(sum.merge(of(2, 3)).is_ok());
    assert_eq!(sum.shards().missing().collect::<Vec<_>>(), [1]);
}

/// Each of four parts missing once: every chain and pixel is left out once, so that the mean of the four images is the whole
/// one. A weight left out would be −25 %. Numbers of light paths differ a little between the parts of bdpt.
#[test]
fn a_missing_part_leaves_an_image_of_the_same_mean() {
    let scene = room();
    for run in [
        Run::Pt,
        Run::Bdpt,
        Run::Mlt(metrolux::chain::Direct::Separate),
    ] {
        let mean = |o: &Outcome| {
            let image = match o {
                Outcome::Sampled(r) => &r.image,
                Outcome::Mlt(r) => &r.image,
            };
            image.iter().map(|p| p[1]).sum::<f64>() / image.len() as f64
        };
        let all = in_room(2, &scene, run, |w| {
            mean(&go(w, run, ROUNDS, &mut Nobody).expect("new").0)
        });
        let mut means = Vec::new();
        for missing in 0..4 {
            let mut rest = (0..4)
                .filter(|k| *k != missing)
                .map(|k| state(&part(&scene, run, k, 4)));
            let mut sum = rest.next().expect("three");
            rest.for_each(|p| sum.merge(p).expect("of the same render"));
            means.push(mean(&sum.outcome()));
        }
        let found = means.iter().sum::<f64>() / 4.0;
        println!("{run:?}: {found} of {all}, {means:?}");
        assert!(
            (found / all - 1.0).abs() < 0.02,
            "{run:?}: {found} of {all}"
        );
    }
}
