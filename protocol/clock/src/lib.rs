//! The one place in Biplane that reads a clock.
//!
//! Libraries take time as an argument, whole nanoseconds as `i64`; programs read it here, at their edge.
//! Clippy refuses `Instant::now` and `SystemTime::now` in the whole workspace, so that a simulated hour needs
//! no hour. How a time is written as a date stands here, too.

mod date;

pub use crate::date::iso_8601;

use rustix::time::{ClockId, Timespec, clock_gettime};

const NS_PER_S: i64 = 1_000_000_000;

fn nanoseconds(time: Timespec) -> i64 {
    time.tv_sec.saturating_mul(NS_PER_S).saturating_add(time.tv_nsec)
}

/// Nanoseconds on a clock that never steps; its zero is the machine's start.
#[must_use]
pub fn monotonic_ns() -> i64 {
    nanoseconds(clock_gettime(ClockId::Monotonic))
}

/// Nanoseconds since 1970-01-01 00:00 UTC. This clock may step when the system's time is set.
#[must_use]
pub fn utc_ns() -> i64 {
    nanoseconds(clock_gettime(ClockId::Realtime))
}

/// Processor time that this process has used on all its threads, in nanoseconds.
#[must_use]
pub fn process_cpu_ns() -> i64 {
    nanoseconds(clock_gettime(ClockId::ProcessCPUTime))
}

/// Processor time that the calling thread has used, in nanoseconds.
#[must_use]
pub fn thread_cpu_ns() -> i64 {
    nanoseconds(clock_gettime(ClockId::ThreadCPUTime))
}

/// The largest resident memory of this process so far, in bytes (`VmHWM` of `/proc/self/status`); `None`
/// where the kernel does not tell.
#[must_use]
pub fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kibibytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    kibibytes.checked_mul(1024)
}

/// Suspends the calling thread for about this long; returns at once for zero or a negative time.
pub fn sleep_ns(duration_ns: i64) {
    if let Ok(nanoseconds) = u64::try_from(duration_ns) {
        std::thread::sleep(std::time::Duration::from_nanos(nanoseconds));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sleep_lasts_at_least_as_long_as_asked_on_the_monotonic_clock() {
        let before = monotonic_ns();
        sleep_ns(3_000_000);
        assert!(monotonic_ns() - before >= 3_000_000);
    }

    #[test]
    fn utc_lies_after_2025_and_processor_time_grows() {
        assert!(utc_ns() > 1_735_689_600 * NS_PER_S);
        let before = [process_cpu_ns(), thread_cpu_ns()];
        let sum = (0..2_000_000_u64).fold(0_u64, |a, b| std::hint::black_box(a ^ b));
        assert!(process_cpu_ns() > before[0] && thread_cpu_ns() > before[1], "{sum}");
    }

    #[test]
    fn peak_memory_is_at_least_a_megabyte() {
        assert!(peak_memory_bytes().is_some_and(|bytes| bytes > 1 << 20));
    }
}
