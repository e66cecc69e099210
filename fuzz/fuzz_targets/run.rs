//! Checkpoints and parts: what `merge` does with one, and a render that goes on from one.
#![no_main]

#[allow(dead_code)]
#[path = "../../tests/jobs/bytes.rs"]
mod bytes;
#[allow(dead_code)]
#[path = "../../tests/jobs/runs.rs"]
mod runs;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| bytes::take_file(bytes.to_vec()));
