//! Rooms, walls, doors and windows of a build, from its points, its floor maps and its path.

use crate::building;
use crate::building::elements::Elements;
use crate::building::spaces::evidence::{Area, Evidence, seen_in};
use crate::pipeline::BuildOutput;
use crate::pipeline::storey_part::StoreyPart;
use crate::recordings::deskew::StampedPose;
use crate::slam::occupancy::OccupancyGrid;

/// What was driven on one floor.
#[derive(Clone, Copy)]
pub(crate) struct StoreyDrive<'a> {
    /// Height of the floor, meters.
    pub floor_m: f64,
    /// What the lower laser saw from it.
    pub map: &'a OccupancyGrid,
    /// Where the robot was.
    pub poses: &'a [StampedPose],
}

/// The elements of the building that was driven through, storey by storey from below. Unless all is wanted
/// as it was seen, the model's surfaces follow them, and what no laser saw of walls and floors is added
/// beside them, marked.
pub(crate) fn elements(output: &mut BuildOutput, storeys: &[StoreyDrive<'_>], as_seen: bool) -> Elements {
    let floors_m: Vec<f64> = storeys.iter().map(|storey| storey.floor_m).collect();
    let mut found = Elements::default();
    let (mut polygons, mut inferred) = (Vec::new(), Vec::new());
    for (place, storey) in storeys.iter().enumerate() {
        let part = (storeys.len() > 1).then(|| StoreyPart::of(output, &floors_m, place));
        let whole = (&output.model, &output.cloud, output.labels.as_slice());
        let (model, cloud, labels) =
            part.as_ref().map_or(whole, |part| (&part.model, &part.cloud, part.labels.as_slice()));
        let path_m: Vec<[f64; 2]> = storey.poses.iter().map(|pose| [pose.x_m, pose.y_m]).collect();
        let area = Area::around(model, &path_m);
        let evidence = Evidence {
            model,
            cloud,
            labels,
            area: &area,
            seen: &seen_in(&area, storey.map),
            path_m: &path_m,
            floor_m: storey.floor_m,
            sigma_m: output.counts.sigma_m,
            storey: place + 1,
        };
        let elements = building::rooms(&evidence);
        let own = if as_seen {
            model.polygons.clone()
        } else {
            let own = building::surfaces::with_rectangles(&evidence, &elements);
            inferred.extend(building::surfaces::inferred::surfaces(&evidence, &elements, &own));
            own
        };
        polygons.extend(own);
        found.take(elements);
    }
    if !as_seen {
        (output.model.polygons, output.model.inferred) = (polygons, inferred);
        output.counts.recount(&output.model);
    }
    found
}
