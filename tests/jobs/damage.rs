//! Bytes that no run wrote: an error, never a panic, and no more memory than the file could stand for.

use super::bytes::{KINDS, file, state, take_file};
use metrolux::cli::is_part;
use metrolux::film::{Reader, Shards};
use metrolux::integrator::State;
use proptest::prelude::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::fs;
use std::path::{Path, PathBuf};
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

static STATES: LazyLock<Vec<Vec<u8>>> =
    LazyLock::new(|| KINDS.map(|run| state(run, Shards::default())).into());

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
        drop(read);
        take_file(file(KINDS[kind], &bytes));
    }
}

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/run")
}

/// Files of every kind, where the fuzz target begins.
#[test]
#[ignore = "writes into the repository: after a change of the format"]
fn write_the_corpus_of_the_fuzz_target() {
    for (run, name) in KINDS.into_iter().zip(NAMES) {
        for (part, shards) in [("half", Shards::one(0, 2)), ("whole", Shards::default())] {
            let bytes = file(run, &state(run, shards));
            fs::write(corpus().join(format!("{name}-{part}.run")), bytes).expect("written");
        }
    }
}

const NAMES: [&str; 4] = ["pt", "bdpt", "mlt", "spectral"];

#[test]
fn the_corpus_of_the_fuzz_target() {
    for f in fs::read_dir(corpus()).expect("the corpus") {
        let path = f.expect("a file").path();
        let bytes = fs::read(&path).expect("read");
        let name = path
            .file_stem()
            .and_then(|n| n.to_str())
            .unwrap_or_default();
        if NAMES.iter().any(|n| name.starts_with(n)) {
            let read = is_part(bytes.clone());
            assert_eq!(read, Ok(()), "{name}: write the corpus anew, see above");
        }
        take_file(bytes);
    }
}
