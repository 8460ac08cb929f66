//! Why a file is no PLY that can be read here.

/// Why a file is no PLY that can be read here.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlyError {
    /// The first line is not `ply`.
    #[error("not a PLY file: it does not begin with the line `ply`")]
    NotPly,
    /// A line of the header is none.
    #[error("line {line} of the PLY header: expected {expected}, found `{found}`")]
    Header {
        /// Line in the file, from 1.
        line: usize,
        /// What would have been right.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
    /// The header promises more than the file holds.
    #[error("the PLY file ends inside {element} {index} of {count}")]
    Truncated {
        /// Name of the element.
        element: String,
        /// Which one, from 0.
        index: usize,
        /// How many the header promises.
        count: usize,
    },
    /// A word of an ASCII file is no number.
    #[error("{element} {index} of the PLY file: expected a number, found `{found}`")]
    NotANumber {
        /// Name of the element.
        element: String,
        /// Which one, from 0.
        index: usize,
        /// What stands there.
        found: String,
    },
    /// A face refers to a vertex that is not there.
    #[error("face {face} of the PLY file refers to vertex {vertex}, there are {vertices}")]
    NoSuchVertex {
        /// Which face, from 0.
        face: usize,
        /// The vertex it names.
        vertex: i64,
        /// How many there are.
        vertices: usize,
    },
    /// The vertices have no coordinates.
    #[error("the PLY file has no vertices with the properties x, y and z")]
    NoVertices,
}
