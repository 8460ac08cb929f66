//! `--world`, `--path` and `--rig`: names or files.

use super::BadArgument;
use crate::world::path::Path as DrivePath;
use crate::world::{World, WorldError};
use biplane_recording::Rig;
use std::path::Path;

/// The world and the path to drive through it.
pub(super) fn load(world: &str, path: Option<&str>) -> anyhow::Result<(World, DrivePath)> {
    let world = World::open(world).map_err(argument)?;
    let path = world.path_or_file(path).map_err(argument)?;
    Ok((world, path))
}

/// The rig in a file; the template without one.
pub(super) fn rig(file: Option<&Path>) -> anyhow::Result<Rig> {
    Ok(file.map(Rig::load).transpose()?.unwrap_or_default())
}

/// A name that nothing has is a bad argument; a file that cannot be read is a failure.
fn argument(error: WorldError) -> anyhow::Error {
    match error {
        WorldError::Unknown { .. } | WorldError::UnknownPath { .. } | WorldError::NoPath { .. } => {
            BadArgument(error.to_string()).into()
        }
        other => other.into(),
    }
}
