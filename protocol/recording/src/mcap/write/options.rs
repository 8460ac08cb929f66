//! How a recording is written.

use super::Disk;
use std::path::PathBuf;

/// How a recording is written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct WriterOptions {
    /// Replace an existing file, and an unfinished one, of that name. Otherwise both are an error.
    pub overwrite: bool,
    /// Files that the output is made from: they are never replaced, under no name, not even when told to
    /// overwrite.
    pub inputs: Vec<PathBuf>,
    /// [`Writer::flush`](super::Writer::flush) waits until everything so far is on the disk itself
    /// (`fdatasync`), and so does [`Writer::finish`](super::Writer::finish), for the file's name too. For
    /// live recording, where [`PartsWriter::save_if_due`](super::PartsWriter::save_if_due) then keeps a power
    /// cut within a second; a replay writes hours in seconds and would only wait.
    pub sync: bool,
    /// A chunk is closed before a message whose log time is this much after the chunk's first, in ns. Larger
    /// packs better and loses more in a crash. The default of 0.9 s leaves time for writing within the second
    /// that is promised.
    pub chunk_span_ns: i64,
    /// A chunk is closed when its messages take this many bytes.
    pub chunk_bytes: u64,
    /// Raise a log time before an earlier one to it. Without this a file may step back in time, as one of a
    /// recorder that trusts a clock that steps: for tests of those who have to read it.
    pub in_order: bool,
    /// Where to write.
    pub disk: Disk,
}

impl Default for WriterOptions {
    fn default() -> Self {
        Self {
            overwrite: false,
            inputs: Vec::new(),
            sync: false,
            chunk_span_ns: 900_000_000,
            chunk_bytes: 1 << 20,
            in_order: true,
            disk: Disk::default(),
        }
    }
}
