//! Commands that make recordings: live, from a file, or from the remains of an interrupted run.

pub(crate) mod record;
pub(crate) mod replay;
pub(crate) mod salvage;
pub(crate) mod summary;

use std::path::{Path, PathBuf};

use biplane_recording::WriteError;
use biplane_recording::mcap::write::check_outputs;

/// Refuses a recording and a journal that would destroy the rig's file or one another, before any work.
fn check(output: &Path, journal: Option<&Path>, rig: &[PathBuf], force: bool) -> Result<(), WriteError> {
    let outputs: Vec<&Path> = std::iter::once(output).chain(journal).collect();
    check_outputs(&outputs, rig, force)
}
