//! Why a file or a folder of results could not be written.

use std::io;
use std::path::{Path, PathBuf};

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OutputError {
    /// The file is there already.
    #[error("{} exists already; it is not overwritten without --force", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The folder is there already and holds something.
    #[error("{} exists already and is not empty; it is not overwritten without --force", path.display())]
    NotEmpty {
        /// The folder.
        path: PathBuf,
    },
    /// The name that the result has until it is finished is taken.
    #[error("{} exists already: it is the name of {} while that is written; move it away first", part.display(), path.display())]
    PartExists {
        /// The name that is taken.
        part: PathBuf,
        /// What was to be written.
        path: PathBuf,
    },
    /// Another run is writing the same.
    #[error("{} is being written by another run just now, as {}", path.display(), part.display())]
    Busy {
        /// Its unfinished folder.
        part: PathBuf,
        /// What was to be written.
        path: PathBuf,
    },
    /// Writing would destroy what is read.
    #[error("{}: name another output", words_of_input(output, input))]
    IsInput {
        /// What would be written.
        output: PathBuf,
        /// What is read.
        input: PathBuf,
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
}

impl OutputError {
    pub(crate) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { action, path: path.to_owned(), source }
    }
}

/// "a.mcap is read"; by another name "link.mcap is a.mcap, which is read".
fn words_of_input(output: &Path, input: &Path) -> String {
    match output == input {
        true => format!("{} is read", output.display()),
        false => format!("{} is {}, which is read", output.display(), input.display()),
    }
}

/// Why `part` could not be made; what is not its being there names `path`, which was asked for.
pub(crate) fn taken_or(action: &'static str, part: &Path, path: &Path, source: io::Error) -> OutputError {
    match source.kind() {
        io::ErrorKind::AlreadyExists => {
            OutputError::PartExists { part: part.to_owned(), path: path.to_owned() }
        }
        _ => OutputError::Io { action, path: path.to_owned(), source },
    }
}
