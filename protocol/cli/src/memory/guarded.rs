//! An allocator that ends the program with a sentence when memory runs out, where others abort it.

use std::alloc::{GlobalAlloc, Layout};
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicPtr, Ordering};

use crate::ending::{end_now, exit_at_once, is_done_here, wait_for_the_end, write_at_once};
use crate::memory::{advice, megabytes};

/// Address space for the last sentence and for removing files. It is never touched, so it costs no memory.
/// The system's allocator takes at least 1 MiB at a time.
const RESERVE: Layout = match Layout::from_size_align(4 << 20, 4096) {
    Ok(layout) => layout,
    Err(_) => panic!("4096 is a power of two"),
};
static RESERVED: AtomicPtr<u8> = AtomicPtr::new(ptr::null_mut());
/// Memory has run out, and one thread says so. All others stand still, so that it has the reserve for itself.
static IS_OUT: AtomicBool = AtomicBool::new(false);

/// `A`, with a sentence and exit code 1 instead of an abort when it has no more (see [`crate::clean_up_by`]).
#[derive(Copy, Clone, Debug, Default)]
pub struct GuardedAllocator<A>(
    /// Does the work.
    pub A,
);

impl<A: GlobalAlloc> GuardedAllocator<A> {
    /// Passes on what the allocator has given, unless it is nothing.
    #[inline]
    fn checked(&self, pointer: *mut u8, asked_bytes: usize) -> *mut u8 {
        if pointer.is_null() || IS_OUT.load(Ordering::Relaxed) {
            return self.short(pointer, asked_bytes);
        }
        pointer
    }

    /// What an allocation returns when memory has run out, if it returns.
    #[cold]
    fn short(&self, pointer: *mut u8, asked_bytes: usize) -> *mut u8 {
        if is_done_here() {
            if pointer.is_null() {
                // Not even the reserve is enough.
                write_at_once(b"out of memory\n");
                exit_at_once();
            }
            return pointer;
        }
        if pointer.is_null() && !IS_OUT.swap(true, Ordering::SeqCst) {
            let reserve = RESERVED.swap(ptr::null_mut(), Ordering::SeqCst);
            if !reserve.is_null() {
                // SAFETY: `keep_reserve` allocated it with this layout by this allocator, and the swap gives
                // it to one caller only.
                unsafe { self.0.dealloc(reserve, RESERVE) };
            }
            end_now(|| {
                let asked = megabytes(asked_bytes as u64);
                format!("out of memory: {asked} more were asked for; {}", advice())
            });
        }
        wait_for_the_end();
    }

    /// Keeps something back for the last sentence, and reads the limit. To be called once, first of all.
    pub fn keep_reserve(&self) {
        // SAFETY: the layout's size is not zero.
        let reserve = unsafe { self.0.alloc(RESERVE) };
        let older = RESERVED.swap(reserve, Ordering::SeqCst);
        if !older.is_null() {
            // SAFETY: as where it is released.
            unsafe { self.0.dealloc(older, RESERVE) };
        }
        crate::memory::limit();
    }
}

// SAFETY: everything is handed to `A` as it came; what comes back is returned as it is, or not at all.
unsafe impl<A: GlobalAlloc> GlobalAlloc for GuardedAllocator<A> {
    #[inline]
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc`, which is passed on as it is.
        self.checked(unsafe { self.0.alloc(layout) }, layout.size())
    }

    #[inline]
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above, for `alloc_zeroed`.
        self.checked(unsafe { self.0.alloc_zeroed(layout) }, layout.size())
    }

    #[inline]
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above, for `dealloc`.
        unsafe { self.0.dealloc(pointer, layout) }
    }

    #[inline]
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above, for `realloc`.
        self.checked(unsafe { self.0.realloc(pointer, layout, size) }, size)
    }
}
