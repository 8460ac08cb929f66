//! Why a file could not be written: what was tried, on which file, what the system said.

use mcap::McapError;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file is there already.
    #[error("{} exists already; it is not overwritten without --force", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// An unfinished recording of that name is there: of a run that still goes on, or that was cut off.
    #[error(
        "{} exists: an unfinished recording, not overwritten unless asked; `biplane recover` salvages it, if no process is still writing it",
        path.display()
    )]
    Unfinished {
        /// The unfinished file.
        path: PathBuf,
    },
    /// Another process is writing a recording that has this name until it is finished.
    #[error("{} is being written by another process: it is not replaced, not even with --force", path.display())]
    BeingWritten {
        /// The unfinished file.
        path: PathBuf,
    },
    /// Output, or the name under which it is written until it is finished, is an input.
    #[error("{}: it is not overwritten; name another output", names_of_input(path, input))]
    IsInput {
        /// The output's name.
        path: PathBuf,
        /// The input, as it was named.
        input: PathBuf,
    },
    /// Two outputs of one run are one file.
    #[error("{} is another output of the same run: name two different files", path.display())]
    IsOutput {
        /// The second one's name.
        path: PathBuf,
    },
    /// A folder, a device, a pipe: nothing that a file could replace.
    #[error("{} is there and is not a regular file: it is not replaced", path.display())]
    NotAFile {
        /// What is there.
        path: PathBuf,
    },
    /// The name under which the output is written until it is finished is taken by something that is no
    /// recording.
    #[error(
        "{} is in the way: the output has this name until it is finished, and what is there is no unfinished recording",
        path.display()
    )]
    InTheWay {
        /// What is there.
        path: PathBuf,
    },
    /// A copy in the making is there: of a recovery that still goes on, or that was cut off.
    #[error(
        "{} exists: left by a recovery that was cut off, or of one that still goes on; remove it in the first case",
        path.display()
    )]
    Recovering {
        /// The unfinished copy.
        path: PathBuf,
    },
    /// No room is left.
    #[error("disk full while writing {}", path.display())]
    DiskFull {
        /// The file.
        path: PathBuf,
    },
    /// The system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A write failed before; nothing more can be added.
    #[error("{} cannot be written any more: an earlier write failed", path.display())]
    Failed {
        /// The file.
        path: PathBuf,
    },
    /// The format refuses it.
    #[error("cannot write to {}: {what}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Why.
        what: String,
    },
}

/// "a.mcap is an input"; by another name "link.mcap is the input a.mcap".
fn names_of_input(path: &Path, input: &Path) -> String {
    match path == input {
        true => format!("{} is an input", path.display()),
        false => format!("{} is the input {}", path.display(), input.display()),
    }
}

pub(crate) fn refused(action: &'static str, path: &Path, source: io::Error) -> WriteError {
    let path = path.to_owned();
    match source.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => WriteError::DiskFull { path },
        _ => WriteError::Io { action, path, source },
    }
}

pub(crate) fn explain(path: &Path, error: McapError) -> WriteError {
    match error {
        McapError::Io(source) => refused("write", path, source),
        McapError::AttemptedWriteAfterFailure => WriteError::Failed { path: path.to_owned() },
        other => WriteError::Format { path: path.to_owned(), what: other.to_string() },
    }
}
