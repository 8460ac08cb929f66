//! How much memory a build takes: told before it begins, asked again when it is known how much of the drive
//! shows something new, and kept to by the system.

use biplane_cli::memory::{self, megabytes};

/// For each range of the vertical laser, whatever it shows: the range itself, poses, files that are read.
const BYTES_PER_RANGE: u64 = 8;
/// For each point that shows something new, in all stages: a rough figure on the safe side for dense scans.
/// Where points are sparse, and cells have few of them, it takes more.
const BYTES_PER_FIRST_VIEW: u64 = 300;
/// For everything else.
const OTHER_BYTES: u64 = 25_000_000;

/// Memory that a build of some ranges takes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Needs {
    /// When hardly anything shows something new, bytes.
    pub min_bytes: u64,
    /// When everything does, bytes.
    pub max_bytes: u64,
}

impl Needs {
    /// Of so many ranges.
    pub(crate) fn of(ranges: u64) -> Self {
        let min_bytes = OTHER_BYTES + BYTES_PER_RANGE * ranges;
        Self { min_bytes, max_bytes: min_bytes + BYTES_PER_FIRST_VIEW * ranges }
    }

    /// For people.
    pub(crate) fn words(self) -> String {
        let Self { min_bytes, max_bytes } = self;
        let may_have =
            memory::limit().map_or("all of the machine".to_owned(), |limit| megabytes(limit.bytes));
        format!(
            "at most {} of memory, less where surfaces are seen again, and {} at least; it may have {may_have}",
            megabytes(max_bytes),
            megabytes(min_bytes)
        )
    }
}

/// Keeps the program below a bound, or the usual one where none is given.
///
/// # Errors
/// A sentence, when the system refuses.
pub(crate) fn keep_below(bytes: Option<u64>) -> Result<(), String> {
    bytes.or_else(memory::usual_bound).map_or(Ok(()), memory::keep_below)
}

/// Asks whether there is memory enough for what is known to show something new.
///
/// # Errors
/// A sentence, when there is not.
pub(crate) fn expect_first_views(points: usize) -> Result<(), String> {
    memory::expect_need(OTHER_BYTES + BYTES_PER_FIRST_VIEW * points as u64)
}
