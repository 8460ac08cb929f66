//! Why a file is no model that can be read here.

/// Why a file is no model that can be read here.
#[derive(Debug, thiserror::Error)]
pub enum ModelFileError {
    /// It is no JSON, not whole, or something in it is not of the layout.
    #[error("expected the model of a build: {0}")]
    Json(#[from] serde_json::Error),
    /// It is of something else.
    #[error("expected a file of the format \"biplane-model\", found \"{found}\"")]
    NotOurs {
        /// What it says it is, shortened.
        found: String,
    },
    /// It is of another layout.
    #[error(
        "expected a file of version {known}, found version {found}, which another version of this program wrote"
    )]
    Version {
        /// The file's.
        found: u64,
        /// The one that can be read.
        known: u64,
    },
    /// A polygon lies on a plane that is not there.
    #[error("polygon {polygon} lies on plane {plane}, there are {planes}")]
    NoSuchPlane {
        /// Which polygon, from 0.
        polygon: usize,
        /// The plane it names.
        plane: usize,
        /// How many there are.
        planes: usize,
    },
    /// A plane's normal has no unit length.
    #[error("plane {plane}: expected a normal of length 1, found one of length {length}")]
    NotUnit {
        /// Which plane, from 0.
        plane: usize,
        /// The length.
        length: f64,
    },
    /// The normal of a surface that is inferred has no unit length.
    #[error("inferred surface {surface}: expected a normal of length 1, found one of length {length}")]
    InferredNotUnit {
        /// Which surface, from 0.
        surface: usize,
        /// The length.
        length: f64,
    },
    /// A triangle of the leftovers refers to a vertex that is not there.
    #[error("leftover triangle {triangle} refers to vertex {vertex}, there are {vertices}")]
    NoSuchVertex {
        /// Which triangle, from 0.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// A round thing has no radius, no length or no arc.
    #[error("cylinder {cylinder}: expected a radius, a length and an arc above 0, and an axis of length 1")]
    NoCylinder {
        /// Which one, from 0.
        cylinder: usize,
    },
}
