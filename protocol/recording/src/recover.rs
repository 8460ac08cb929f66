//! Salvages a recording that was cut off or torn.

use crate::read::ReadError;
use crate::write::WriteError;
use std::path::Path;

/// What was saved, and what was not.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct RecoverReport {
    /// Messages kept.
    pub messages: u64,
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

/// Copies what is intact in `input` to the new file `output`.
///
/// # Errors
/// When the input is no MCAP at all, or the output exists or cannot be written.
pub fn recover(input: &Path, output: &Path) -> Result<RecoverReport, RecoverError> {
    let reader = crate::Reader::open_unfinished(input)?;
    let mut writer = crate::Writer::create(output, &crate::WriterOptions::default())?;
    for entry in reader.messages() {
        match entry {
            Ok(entry) => writer.copy(&entry)?,
            Err(_) => break,
        }
    }
    Ok(RecoverReport { messages: writer.finish()?.messages })
}
