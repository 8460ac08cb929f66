//! The stage of a build that finds rooms, walls, doors and windows.

use crate::building::elements::Elements;
use crate::cli::terminal::stages::Stages;
use crate::pipeline::{self, BuildOutput};
use crate::recordings::deskew::StampedPose;
use crate::slam::occupancy::OccupancyGrid;

/// The robot stands on a floor, whether the laser sees it or not: z = 0.
pub(super) const FLOOR_M: Option<f64> = Some(0.0);

/// The stages of a build, but for the search for loops, which comes before them.
pub(super) const STEPS: [&str; 10] =
    ["read", "map", "cloud", "mesh", "planes", "polygons", "leftovers", "rooms", "write", "report"];

/// Finds them where there is a model, and lets its surfaces follow them unless they stay as they were seen.
pub(super) fn elements(
    output: &mut BuildOutput,
    map: &OccupancyGrid,
    poses: &[StampedPose],
    as_seen: bool,
    stages: &mut Stages<'_>,
) -> anyhow::Result<Elements> {
    if output.cloud.is_empty() {
        return Ok(Elements::default());
    }
    stages.time("rooms", || {
        let found = pipeline::rooms::elements(output, map, poses, FLOOR_M.unwrap_or(0.0), as_seen);
        let count = found.rooms.len();
        anyhow::Ok((found, count))
    })
}
