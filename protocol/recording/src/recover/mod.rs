//! Salvages a recording that was cut off or torn: what is intact is copied to a new file, the broken one is only read.
//!
//! * A record that is not whole, or is not what it says, is passed over; the next one that proves itself is searched for.
//! * Every message of a chunk whose checksum holds is kept.
//! * A chunk that was cut off, or whose bytes were never written (a hole of zeros after a power cut), gives the messages before
//!   the cut.
//! * A whole chunk whose checksum fails gives nothing: which of its messages is damaged cannot be told, and a damaged message
//!   must not pass for a good one.
//! * Channels whose definition was lost are taken from the index at the file's end, if that is left.
//!
//! Whether data was lost can be known only when the file's own end of data is there and all before it is intact. A recording that
//! was cut off may always have lost what was not on the disk yet.

mod finding;
mod hole;
mod salvage;
mod walk;

pub use finding::{Finding, Problem};

use crate::read::{ReadError, Source};
use crate::records::MAGIC;
use crate::write::{WriteError, Writer, WriterOptions, recovering_path};
use salvage::Salvage;
use std::fs::File;
use std::io;
use std::path::Path;
use walk::Walk;

/// What was saved, and what was not.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct RecoverReport {
    /// Messages kept.
    pub messages: u64,
    /// Attachments kept.
    pub attachments: u64,
    /// Metadata records kept.
    pub metadata: u64,
    /// Chunks that were whole.
    pub chunks: u64,
    /// What was found wrong, in the order of the file.
    pub findings: Vec<Finding>,
}

impl RecoverReport {
    /// True when something was lost, or may have been. False: at most the index or the footer was missing.
    #[must_use]
    pub fn lost(&self) -> bool {
        self.findings.iter().any(|finding| finding.problem.loses_data())
    }

    /// Bytes of the input that could not be used, index aside.
    #[must_use]
    pub fn lost_bytes(&self) -> u64 {
        self.findings.iter().filter(|finding| finding.problem.loses_data()).map(|finding| finding.bytes).sum()
    }

    /// Bytes that the input announces and does not have, as far as it says.
    #[must_use]
    pub fn missing_bytes(&self) -> u64 {
        self.findings.iter().map(|finding| finding.missing_bytes).sum()
    }

    /// Messages known to be lost, by the index beside their chunk. More may be: a lost chunk does not always say.
    #[must_use]
    pub fn lost_messages(&self) -> u64 {
        self.findings.iter().map(|finding| finding.lost_messages).sum()
    }

    /// True when the index or the footer at the file's end was missing or broken.
    #[must_use]
    pub fn index_missing(&self) -> bool {
        self.findings.iter().any(|finding| {
            matches!(finding.problem, Problem::NoIndex | Problem::DamagedIndex | Problem::NoEnd)
        })
    }

    /// The exit code of `biplane recover`: 0 when nothing was lost, 3 when something was or may have been.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        if self.lost() { 3 } else { 0 }
    }
}

impl std::fmt::Display for RecoverReport {
    /// Findings, one a line, then a line that sums up.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for finding in &self.findings {
            writeln!(f, "{finding}")?;
        }
        let Self { messages, attachments, metadata, .. } = self;
        write!(f, "kept {messages} messages, {attachments} attachments, {metadata} metadata records; ")?;
        match (self.lost(), self.findings.is_empty()) {
            (true, _) => write!(
                f,
                "data was or may be lost: {} bytes unusable, {} bytes missing, {} messages known to be lost",
                self.lost_bytes(),
                self.missing_bytes(),
                self.lost_messages()
            ),
            (false, true) => write!(f, "the file was whole"),
            (false, false) => write!(f, "no data lost"),
        }
    }
}

/// Why nothing could be saved.
#[derive(Debug, thiserror::Error)]
pub enum RecoverError {
    /// The input cannot be read at all.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The output cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Copies what is intact in `input` to the new file `output`, with a new index. The input is never touched.
///
/// # Errors
/// When the input does not exist or is no MCAP at all, or the output exists or cannot be written.
pub fn recover(input: &Path, output: &Path) -> Result<RecoverReport, RecoverError> {
    recover_over(input, output, false)
}

/// The same; an `output` that exists is replaced when `overwrite` says so, but never the input.
///
/// # Errors
/// As [`recover`].
pub fn recover_over(input: &Path, output: &Path, overwrite: bool) -> Result<RecoverReport, RecoverError> {
    recover_with(input, output, &WriterOptions { overwrite, ..WriterOptions::default() })
}

/// The same, with all that can be told of the new file. Once it has its name it is on the disk itself, whatever the options say.
///
/// # Errors
/// As [`recover`].
pub fn recover_with(
    input: &Path,
    output: &Path,
    options: &WriterOptions,
) -> Result<RecoverReport, RecoverError> {
    let cannot = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => ReadError::Missing { path: input.to_owned() },
        _ => ReadError::Io { path: input.to_owned(), offset: 0, source },
    };
    let file = File::open(input).map_err(cannot)?;
    let metadata = file.metadata().map_err(cannot)?;
    if metadata.is_dir() {
        return Err(ReadError::Directory { path: input.to_owned() }.into());
    }
    let size = metadata.len();
    let walk = start(input, &file, size)?;
    let profile = walk::profile(&mut Source::new(&file, size)).map_err(cannot)?;
    let writer = Writer::create_copy(output, input, &profile, options)?;
    let mut salvage = Salvage::new(input, &file, size, writer);
    let report = match salvage.run(walk) {
        Ok(()) => salvage.finish().map_err(RecoverError::from),
        Err(error) => {
            drop(salvage);
            Err(error)
        }
    };
    if report.is_err() {
        // Half a copy is of no use, and the next attempt would take it for one of somebody else.
        let _ = options.disk.storage().remove(&recovering_path(output));
    }
    report
}

/// Where to begin: after the magic, or, when that is damaged, at the first record that proves itself.
fn start<'a>(input: &Path, file: &'a File, size: u64) -> Result<Walk<'a>, ReadError> {
    let io = |source| ReadError::Io { path: input.to_owned(), offset: 0, source };
    let mut source = Source::new(file, size);
    let found = source.bytes(0, size.min(MAGIC.len() as u64)).map_err(io)?.unwrap_or_default().to_vec();
    if found == MAGIC {
        return Ok(Walk::new(source, MAGIC.len() as u64));
    }
    match walk::find_record(&mut source, 0).map_err(io)? {
        // The walk finds the place again, and reports what lies before it.
        Some(_) => Ok(Walk::new(source, 0)),
        None => Err(ReadError::NotMcap { path: input.to_owned(), found }),
    }
}
