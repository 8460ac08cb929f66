//! Counts in messages: "1 scan", "2 scans".

/// A count with its noun, which takes an "s" unless there is exactly one.
///
/// ```
/// # use biplane_cli::counted;
/// assert_eq!([counted(0, "scan"), counted(1, "scan"), counted(2, "scan")], ["0 scans", "1 scan", "2 scans"]);
/// ```
pub fn counted(count: impl TryInto<u64>, noun: &str) -> String {
    // A count that is negative or beyond 64 bits does not occur: lengths and counters come here.
    let count: u64 = count.try_into().unwrap_or(u64::MAX);
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}
