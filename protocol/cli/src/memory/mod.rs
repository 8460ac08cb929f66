//! Memory that is short: what the process may have, known before it starts, and one line when it is not
//! enough.

mod guarded;
mod large_blocks;
mod limit;

use std::ptr;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

pub use guarded::GuardedAllocator;
pub use large_blocks::return_large_blocks;
pub use limit::{Limit, LimitedBy};
use rustix::mm::{MapFlags, ProtFlags, mmap_anonymous, munmap};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

static LIMIT: OnceLock<Option<Limit>> = OnceLock::new();
static KEPT_BYTES: AtomicU64 = AtomicU64::new(0);
static NEEDED_BYTES: AtomicU64 = AtomicU64::new(0);
/// What may be needed at most, where that is not known exactly.
static MAX_NEEDED_BYTES: AtomicU64 = AtomicU64::new(0);

/// What the process may have: the system's limit, read once, or a lower one of its own.
pub fn limit() -> Option<Limit> {
    let of_system = *LIMIT.get_or_init(Limit::of_this_process);
    let own = match KEPT_BYTES.load(Ordering::Relaxed) {
        0 => None,
        bytes => Some(Limit { bytes, by: LimitedBy::Program }),
    };
    of_system.into_iter().chain(own).min_by_key(|limit| limit.bytes)
}

/// The bound that a program has where nobody says another: three quarters of what the machine or the control
/// group has, bytes.
pub fn usual_bound() -> Option<u64> {
    limit::three_quarters()
}

/// Keeps the process below so many bytes from now on: the system refuses more, and the program ends with a
/// sentence. Where a limit is lower already, that one stays.
///
/// # Errors
/// A sentence, when the system does not take the bound.
pub fn keep_below(bytes: u64) -> Result<(), String> {
    let Rlimit { current, maximum } = getrlimit(Resource::Data);
    let allowed = [current, maximum].into_iter().flatten().fold(bytes, u64::min);
    setrlimit(Resource::Data, Rlimit { current: Some(allowed), maximum })
        .map_err(|why| format!("cannot keep the memory below {}: {why}", megabytes(bytes)))?;
    KEPT_BYTES.store(bytes, Ordering::Relaxed);
    Ok(())
}

/// Tells how many bytes a job takes as a rule. They are named when memory runs out.
///
/// # Errors
/// A sentence, when the process may not have three quarters of them: no estimate is better than that.
pub fn expect_need(bytes: u64) -> Result<(), String> {
    expect_need_between(bytes, bytes)
}

/// [`expect_need`] of a job of which it is not known yet how much it takes: only the least decides, both are
/// named.
///
/// # Errors
/// When the process may not have three quarters of the least.
pub fn expect_need_between(bytes: u64, max_bytes: u64) -> Result<(), String> {
    NEEDED_BYTES.store(bytes, Ordering::Relaxed);
    MAX_NEEDED_BYTES.store(max_bytes, Ordering::Relaxed);
    match limit() {
        Some(limit) if limit.bytes < bytes / 4 * 3 => Err(format!("not enough memory: {}", advice())),
        _ => Ok(()),
    }
}

/// What is needed, what there is, and what to do.
pub fn advice() -> String {
    let needed = needed(NEEDED_BYTES.load(Ordering::Relaxed), MAX_NEEDED_BYTES.load(Ordering::Relaxed));
    match limit() {
        Some(limit) => format!("{needed}{limit}"),
        None => format!("{needed}this process may have all that the machine has"),
    }
}

fn needed(bytes: u64, max_bytes: u64) -> String {
    match bytes {
        0 => String::new(),
        _ if max_bytes > bytes => {
            format!("{} at least and {} at most are needed, and ", megabytes(bytes), megabytes(max_bytes))
        }
        _ => format!("about {} are needed, and ", megabytes(bytes)),
    }
}

/// Whether the process may have so many bytes more just now.
pub(crate) fn has_room_for(bytes: usize) -> bool {
    let (access, flags) = (ProtFlags::READ | ProtFlags::WRITE, MapFlags::PRIVATE);
    // SAFETY: the system chooses the place, so nothing of ours is there.
    let Ok(place) = (unsafe { mmap_anonymous(ptr::null_mut(), bytes, access, flags) }) else { return false };
    // SAFETY: it was mapped just now with this length, and nobody has a pointer into it.
    unsafe { munmap(place, bytes) }.is_ok()
}

/// Bytes for people.
pub fn megabytes(bytes: u64) -> String {
    format!("{} MB", bytes.div_ceil(1_000_000))
}

#[cfg(test)]
mod tests {
    use super::{has_room_for, needed};

    #[test]
    fn there_is_room_for_a_page_and_not_for_all_that_can_be_addressed() {
        assert!(has_room_for(4096) && !has_room_for(usize::MAX / 4));
    }

    #[test]
    fn what_is_needed_is_named_from_least_to_most_until_it_is_known() {
        assert_eq!(needed(0, 0), "");
        assert_eq!(needed(44_000_000, 44_000_000), "about 44 MB are needed, and ");
        let between = needed(44_000_000, 900_000_000);
        assert_eq!(between, "44 MB at least and 900 MB at most are needed, and ");
    }
}
