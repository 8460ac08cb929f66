//! The rig that a command is given, and what is said of it before any work.

use std::path::Path;

use biplane_recording::Rig;

use crate::types::error::OnboardError;

/// Reads a rig.toml, and says what of it is hardly meant.
///
/// # Errors
/// When it cannot be read or is wrong.
pub(crate) fn load(path: &Path) -> Result<Rig, OnboardError> {
    let rig = Rig::load(path)?;
    rig.hints().iter().for_each(|hint| tracing::warn!("{hint}"));
    Ok(rig)
}
