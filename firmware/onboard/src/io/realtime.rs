//! Real-time priority and locked memory, for machines that have more to do than to record. Both need a right;
//! without it the run goes on as it is, and says so.

use std::io;

use biplane_cli::plain_error;
use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, getrlimit};

/// Threads that read and stamp: a late read is a late stamp.
pub(crate) const READER_PRIORITY: i32 = 20;
/// The loop: it must wait for nobody but the readers.
pub(crate) const LOOP_PRIORITY: i32 = 10;

/// Whether threads of this process may have such priorities; says why not, once for all of them.
#[must_use]
pub(crate) fn is_allowed() -> bool {
    // Tried on this thread, which is given back as it was: threads that it starts would inherit it.
    let tried = schedule(libc::SCHED_FIFO, READER_PRIORITY).and_then(|()| schedule(libc::SCHED_OTHER, 0));
    if let Err(error) = &tried {
        tracing::warn!(
            "no real-time priority: {} (it needs CAP_SYS_NICE, or LimitRTPRIO= of at least {READER_PRIORITY})",
            plain_error(&error.to_string())
        );
    }
    tried.is_ok()
}

/// Gives the calling thread a fixed priority before all usual threads (`SCHED_FIFO`).
pub(crate) fn raise_priority(thread: &str, priority: i32) {
    match schedule(libc::SCHED_FIFO, priority) {
        Ok(()) => tracing::debug!("thread `{thread}` has real-time priority {priority}"),
        Err(error) => {
            tracing::warn!(
                "thread `{thread}` has no real-time priority: {}",
                plain_error(&error.to_string())
            );
        }
    }
}

fn schedule(policy: libc::c_int, priority: i32) -> io::Result<()> {
    let param = libc::sched_param { sched_priority: priority };
    // SAFETY: `param` lives through the call, which only reads it. 0 is the calling thread.
    let result = unsafe { libc::sched_setscheduler(0, policy, &raw const param) };
    if result == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

/// Keeps all memory of the process in memory, or says why not.
///
/// Not where a limit stands: memory that is asked for later would be refused beyond it, and the run would
/// end.
pub(crate) fn lock_memory() {
    const HINT: &str = "it needs CAP_IPC_LOCK, or LimitMEMLOCK=infinity";
    if !is_unlimited() {
        tracing::warn!("memory is not locked: the limit of locked memory is too low ({HINT})");
        return;
    }
    // Memory that is only reserved, as the map's, is locked once it is used.
    match mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT) {
        Ok(()) => tracing::debug!("memory is locked"),
        Err(error) => {
            tracing::warn!("memory is not locked: {} ({HINT})", plain_error(&error.to_string()));
        }
    }
}

fn is_unlimited() -> bool {
    let may_lock = rustix::thread::capabilities(None)
        .is_ok_and(|sets| sets.effective.contains(rustix::thread::CapabilitySet::IPC_LOCK));
    may_lock || getrlimit(Resource::Memlock).current.is_none()
}
