//! `--world` and `--path`: a named world and one of its paths.

use super::BadArgument;
use biplane_mock::world::path::Path;
use biplane_mock::world::{NAMES, World};

/// The world and the path to drive through it.
pub fn load(world: &str, path: Option<&str>) -> anyhow::Result<(World, Path)> {
    let found = World::named(world)
        .ok_or_else(|| BadArgument(format!("unknown world `{world}`; known: {}", NAMES.join(", "))))?;
    let names: Vec<&str> = found.paths.iter().map(|path| path.name.as_str()).collect();
    let names = names.join(", ");
    let chosen = found.path(path).cloned().ok_or_else(|| {
        BadArgument(format!("world `{world}` has no path `{}`; it has: {names}", path.unwrap_or("")))
    })?;
    Ok((found, chosen))
}
