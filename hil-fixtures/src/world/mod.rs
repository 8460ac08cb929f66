//! Known worlds: labelled surfaces and paths to drive through them.
//!
//! Named worlds are built by code; any triangle mesh can be one, with a path from a file. Each world has its own frame (metres,
//! z up); a drive moves it so that the drive starts at the origin of `map`.

pub mod builder;
pub mod corridor;
pub mod mesh;
pub mod path;
pub mod scene;

use mesh::LabelledMesh;
use path::Path;

/// Names that [`World::named`] knows.
pub const NAMES: [&str; 1] = ["corridor"];

/// Surfaces, and ways to drive along them.
#[derive(Clone, Debug)]
pub struct World {
    /// Its name, or the file's.
    pub name: String,
    /// All surfaces, in the world's own frame.
    pub mesh: LabelledMesh,
    /// Built-in paths; the first is the usual one. Empty for a mesh from a file.
    pub paths: Vec<Path>,
}

impl World {
    /// The built-in world of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "corridor" => Some(corridor::corridor()),
            _ => None,
        }
    }

    /// The built-in path of that name; the usual one without a name.
    #[must_use]
    pub fn path(&self, name: Option<&str>) -> Option<&Path> {
        match name {
            Some(name) => self.paths.iter().find(|path| path.name == name),
            None => self.paths.first(),
        }
    }
}
