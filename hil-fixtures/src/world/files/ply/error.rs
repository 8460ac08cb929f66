//! What can be wrong in a PLY file.

/// What is wrong in a PLY file.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum PlyError {
    /// The head is no PLY head.
    #[error("line {line} of the head: expected {expected}, found `{found}`")]
    Header {
        /// Counted from 1.
        line: usize,
        /// What should stand there.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
    /// A format that is not read.
    #[error("format `{found}`: expected ascii or binary_little_endian")]
    Format {
        /// The format.
        found: String,
    },
    /// Something that a mesh needs is missing.
    #[error("no {what}")]
    Missing {
        /// What is missing.
        what: &'static str,
    },
    /// The file ends too early, or a word is no number.
    #[error("{element} {index} (from 0): expected a number at byte {offset} of the data, found {found}")]
    Data {
        /// Element.
        element: String,
        /// Which one.
        index: usize,
        /// Where.
        offset: usize,
        /// What is there.
        found: &'static str,
    },
    /// A face names a vertex that is not there.
    #[error("face {face} (from 0): vertex {found} of {vertices}")]
    Index {
        /// Which face.
        face: usize,
        /// What it names.
        found: f64,
        /// How many there are.
        vertices: usize,
    },
}
