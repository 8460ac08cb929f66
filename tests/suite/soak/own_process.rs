//! What long runs share: a process of their own, whose memory nothing else grows, and how that memory is
//! watched.

use std::process::Command;

/// How long a run lasts that the environment may ask to be longer, seconds.
pub(crate) fn length_s(variable: &str, usual_s: i64) -> i64 {
    std::env::var(variable).ok().and_then(|seconds| seconds.parse().ok()).unwrap_or(usual_s)
}

/// Runs an ignored test of this binary alone. Tests run side by side in one process, and what the others
/// allocate would be counted with its own.
#[track_caller]
pub(crate) fn run(test: &str) {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--ignored", "--exact", test, "--nocapture"])
        .output()
        .unwrap();
    let reported = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    println!("{}", reported(&output.stdout));
    assert!(output.status.success(), "{}", reported(&output.stderr));
    assert!(reported(&output.stdout).contains("1 passed"));
}

/// Memory that this process has in use now, bytes.
pub(crate) fn memory_bytes() -> i64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: i64 = text.split_whitespace().nth(1).unwrap().parse().unwrap();
    pages * 4096
}

/// The largest of the second quarter and of the last: the first may still fill what is kept.
pub(crate) fn quarters(samples: &[i64]) -> [i64; 2] {
    let quarter = (samples.len() / 4).max(1);
    let last = (3 * quarter).min(samples.len().saturating_sub(quarter));
    let second = quarter.min(samples.len().saturating_sub(1));
    let largest =
        |from: usize, count: usize| samples.iter().copied().skip(from).take(count).max().unwrap_or(0);
    [largest(second, quarter), largest(last, samples.len())]
}
