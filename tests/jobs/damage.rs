//! Bytes that no run wrote: an error, never a panic, and no more memory than the file could stand for.

use super::runs::{Cut, Run, go, in_room, room};
use metrolux::chain::Direct;
use metrolux::film::Reader;
use metrolux::integrator::State;
use metrolux::scene::Scene;
use proptest::prelude::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::LazyLock;

thread_local! {
    /// Largest piece of memory this thread asked for since it was set to 0.
    static LARGEST: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, watched.
struct Watching;

// SAFETY: every call goes to `System` unchanged; the thread-local is plain and itself never allocates.
unsafe impl GlobalAlloc for Watching {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.set(LARGEST.get().max(layout.size()));
        // SAFETY: the caller's promises about `layout` are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        // SAFETY: `p` came from `System` with this layout.
        unsafe { System.dealloc(p, layout) }
    }

    unsafe fn realloc(&self, p: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        LARGEST.set(LARGEST.get().max(size));
        // SAFETY: `p` came from `System` with this layout; `size` is the caller's.
        unsafe { System.realloc(p, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Watching = Watching;

const KINDS: [Run; 4] = [
    Run::Pt,
    Run::Bdpt,
    Run::Mlt(Direct::Separate),
    Run::Spectral,
];

static SCENE: LazyLock<Scene> = LazyLock::new(room);
static STATES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let bytes = |run| {
        let mut cut = Cut::after(4);
        in_room(2, &SCENE, run, |w| {
            go(w, run, 10, &mut cut).expect("nothing was read");
        });
        cut.bytes
    };
    KINDS.map(bytes).into()
});

/// Changes of a byte, a 32-bit or a 64-bit word to what is likely to hurt, and a cut.
fn changes() -> impl Strategy<Value = Vec<(f64, u64, u8)>> {
    let value = prop_oneof![
        any::<u64>(),
        Just(0),
        Just(u64::MAX),
        Just(1 << 31),
        Just(1 << 63),
        Just(f64::NAN.to_bits()),
        Just((f32::NAN.to_bits() as u64) << 32 | f32::INFINITY.to_bits() as u64),
    ];
    // Most of a state are sums; its head is where lengths stand.
    let place = prop_oneof![0.0..1.0, 0.0..0.02f64];
    proptest::collection::vec((place, value, 0u8..4), 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn changed_bytes_never_panic_nor_take_more_memory_than_they_stand_for(
        kind in 0usize..4,
        changes in changes(),
    ) {
        let mut bytes = STATES[kind].clone();
        for (place, value, width) in changes {
            let at = (place * bytes.len() as f64) as usize;
            let width = [1, 4, 8, 0][width as usize].min(bytes.len() - at);
            bytes[at..at + width].copy_from_slice(&value.to_le_bytes()[..width]);
            if width == 0 {
                bytes.truncate(at);
            }
        }
        LARGEST.set(0);
        let read = State::read(&mut Reader::new(&bytes));
        // Sums of 16 bytes may be written in one; a message is short.
        prop_assert!(LARGEST.get() <= 16 * bytes.len() + 1000);
        if let Ok(mut state) = read {
            state.outcome();
            let run = KINDS[kind];
            in_room(1, &SCENE, run, |w| {
                let mut keeper = Cut::after(0);
                keeper.start = Some(state);
                // Whatever it says, it says it.
                let _ = go(w, run, 10, &mut keeper);
            });
        }
    }
}
