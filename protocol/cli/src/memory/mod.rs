//! Memory that is short: what the process may have, known before it starts, and one line when it is not
//! enough.

mod guarded;
mod limit;

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

pub use guarded::GuardedAllocator;
pub use limit::{Limit, LimitedBy};

static LIMIT: OnceLock<Option<Limit>> = OnceLock::new();
static NEEDED_BYTES: AtomicU64 = AtomicU64::new(0);

/// What the process may have, read once.
pub fn limit() -> Option<Limit> {
    *LIMIT.get_or_init(Limit::of_this_process)
}

/// Tells how many bytes a job takes as a rule. They are named when memory runs out.
///
/// # Errors
/// A sentence, when the process may not have half of them: no estimate is better than that.
pub fn expect_need(bytes: u64) -> Result<(), String> {
    NEEDED_BYTES.store(bytes, Ordering::Relaxed);
    match limit() {
        Some(limit) if limit.bytes < bytes / 2 => Err(format!("not enough memory: {}", advice())),
        _ => Ok(()),
    }
}

/// What is needed, what there is, and what to do.
pub fn advice() -> String {
    let needed = match NEEDED_BYTES.load(Ordering::Relaxed) {
        0 => String::new(),
        bytes => format!("about {} are needed, and ", megabytes(bytes)),
    };
    match limit() {
        Some(limit) => format!("{needed}{limit}"),
        None => format!("{needed}this process may have all that the machine has"),
    }
}

fn megabytes(bytes: u64) -> String {
    format!("{} MB", bytes.div_ceil(1_000_000))
}
