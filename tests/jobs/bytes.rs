//! Everything that may be done with the bytes of a checkpoint or part: for the tests of damage, and for the fuzz target `run`.

use super::runs::{Cut, Run, SEED, go, in_room, room};
use metrolux::chain::Direct;
use metrolux::cli::is_part;
use metrolux::film::{Reader, Shards};
use metrolux::integrator::State;
use metrolux::output::{RunFile, write_run};
use metrolux::scene::Scene;
use std::fs;
use std::sync::LazyLock;

pub static SCENE: LazyLock<Scene> = LazyLock::new(room);

/// One of each kind of state.
pub const KINDS: [Run; 4] = [
    Run::Pt,
    Run::Bdpt,
    Run::Mlt(Direct::Separate),
    Run::Spectral,
];

/// Rounds that the states here have made.
const MADE: u64 = 4;

/// What a run of some part of the work has after a few rounds.
pub fn state(run: Run, shards: Shards) -> Vec<u8> {
    let mut cut = Cut::after(MADE);
    cut.shards = shards;
    in_room(1, &SCENE, run, |w| {
        go(w, run, 2 * MADE, &mut cut).expect("nothing was read");
    });
    cut.bytes
}

/// The second half of each run, to be added to others.
static SECOND: LazyLock<Vec<Vec<u8>>> =
    LazyLock::new(|| KINDS.map(|run| state(run, Shards::one(1, 2))).into());

/// A file with this state.
pub fn file(run: Run, state: &[u8]) -> Vec<u8> {
    let crop = SCENE.camera.crop;
    let mut label = serde_json::json!({
        "version": "", "machine": "", "scene": "", "integrator": "", "seed": SEED, "accel": "", "embree": "",
        "precision": "", "resolution": SCENE.camera.resolution, "region": crop, "film_scale": "1", "max_depth": 6,
        "lanes": 4, "spectral": (run == Run::Spectral).then_some(5), "plan": "", "triangles": 16,
    });
    if matches!(run, Run::Mlt(_) | Run::Spectral) {
        label["chains"] = serde_json::json!({
            "target": "mixed", "direct": "separate", "two_stage": null, "mutate": ["0.5", "0.1", "0.1", "0.1", "0.1", "0.1"],
            "pilot": true,
            "work": [5, 4, 192, 24, 3], "other": "",
        });
    }
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("a.run");
    write_run(&path, &label.to_string(), &mut |w| w.bytes(state)).expect("written");
    fs::read(path).expect("there")
}

/// Makes the picture of a state, adds others to it, and goes on from it. Whatever comes of that is right but a panic.
pub fn take_state(bytes: &[u8]) {
    let read = || State::read(&mut Reader::new(bytes));
    let Ok(state) = read() else {
        return;
    };
    // What it is of, the first byte says; of which options, nothing: one will fit.
    let kinds: &[Run] = match bytes[0] {
        0 => &[Run::Pt],
        1 => &[Run::Bdpt],
        _ if state.bins().is_some() => &[Run::Spectral],
        _ => &[Run::Mlt(Direct::Separate), Run::TwoStage],
    };
    for second in SECOND.iter() {
        let mut sum = read().expect("it was read before");
        let more = State::read(&mut Reader::new(second)).expect("whole");
        if sum.merge(more).is_ok() {
            sum.outcome();
        }
    }
    for run in kinds {
        in_room(1, &SCENE, *run, |world| {
            let mut keeper = Cut::after(0);
            keeper.start = read().ok();
            let _ = go(world, *run, 2 * MADE, &mut keeper);
        });
    }
}

/// All that is done with a file, as it is and with its checksum put right; without that no change would get beyond it.
pub fn take_file(mut bytes: Vec<u8>) {
    let _ = is_part(bytes.clone());
    if let Some((body, sum)) = bytes.split_last_chunk_mut::<4>() {
        *sum = crc32fast::hash(body).to_le_bytes();
    }
    let _ = is_part(bytes.clone());
    if let Ok(file) = RunFile::of_bytes(bytes) {
        let mut run = file.run();
        let state = run.bytes(run.left()).expect("as many as there are");
        take_state(state);
    }
}
