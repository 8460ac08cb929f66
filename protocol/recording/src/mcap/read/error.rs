//! Why a file could not be read: what was expected, what was found, at which byte.

use crate::file_kind::describe;
use crate::messages::cdr::CdrError;
use crate::rig::RigError;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file, or a message in it, could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// There is no such file.
    #[error("{} does not exist", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// There is no such file, but one that was begun under that name.
    #[error("{} is not there yet, and {}", path.display(), unfinished_words(unfinished))]
    Unfinished {
        /// The file.
        path: PathBuf,
        /// The one that was begun.
        unfinished: PathBuf,
    },
    /// Several files were given that are no parts of one recording.
    #[error(
        "{} and {} are no parts of one recording (NAME_0.mcap, NAME_1.mcap, ...); `biplane optimize` joins several recordings to one",
        other.display(),
        path.display()
    )]
    NotOneRecording {
        /// The file that does not fit.
        path: PathBuf,
        /// One of the others.
        other: PathBuf,
    },
    /// It is a folder.
    #[error("{} is a folder, not an MCAP file", path.display())]
    Directory {
        /// The folder.
        path: PathBuf,
    },
    /// It is something else.
    #[error("{} is not an MCAP file: it {}", path.display(), describe(found))]
    NotMcap {
        /// The file.
        path: PathBuf,
        /// How it begins, at most [`KIND_BYTES`](crate::file_kind::KIND_BYTES).
        found: Vec<u8>,
    },
    /// It ends too early.
    #[error(
        "{} is cut off: the record at byte {offset} is not whole, the file ends at byte {size}; {}",
        path.display(),
        cut_words(path)
    )]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Where the record begins that is not whole; everything before it is.
        offset: u64,
        /// The file's size.
        size: u64,
    },
    /// Its bytes are not those that were written.
    #[error("{} is damaged at byte {offset}: {what}; `biplane recover` salvages what is intact", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where the record begins that is damaged.
        offset: u64,
        /// What is wrong with it.
        what: String,
    },
    /// The system refused.
    #[error("cannot read {} at byte {offset}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Where.
        offset: u64,
        /// What the system said.
        source: io::Error,
    },
    /// A message is not of its type.
    #[error("{}message on {topic} at log time {log_time_ns} ns cannot be decoded: {source}", place(path.as_deref()))]
    Message {
        /// The file, where it is known: a message alone does not know it, see [`ReadError::in_file`].
        path: Option<PathBuf>,
        /// The topic.
        topic: String,
        /// Which message: its log time, in ns.
        log_time_ns: i64,
        /// What is wrong with it.
        source: CdrError,
    },
    /// The attachment `rig.toml` is not a rig.
    #[error("attachment rig.toml of {}: {source}", path.display())]
    Rig {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: RigError,
    },
}

impl ReadError {
    /// The same error, naming the file that it was met in if it does not yet.
    #[must_use]
    pub fn in_file(self, file: &Path) -> Self {
        match self {
            Self::Message { path: None, topic, log_time_ns, source } => {
                Self::Message { path: Some(file.to_owned()), topic, log_time_ns, source }
            }
            other => other,
        }
    }
}

fn place(path: Option<&Path>) -> String {
    path.map_or_else(String::new, |path| format!("{}: ", path.display()))
}

/// What to do with a file that was begun and has not got its name.
fn unfinished_words(unfinished: &Path) -> String {
    format!(
        "{} is unfinished: a program writes it still, or was stopped in it (a power cut); then `biplane recover {} -o \
         {}` makes it whole",
        unfinished.display(),
        unfinished.display(),
        unfinished.with_extension("").display()
    )
}

/// What to do with a file that ends too early.
fn cut_words(path: &Path) -> String {
    match path.extension() {
        Some(end) if end == "active" => unfinished_words(path),
        _ => "`biplane recover` salvages what is there".to_owned(),
    }
}
