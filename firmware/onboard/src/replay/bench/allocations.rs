//! Counts what a thread allocates, for `bench` and for tests: an allocator that hands everything to the
//! system's and adds one to a counter of the calling thread. It counts only in a program that installs it
//! (`#[global_allocator]`), as `biplane-onboard` does.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator with a counter a thread.
#[derive(Copy, Clone, Debug, Default)]
pub struct CountingAllocator;

/// What `work` returns, and how often it allocated in this thread; `None` in a program that does not count.
pub fn during<T>(work: impl FnOnce() -> T) -> (T, Option<u64>) {
    let before = COUNT.get();
    let done = work();
    let after = COUNT.get();
    // Whether allocations are counted at all is tried with one.
    drop(std::hint::black_box(Box::new(0_u8)));
    (done, (COUNT.get() != after).then_some(after - before))
}

// SAFETY: everything is handed to the system's allocator; only a counter of the thread is added, which
// allocates nothing itself.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller keeps the contract of `alloc`, which is passed on as it is.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: as above, for `alloc_zeroed`: large pools stay untouched until they are used.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above, for `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: as above, for `realloc`.
        unsafe { System.realloc(pointer, layout, size) }
    }
}
