//! A program that has to end in the middle of its work: one line says why and what is kept, and the exit code
//! is that of a failure.

use std::cell::Cell;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::outcome::FAILED;

/// Who ends, and how.
#[derive(Clone, Copy, Debug)]
struct Ending {
    program: &'static str,
    clean_up: fn() -> String,
}

static ENDING: OnceLock<Ending> = OnceLock::new();
static IS_ENDING: AtomicBool = AtomicBool::new(false);

thread_local! {
    static ENDS: Cell<bool> = const { Cell::new(false) };
}

/// Says what to do when the program has to end at once: `clean_up` takes away what is of no use to anybody
/// and returns in words what is kept. The first caller in a process decides.
pub fn clean_up_by(program: &'static str, clean_up: fn() -> String) {
    let _ = ENDING.set(Ending { program, clean_up });
}

/// Waits for the end when it has begun: what fails meanwhile fails because of it, and is not worth a line.
pub fn wait_if_ending() {
    if IS_ENDING.load(Ordering::SeqCst) {
        wait_for_the_end();
    }
}

/// Cleans up, says why and what is kept, and ends. `why` is a sentence without its end, made when this thread
/// is known to be the one that ends the program: only that one may still allocate.
pub(crate) fn end_now(why: impl FnOnce() -> String) -> ! {
    if IS_ENDING.swap(true, Ordering::SeqCst) {
        // Another thread has begun to.
        wait_for_the_end();
    }
    ENDS.set(true);
    let why = why();
    let line = match ENDING.get() {
        Some(ending) => format!("{}: {why}; {}\n", ending.program, (ending.clean_up)()),
        None => format!("{why}\n"),
    };
    write_at_once(line.as_bytes());
    exit_at_once();
}

/// Whether this thread is the one that ends the program.
pub(crate) fn is_done_here() -> bool {
    ENDS.get()
}

/// Not by parking: that may allocate, and memory may be what has run out.
pub(crate) fn wait_for_the_end() -> ! {
    loop {
        std::thread::sleep(Duration::from_secs(1));
    }
}

/// Writes to stderr past its lock, which a thread that stands still may hold.
pub(crate) fn write_at_once(mut bytes: &[u8]) {
    while let Ok(written @ 1..) = rustix::io::write(rustix::stdio::stderr(), bytes) {
        bytes = bytes.get(written..).unwrap_or_default();
        if bytes.is_empty() {
            return;
        }
    }
}

/// Ends without the functions that other code has left for the end: they may wait for a thread that stands
/// still.
pub(crate) fn exit_at_once() -> ! {
    // SAFETY: `_exit` has no requirement and does not return; buffers of stdout that nobody will flush hold
    // results of a job that failed.
    unsafe { libc::_exit(i32::from(FAILED)) }
}
