//! What of a build belongs to one of several storeys.

use crate::model::{Cloud, Model, PlanarPolygon};
use crate::pipeline::BuildOutput;

/// Surfaces so far under a floor still belong to its storey, meters: thresholds, and what noise moves.
const UNDER_M: f64 = 0.3;

/// The surfaces of a storey, and the points that were seen from it.
pub(crate) struct StoreyPart {
    /// All planes, and the polygons of the storey.
    pub model: Model,
    /// The points seen from the storey; all scans.
    pub cloud: Cloud,
    /// The plane of each point.
    pub labels: Vec<i32>,
}

impl StoreyPart {
    /// Of the storey with this place among floors, which are heights from below, meters.
    pub(crate) fn of(output: &BuildOutput, floors_m: &[f64], storey: usize) -> Self {
        let is_own = |z_m: f64| storey_at(floors_m, z_m) == storey;
        let polygons = output.model.polygons.iter().filter(|polygon| is_own(middle_m(polygon)));
        let model = Model {
            planes: output.model.planes.clone(),
            polygons: polygons.cloned().collect(),
            ..Model::default()
        };
        let cloud = &output.cloud;
        let from_here: Vec<bool> =
            cloud.origins_m.iter().map(|origin| is_own(f64::from(origin[2]))).collect();
        let is_seen = |point: &usize| from_here.get(cloud.scan[*point] as usize).copied().unwrap_or(false);
        let kept: Vec<usize> = (0..cloud.scan.len()).filter(is_seen).collect();
        let labels = kept.iter().map(|point| output.labels.get(*point).copied().unwrap_or(-1)).collect();
        let cloud = Cloud {
            points_m: kept.iter().map(|point| cloud.points_m[*point]).collect(),
            scan: kept.iter().map(|point| cloud.scan[*point]).collect(),
            beam: kept.iter().filter_map(|point| cloud.beam.get(*point).copied()).collect(),
            origins_m: cloud.origins_m.clone(),
            beams_per_scan: cloud.beams_per_scan,
            stamps_ns: Vec::new(),
            delays_ns: Vec::new(),
        };
        Self { model, cloud, labels }
    }
}

/// The storey that a height belongs to.
fn storey_at(floors_m: &[f64], z_m: f64) -> usize {
    floors_m.iter().rposition(|floor_m| z_m >= floor_m - UNDER_M).unwrap_or(0)
}

/// Middle between the lowest and the highest corner.
fn middle_m(polygon: &PlanarPolygon) -> f64 {
    let heights = polygon.outer_m.iter().map(|p| p[2]);
    let [low, high] =
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)]);
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::StoreyPart;
    use crate::model::{Cloud, Model, PlanarPolygon};
    use crate::pipeline::BuildOutput;

    fn polygon(low_m: f64, high_m: f64) -> PlanarPolygon {
        let outer_m = vec![[0.0, 0.0, low_m], [1.0, 0.0, low_m], [1.0, 0.0, high_m]];
        PlanarPolygon { plane: 0, outer_m, holes_m: Vec::new() }
    }

    #[test]
    fn each_storey_has_its_surfaces_and_what_was_seen_from_it() {
        let floors_m = [0.0, 3.1];
        // A wall and a ceiling of each storey, the upper ceiling far up.
        let polygons = vec![polygon(0.5, 2.6), polygon(2.7, 2.7), polygon(3.6, 5.7), polygon(9.0, 9.0)];
        let model = Model { polygons, ..Model::default() };
        let cloud = Cloud {
            points_m: vec![[0.0; 3], [1.0; 3], [2.0; 3]],
            scan: vec![0, 1, 1],
            beam: vec![3, 4, 5],
            origins_m: vec![[0.0, 0.0, 0.45], [0.0, 0.0, 3.55]],
            beams_per_scan: 181,
            ..Cloud::default()
        };
        let output = BuildOutput { model, cloud, labels: vec![7, 8, 9], ..BuildOutput::default() };
        let [lower, upper] = [0, 1].map(|storey| StoreyPart::of(&output, &floors_m, storey));
        assert_eq!([&lower, &upper].map(|part| part.model.polygons.len()), [2, 2]);
        assert_eq!(lower.model.polygons[1], polygon(2.7, 2.7));
        assert_eq!((lower.labels, upper.labels), (vec![7], vec![8, 9]));
        assert_eq!((upper.cloud.beam, upper.cloud.points_m[0]), (vec![4, 5], [1.0; 3]));
    }
}
