//! Tests in real time, on a machine that may stand still.
//!
//! A read that returned late is stamped by what is known of it, and a replay does not know that it was late.
//! So what these tests expect holds only where threads run when they are due. Another thread finds out
//! whether they did: its sleeps of a millisecond end in time, or they do not.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use biplane_clock::monotonic_ns;

/// A failure counts where no sleep ended later than this. The reader of a port has a tick of 5 ms.
const IN_TIME: Duration = Duration::from_millis(5);
const SLEEP: Duration = Duration::from_millis(1);
/// So often a test is run at most: what is wrong with the code fails every time.
const RUNS: usize = 4;
/// The machine is left alone so long before the next run.
const REST: Duration = Duration::from_secs(3);

/// One at a time: two of these tests together are a load that no robot has.
static TURN: Mutex<()> = Mutex::new(());

/// Runs a test alone, and once more when it failed while the machine stood still.
pub(crate) fn in_time(test: impl Fn()) {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    for run in 1..=RUNS {
        let (outcome, latest) = watched(&test);
        let Err(panic) = outcome else { return };
        if latest < IN_TIME || run == RUNS {
            resume_unwind(panic);
        }
        println!("the machine stood still for {latest:?}: once more");
        thread::sleep(REST);
    }
}

/// How the test went, and how late a sleep ended meanwhile.
fn watched(test: &impl Fn()) -> (thread::Result<()>, Duration) {
    let is_over = AtomicBool::new(false);
    thread::scope(|scope| {
        let watch = scope.spawn(|| {
            let mut latest = Duration::ZERO;
            while !is_over.load(Ordering::Relaxed) {
                let start_ns = monotonic_ns();
                thread::sleep(SLEEP);
                let slept = Duration::from_nanos((monotonic_ns() - start_ns).unsigned_abs());
                latest = latest.max(slept.saturating_sub(SLEEP));
            }
            latest
        });
        let outcome = catch_unwind(AssertUnwindSafe(test));
        is_over.store(true, Ordering::Relaxed);
        (outcome, watch.join().unwrap_or_default())
    })
}

#[test]
#[should_panic(expected = "wrong every time")]
fn what_is_wrong_every_time_is_a_failure() {
    in_time(|| panic!("wrong every time"));
}
