//! What was written.

use std::path::PathBuf;

/// What a finished file holds.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WriteReport {
    /// Where it is.
    pub path: PathBuf,
    /// How many messages it holds.
    pub messages: u64,
    /// How many chunks.
    pub chunks: u64,
    /// Its size.
    pub bytes: u64,
}

/// A file that was removed or moved away while it was written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TakenAway {
    /// The name that it had.
    pub path: PathBuf,
    /// Whether it was removed: what was in it is lost. One that was moved is whole, wherever it is now.
    pub is_removed: bool,
    /// How many messages it holds.
    pub messages: u64,
    /// Where the recording goes on; nothing when no file could be begun there, and it goes on in the old one.
    pub goes_on_in: Option<PathBuf>,
}
