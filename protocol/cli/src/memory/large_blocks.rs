//! What is freed goes back to the system.

/// Blocks from this size on are mapped each for itself, bytes: several times what a scan takes, a fraction of
/// what a drive takes.
#[cfg(target_env = "gnu")]
const LARGE_BYTES: libc::c_int = 4 << 20;

/// Gives large blocks back to the system as soon as they are freed, and grows them without a copy. Otherwise
/// glibc learns from the first ones that are freed to keep up to 32 MB of each size: a build of 2.3 million
/// points takes a tenth more at its peak then. A program calls it first. Other C libraries do so anyway.
pub fn return_large_blocks() {
    #[cfg(target_env = "gnu")]
    // SAFETY: `mallopt` may be called at any time; it only sets a bound of the allocator.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE_BYTES);
    }
}
