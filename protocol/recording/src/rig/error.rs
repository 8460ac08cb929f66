//! What is wrong with a `rig.toml`, by line and key: all of it at once.

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
    /// It is no text at all, but a file of another kind.
    #[error("{} {what}, and no rig.toml", path.display())]
    NoText {
        /// The file.
        path: PathBuf,
        /// What it is, for example "is an MCAP file".
        what: String,
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
    #[error("{}missing key `{key}`: it has no default", line.map_or_else(String::new, |line| format!("line {line}: ")))]
    MissingKey {
        /// Where its section begins, counted from 1; `None` when the section is missing too.
        line: Option<usize>,
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
    /// Two devices on one port, or at one address.
    #[error(
        "line {line}: `{key}` is {port:?}, as is `{other}` in line {other_line}: each device needs its own"
    )]
    SharedPort {
        /// Counted from 1.
        line: usize,
        /// The second one's key with its table.
        key: String,
        /// The port or the address.
        port: String,
        /// The first one's key.
        other: String,
        /// Where that stands.
        other_line: usize,
    },
    /// More than one thing is wrong; what has a line comes in the order of the text.
    #[error("{} faults{}:{}", faults.len() + more, first(*more), faults.iter().map(|fault| format!("\n  {fault}")).collect::<String>())]
    Several {
        /// What is wrong, each by itself.
        faults: Vec<RigError>,
        /// So many more were found.
        more: usize,
    },
}

fn first(more: usize) -> &'static str {
    if more > 0 { ", the first of them" } else { "" }
}

impl RigError {
    /// All faults of a text as one, with so many more that are not named; `None` when there is none.
    pub(crate) fn of(mut faults: Vec<Self>, more: usize) -> Option<Self> {
        faults.sort_by_key(|fault| fault.line().unwrap_or(usize::MAX));
        if faults.len() + more < 2 {
            return faults.pop();
        }
        Some(Self::Several { faults, more })
    }

    /// Where in the text it is, counted from 1.
    fn line(&self) -> Option<usize> {
        match self {
            Self::Syntax { line, .. }
            | Self::UnknownKey { line, .. }
            | Self::Value { line, .. }
            | Self::SharedPort { line, .. } => Some(*line),
            Self::MissingKey { line, .. } => *line,
            Self::File { .. }
            | Self::NoText { .. }
            | Self::In { .. }
            | Self::NoBase
            | Self::Several { .. } => None,
        }
    }

    /// The key that it is about, with its tables.
    pub(crate) fn key(&self) -> Option<&str> {
        match self {
            Self::UnknownKey { key, .. }
            | Self::MissingKey { key, .. }
            | Self::Value { key, .. }
            | Self::SharedPort { key, .. } => Some(key),
            Self::File { .. }
            | Self::NoText { .. }
            | Self::In { .. }
            | Self::Syntax { .. }
            | Self::NoBase
            | Self::Several { .. } => None,
        }
    }
}
