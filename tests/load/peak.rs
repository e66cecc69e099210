//! The most memory that was in use at a time, so that a file that claims too much is found out.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    /// Bytes in use by this thread, and the most there were since [`start`].
    static USED: Cell<[isize; 2]> = const { Cell::new([0; 2]) };
}

fn add(bytes: isize) {
    // Memory may be given back by another thread while this one ends.
    let _ = USED.try_with(|u| {
        let [now, peak] = u.get();
        u.set([now + bytes, peak.max(now + bytes)]);
    });
}

/// From now on the peak is counted anew; hand the result to [`since`].
pub fn start() -> isize {
    USED.with(|u| {
        let [now, _] = u.get();
        u.set([now, now]);
        now
    })
}

/// The most bytes this thread had in use beyond what it had then.
pub fn since(before: isize) -> usize {
    (USED.get()[1] - before).max(0) as usize
}

struct Watching;

// SAFETY: every call goes to `System` unchanged; the counter is a plain thread-local that itself never allocates.
unsafe impl GlobalAlloc for Watching {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        add(layout.size() as isize);
        // SAFETY: the caller's promises about `layout` are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        add(layout.size() as isize);
        // SAFETY: the caller's promises about `layout` are passed on.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        add(-(layout.size() as isize));
        // SAFETY: `p` came from `System` with this layout.
        unsafe { System.dealloc(p, layout) }
    }

    unsafe fn realloc(&self, p: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        add(size as isize - layout.size() as isize);
        // SAFETY: `p` came from `System` with this layout; `size` is the caller's.
        unsafe { System.realloc(p, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Watching = Watching;
