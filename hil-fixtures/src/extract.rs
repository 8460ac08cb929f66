//! The serial bytes of a recording or capture, or of a stretch of it, as a capture of their own: how a field recording becomes a
//! fixture.
//!
//! Bytes, times and directions are kept as they are; everything but `/serial/...` is left out, the rig stays attached. Times are
//! nanoseconds on the input's clock; a stretch is given in seconds since its first serial byte.

use crate::same_file::{SameFile, refuse_same_file};
use biplane_recording::read::RIG_ATTACHMENT;
use biplane_recording::{ReadError, Reader, WriteError, WriteReport, Writer, WriterOptions};
use std::path::PathBuf;

/// What to take out.
#[derive(Clone, Debug, Default)]
pub struct ExtractOptions {
    /// A recording made with `--raw`, or a capture.
    pub input: PathBuf,
    /// The capture.
    pub output: PathBuf,
    /// Leave out what came earlier, seconds.
    pub from_s: Option<f64>,
    /// Leave out what came later, seconds.
    pub to_s: Option<f64>,
    /// Replace an existing capture.
    pub overwrite: bool,
}

/// Why nothing was taken out.
#[derive(Debug, thiserror::Error)]
pub enum ExtractError {
    /// The input.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The output.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The output is the input.
    #[error(transparent)]
    SameFile(#[from] SameFile),
    /// No serial bytes, or none in the stretch.
    #[error("{}: no serial bytes (/serial/...) there; a recording has them when it was made with --raw", input.display())]
    Nothing {
        /// The input.
        input: PathBuf,
    },
}

/// Writes the capture.
pub fn extract(options: &ExtractOptions) -> Result<WriteReport, ExtractError> {
    refuse_same_file(&options.input, &options.output)?;
    let reader = Reader::open(&options.input)?;
    let Some(first) = reader.serial().next().transpose()? else {
        return Err(ExtractError::Nothing { input: options.input.clone() });
    };
    let at_ns = |seconds: f64| first.time_ns.saturating_add((seconds * 1e9) as i64);
    let from_ns = options.from_s.map_or(i64::MIN, at_ns);
    let to_ns = options.to_s.map_or(i64::MAX, at_ns);
    let writer_options = WriterOptions { overwrite: options.overwrite, ..WriterOptions::default() };
    let mut writer = Writer::create(&options.output, &writer_options)?;
    if let Some(rig) = reader.attachment(RIG_ATTACHMENT)? {
        writer.attach(RIG_ATTACHMENT, "application/toml", &rig)?;
    }
    for read in reader.serial() {
        let read = read?;
        if (from_ns..=to_ns).contains(&read.time_ns) {
            writer.write_serial(read.port, read.direction, read.time_ns, &read.bytes)?;
        }
    }
    Ok(writer.finish()?)
}
