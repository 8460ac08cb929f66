//! What is wrong with a `rig.toml`, by line and key.

use std::path::PathBuf;

/// Why a text is no rig.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// The file cannot be read.
    #[error("cannot read rig {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// What is wrong with a file's text.
    #[error("{}: {source}", path.display())]
    In {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: Box<RigError>,
    },
    /// It is not TOML.
    #[error("line {line}: not TOML: {what}")]
    Syntax {
        /// Counted from 1.
        line: usize,
        /// What the TOML reader said.
        what: String,
    },
    /// A key that means nothing here.
    #[error("line {line}: unknown key `{key}`; known here: {known}")]
    UnknownKey {
        /// Counted from 1.
        line: usize,
        /// The key with its tables, for example `horizontal.mount.tilt`.
        key: String,
        /// What could stand here.
        known: String,
    },
    /// A key that must be there.
    #[error("missing key `{key}`: it has no default")]
    MissingKey {
        /// The key with its table, for example `horizontal.port`.
        key: String,
    },
    /// The section of the base must be there.
    #[error(
        "missing section [base] with its `port`; a rig whose base tells nothing, or a laser alone on the bench, has \
         `protocol = \"none\"` there and is matched without odometry"
    )]
    NoBase,
    /// A value that is not allowed.
    #[error("line {line}: `{key}` is {found}; allowed: {allowed}")]
    Value {
        /// Counted from 1.
        line: usize,
        /// The key with its tables.
        key: String,
        /// What stands there.
        found: String,
        /// What could.
        allowed: String,
    },
}
