//! Rooms, walls, doors and windows of a build, from its points, its floor map and its path.

use crate::building;
use crate::building::elements::Elements;
use crate::building::spaces::evidence::{Evidence, grid_around, seen_in};
use crate::pipeline::BuildOutput;
use crate::recordings::deskew::StampedPose;
use crate::slam::occupancy::OccupancyGrid;

/// The elements of the building that a drive went through, on a floor at this height, meters.
pub(crate) fn elements(
    output: &BuildOutput,
    map: &OccupancyGrid,
    poses: &[StampedPose],
    floor_m: f64,
) -> Elements {
    let path_m: Vec<[f64; 2]> = poses.iter().map(|pose| [pose.x_m, pose.y_m]).collect();
    let grid = grid_around(&output.model, &path_m);
    let seen = seen_in(&grid, map);
    building::rooms(&Evidence {
        model: &output.model,
        cloud: &output.cloud,
        labels: &output.labels,
        grid: &grid,
        seen: &seen,
        path_m: &path_m,
        floor_m,
        sigma_m: output.counts.sigma_m,
    })
}
