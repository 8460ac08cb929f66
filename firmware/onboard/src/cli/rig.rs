//! The rig that a command is given, and what is said of it before any work.

use std::path::Path;

use biplane_recording::Rig;

use crate::types::error::OnboardError;

/// Reads a rig.toml for a file that is read, and says what of it is hardly meant.
///
/// # Errors
/// When it cannot be read or is wrong.
pub(crate) fn load(path: &Path) -> Result<Rig, OnboardError> {
    Ok(with_hints(Rig::load(path)?))
}

/// The same of a rig whose devices are opened.
///
/// # Errors
/// Also when devices share a port.
pub(crate) fn load_to_open(path: &Path) -> Result<Rig, OnboardError> {
    Ok(with_hints(Rig::load_to_open(path)?))
}

fn with_hints(rig: Rig) -> Rig {
    rig.hints().iter().for_each(|hint| tracing::warn!("{hint}"));
    rig
}
