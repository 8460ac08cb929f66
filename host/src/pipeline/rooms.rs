//! Rooms, walls, doors and windows of a build, from its points, its floor map and its path.

use crate::building;
use crate::building::elements::Elements;
use crate::building::spaces::evidence::{Evidence, grid_around, seen_in};
use crate::pipeline::BuildOutput;
use crate::recordings::deskew::StampedPose;
use crate::slam::occupancy::OccupancyGrid;

/// The elements of the building that a drive went through, on a floor at this height, meters. Unless all is
/// wanted as it was seen, the model's surfaces follow them, and what no laser saw of walls and floors is added
/// beside them, marked.
pub(crate) fn elements(
    output: &mut BuildOutput,
    map: &OccupancyGrid,
    poses: &[StampedPose],
    floor_m: f64,
    as_seen: bool,
) -> Elements {
    let path_m: Vec<[f64; 2]> = poses.iter().map(|pose| [pose.x_m, pose.y_m]).collect();
    let grid = grid_around(&output.model, &path_m);
    let seen = seen_in(&grid, map);
    let evidence = Evidence {
        model: &output.model,
        cloud: &output.cloud,
        labels: &output.labels,
        grid: &grid,
        seen: &seen,
        path_m: &path_m,
        floor_m,
        sigma_m: output.counts.sigma_m,
    };
    let elements = building::rooms(&evidence);
    if !as_seen && !elements.is_empty() {
        let polygons = building::surfaces::with_rectangles(&evidence, &elements);
        let inferred = building::surfaces::inferred::surfaces(&evidence, &elements, &polygons);
        (output.model.polygons, output.model.inferred) = (polygons, inferred);
        output.counts.recount(&output.model);
    }
    elements
}
