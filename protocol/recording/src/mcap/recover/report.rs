//! What was saved of a broken file, or why nothing could be.

use super::finding::{Finding, Problem};
use crate::mcap::read::ReadError;
use crate::mcap::write::WriteError;

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

    /// Messages known to be lost, by the index beside their chunk. More may be: a lost chunk does not always
    /// say.
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
