//! From the broken file to its copy.

use super::report::{RecoverError, RecoverReport};
use super::salvage::Salvage;
use super::walk::{self, Walk};
use crate::file_kind::KIND_BYTES;
use crate::mcap::read::{ReadError, Source};
use crate::mcap::records::MAGIC;
use crate::mcap::write::{Writer, WriterOptions, recovering_path};
use std::fs::File;
use std::io;
use std::path::Path;

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

/// The same, with all that can be told of the new file. Once it has its name it is on the disk itself,
/// whatever the options say.
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
    let found = source.bytes(0, size.min(KIND_BYTES)).map_err(io)?.unwrap_or_default().to_vec();
    if found.starts_with(&MAGIC) {
        return Ok(Walk::new(source, MAGIC.len() as u64));
    }
    match walk::find_record(&mut source, 0).map_err(io)? {
        // The walk finds the place again, and reports what lies before it.
        Some(_) => Ok(Walk::new(source, 0)),
        None => Err(ReadError::NotMcap { path: input.to_owned(), found }),
    }
}
