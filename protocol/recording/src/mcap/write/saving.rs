//! When what was written goes to the disk itself, so that a power cut costs a second at most: by the clock,
//! not by the next message, which may never come.

/// What a power cut may cost, in ns.
pub const PROMISED_NS: i64 = 1_000_000_000;
/// Left of that for a disk that takes a little longer than the last times, ns.
const RESERVE_NS: i64 = 100_000_000;
/// However slow the disk, what is saved together is at least so much, ns: smaller chunks would pack worse,
/// and cost a slow disk more.
const SHORTEST_NS: i64 = 200_000_000;

/// How fast the disk has been.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct Pace {
    /// How long a save is expected to take, ns: as long as the slowest of the last few.
    expected_ns: i64,
    /// The greatest age that a message came to before it was on the disk, ns, since somebody asked.
    worst_ns: i64,
}

impl Default for Pace {
    /// A slow disk, until it has shown how fast it is.
    fn default() -> Self {
        Self { expected_ns: 300_000_000, worst_ns: 0 }
    }
}

impl Pace {
    /// How old the first message that is not on the disk may become before the next save begins, ns.
    pub(crate) fn patience_ns(self) -> i64 {
        (PROMISED_NS - RESERVE_NS - self.expected_ns).max(SHORTEST_NS)
    }

    pub(crate) fn saved(&mut self, took_ns: i64, age_ns: i64) {
        self.expected_ns = took_ns.max(self.expected_ns - self.expected_ns / 8);
        self.worst_ns = self.worst_ns.max(age_ns);
    }

    /// The greatest age since this was last asked, ns.
    pub(crate) fn take_worst_ns(&mut self) -> i64 {
        std::mem::take(&mut self.worst_ns)
    }
}
