//! The stage of a build that finds rooms, walls, doors and windows.

use crate::building::elements::Elements;
use crate::cli::terminal::stages::Stages;
use crate::pipeline::rooms::StoreyDrive;
use crate::pipeline::{self, BuildOutput};

/// The stages of a build, but for the search for loops, which comes before them.
pub(super) const STEPS: [&str; 10] =
    ["read", "map", "cloud", "mesh", "planes", "polygons", "leftovers", "rooms", "write", "report"];

/// Finds them where there is a model, and lets its surfaces follow them unless they stay as they were seen.
pub(super) fn elements(
    output: &mut BuildOutput,
    storeys: &[StoreyDrive<'_>],
    as_seen: bool,
    stages: &mut Stages<'_>,
) -> anyhow::Result<Elements> {
    if output.cloud.is_empty() {
        return Ok(Elements::default());
    }
    stages.time("rooms", || {
        let found = pipeline::rooms::elements(output, storeys, as_seen);
        let count = found.rooms.len();
        anyhow::Ok((found, count))
    })
}
