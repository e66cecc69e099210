//! A run that is cut and gone on with.

use super::runs::{Cut, RUNS, Run, bits, go, in_room, options, room, state};
use metrolux::film::Writer;
use metrolux::integrator::{Nobody, Outcome};

/// Rounds: into the fourth generation.
const ROUNDS: u64 = 11;

/// Cut after 0, 1, 2 … rounds, in the middle of a generation and between two, and gone on with by another number of
/// threads, from bytes. Counters of rays and faults come out the same too.
#[test]
fn a_cut_leaves_no_trace() {
    let scene = room();
    for run in RUNS {
        let (whole, tally) = in_room(2, &scene, run, |w| {
            go(w, run, ROUNDS, &mut Nobody).expect("nothing was read")
        });
        let whole = bits(&whole);
        for first in 0..ROUNDS {
            let mut cut = Cut::after(first);
            in_room(1 + first as usize % 3, &scene, run, |w| {
                go(w, run, ROUNDS, &mut cut).expect("nothing was read")
            });
            // Once more in between, and the last time to the end.
            let mut rest = Cut::after(2);
            rest.start = Some(state(&cut.bytes));
            in_room(1, &scene, run, |w| {
                go(w, run, ROUNDS, &mut rest).expect("its own state")
            });
            let mut end = Cut::after(ROUNDS);
            end.start = Some(state(&rest.bytes));
            let (outcome, t) = in_room(3, &scene, run, |w| {
                go(w, run, ROUNDS, &mut end).expect("its own state")
            });
            assert!(bits(&outcome) == whole, "{run:?} cut after {first} rounds");
            assert_eq!(t, tally, "{run:?} cut after {first} rounds");
        }
    }
}

/// A longer run goes on from the end of a shorter one; the state without its scene makes the same image.
#[test]
fn a_finished_run_can_be_extended() {
    let scene = room();
    for run in RUNS {
        let long = in_room(2, &scene, run, |w| {
            bits(&go(w, run, ROUNDS, &mut Nobody).expect("nothing was read").0)
        });
        let mut cut = Cut::after(u64::MAX);
        let short = in_room(2, &scene, run, |w| {
            go(w, run, 5, &mut cut).expect("nothing was read").0
        });
        let mut kept = state(&cut.bytes);
        assert!(bits(&kept.outcome()) == bits(&short), "{run:?}");
        let mut again = Vec::new();
        kept.save(&mut Writer::new(&mut again)).expect("memory");
        assert!(again == cut.bytes, "{run:?}: written again");
        let mut more = Cut::after(u64::MAX);
        more.start = Some(kept);
        let extended = in_room(2, &scene, run, |w| {
            bits(&go(w, run, ROUNDS, &mut more).expect("its own state").0)
        });
        assert!(extended == long, "{run:?}");
        // And not back to fewer rounds.
        let mut less = Cut::after(u64::MAX);
        less.start = Some(state(&more.bytes));
        let e = in_room(1, &scene, run, |w| go(w, run, 5, &mut less).err());
        assert!(e.expect("refused").0.contains("more than the 5"), "{run:?}");
    }
}

/// The bound that the format promises, of chains whose paths are as long as they may be.
#[test]
fn a_state_is_small() {
    let scene = room();
    let run = Run::Mlt(metrolux::chain::Direct::Separate);
    let mut cut = Cut::after(u64::MAX);
    let outcome = in_room(2, &scene, run, |w| {
        go(w, run, 4, &mut cut).expect("nothing was read").0
    });
    assert!(matches!(outcome, Outcome::Mlt(_)));
    let (pixels, o) = (13 * 11, options(run));
    // XYZ of 16 bytes, the groups' Y of 8, six sums of 8 of the direct pass.
    let film = pixels * (3 * 16 + 8 * o.groups as usize + 6 * 8);
    let chains = (o.groups * o.chains) as usize;
    let most = film + chains * (256 + 24 * 2);
    assert!(cut.bytes.len() <= most, "{} > {most}", cut.bytes.len());
}
