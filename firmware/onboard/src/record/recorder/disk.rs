//! Room on the recording's disk.

use std::path::Path;

/// With less room left, log and diagnostics warn, bytes: 3 hours of a usual run.
pub(crate) const LOW_BYTES: u64 = 500_000_000;
/// With less room left, a run ends while it can still be closed, bytes: minutes of a run with serial bytes,
/// and every index.
pub(crate) const STOP_BYTES: u64 = 50_000_000;

/// Whether there is anything to store on below a folder: the kernel's own file systems (`/proc`, `/sys`) have
/// no size; `None` when the system does not tell.
#[must_use]
pub(crate) fn is_disk(folder: &Path) -> Option<bool> {
    rustix::fs::statvfs(folder).ok().map(|stat| stat.f_blocks > 0)
}

/// Bytes that are free for us on a folder's disk; `None` when the system does not tell.
#[must_use]
pub(crate) fn free_bytes(folder: &Path) -> Option<u64> {
    rustix::fs::statvfs(folder).ok().map(|stat| stat.f_bavail.saturating_mul(stat.f_frsize))
}
