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
use path::{Path, PathError};
use std::io;
use std::path::PathBuf;

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

/// Why there is no such world, or no such path through it.
#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    /// No built-in world, and no file that could be one.
    #[error("no world `{name}`: built in are {}; a file must end in .obj or .ply", NAMES.join(", "))]
    Unknown {
        /// What was asked for.
        name: String,
    },
    /// A file could not be read.
    #[error("cannot read {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The path file is no path.
    #[error("{}: {source}", path.display())]
    PathFile {
        /// The file.
        path: PathBuf,
        /// Why.
        source: PathError,
    },
    /// Neither a path of this world nor a file.
    #[error("no path `{name}` through world `{world}`: it has {known}; or give a path file (.toml)")]
    UnknownPath {
        /// What was asked for.
        name: String,
        /// The world.
        world: String,
        /// The paths that it has.
        known: String,
    },
    /// A mesh from a file has no path of its own.
    #[error("world `{world}` has no path of its own: give a path file (`--path`)")]
    NoPath {
        /// The world.
        world: String,
    },
}

impl World {
    /// A built-in world by name, or a mesh from a file.
    pub fn open(name: &str) -> Result<Self, WorldError> {
        Self::named(name).ok_or_else(|| WorldError::Unknown { name: name.to_owned() })
    }

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

    /// The built-in path of that name, or the path in that file; the usual one without a name.
    pub fn path_or_file(&self, name: Option<&str>) -> Result<Path, WorldError> {
        if let Some(path) = self.path(name) {
            return Ok(path.clone());
        }
        let world = self.name.clone();
        let Some(name) = name else { return Err(WorldError::NoPath { world }) };
        if !name.ends_with(".toml") {
            let known: Vec<&str> = self.paths.iter().map(|path| path.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            return Err(WorldError::UnknownPath { name: name.to_owned(), world, known });
        }
        let file = PathBuf::from(name);
        let text = std::fs::read_to_string(&file)
            .map_err(|source| WorldError::File { path: file.clone(), source })?;
        Path::parse(&text).map_err(|source| WorldError::PathFile { path: file, source })
    }
}
