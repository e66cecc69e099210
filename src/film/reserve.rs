//! Buffers that tasks take and give back, so that there are as many as threads and none is made in a loop.

use std::sync::{Mutex, PoisonError};

/// Idle buffers.
#[derive(Debug, Default)]
pub struct Reserve<T>(Mutex<Vec<T>>);

impl<T> Reserve<T> {
    /// No buffers yet.
    pub fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// An idle buffer, or a new one.
    pub fn take(&self, make: impl FnOnce() -> T) -> T {
        let idle = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        idle.unwrap_or_else(make)
    }

    /// An idle buffer that `fits`, else any other, else a new one.
    pub fn take_fitting(&self, fits: impl Fn(&T) -> bool, make: impl FnOnce() -> T) -> T {
        let idle = {
            let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            match all.iter().rposition(fits) {
                Some(i) => Some(all.swap_remove(i)),
                None => all.pop(),
            }
        };
        idle.unwrap_or_else(make)
    }

    /// Gives a buffer back with what it holds.
    pub fn put(&self, buffer: T) {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(buffer);
    }

    /// All idle buffers, taken out.
    pub fn drain(&self) -> Vec<T> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
