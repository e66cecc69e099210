//! What Embree tells while it works: complaints, and the memory it takes.

use super::EmbreeError;
use std::sync::atomic::{AtomicIsize, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

/// Its address is given to the library, so it lives in a box.
#[derive(Default)]
pub(super) struct Monitor {
    errors: Mutex<Vec<String>>,
    bytes: AtomicIsize,
    most: AtomicIsize,
}

impl Monitor {
    /// The complaints so far, as an error; they are forgotten.
    pub fn check(&self) -> Result<(), EmbreeError> {
        let mut errors = self.errors.lock().unwrap_or_else(PoisonError::into_inner);
        if errors.is_empty() {
            return Ok(());
        }
        let words = std::mem::take(&mut *errors).join("; ");
        Err(EmbreeError::Refused(words))
    }

    /// One more.
    pub fn complain(&self, text: String) {
        let mut errors = self.errors.lock().unwrap_or_else(PoisonError::into_inner);
        errors.push(text);
    }

    /// So many bytes more, or fewer.
    pub fn count(&self, bytes: isize) {
        let now = self.bytes.fetch_add(bytes, Relaxed) + bytes;
        self.most.fetch_max(now, Relaxed);
    }

    /// Bytes the library holds.
    pub fn bytes(&self) -> usize {
        self.bytes.load(Relaxed).max(0) as usize
    }

    /// Most bytes it held at once.
    pub fn most_bytes(&self) -> usize {
        self.most.load(Relaxed).max(0) as usize
    }
}
