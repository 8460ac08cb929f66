//! When what was written goes to the disk itself, so that a power cut costs a second at most: by the clock, not by the next message,
//! which may never come.

use super::{PartsWriter, WriteError};

/// What a power cut may cost, in ns.
pub const PROMISED_NS: i64 = 1_000_000_000;
/// Left of that for a disk that takes a little longer than the last times, ns.
const RESERVE_NS: i64 = 100_000_000;
/// However slow the disk, what is saved together is at least so much, ns: smaller chunks would pack worse, and cost a slow disk more.
const SHORTEST_NS: i64 = 200_000_000;

/// How fast the disk has been.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(super) struct Pace {
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
    fn patience_ns(self) -> i64 {
        (PROMISED_NS - RESERVE_NS - self.expected_ns).max(SHORTEST_NS)
    }

    fn saved(&mut self, took_ns: i64, age_ns: i64) {
        self.expected_ns = took_ns.max(self.expected_ns - self.expected_ns / 8);
        self.worst_ns = self.worst_ns.max(age_ns);
    }
}

impl PartsWriter {
    /// Brings everything so far to the disk when the first message that is not there yet becomes so old that it could be more than
    /// [`PROMISED_NS`] when it is there; true when that was done. Log times must be those of `clock`.
    ///
    /// Whoever records live calls this often, and whenever there is nothing more to write for the moment: then a disk that is slower
    /// than the promise takes all that has come meanwhile at once, and falls no further behind.
    ///
    /// # Errors
    /// As [`PartsWriter::flush`].
    pub fn save_if_due(&mut self, clock: &dyn Fn() -> i64) -> Result<bool, WriteError> {
        let Some(since_ns) = self.writer()?.unsaved_since_ns() else { return Ok(false) };
        let start_ns = clock();
        if start_ns.saturating_sub(since_ns) < self.pace.patience_ns() {
            return Ok(false);
        }
        self.flush()?;
        let end_ns = clock();
        self.pace.saved(end_ns - start_ns, end_ns - since_ns);
        Ok(true)
    }

    /// What a power cut would have cost in the worst moment since this was last asked, ns: the greatest age that a message came to
    /// before it was on the disk, so far as [`PartsWriter::save_if_due`] brought it there.
    pub fn take_worst_age_ns(&mut self) -> i64 {
        std::mem::take(&mut self.pace.worst_ns)
    }
}
