//! `planes.json`: the planes of a cloud, how they were found and how long that took.
//!
//! Equations hold in the coordinates of the input: `normal . p = offset_m`. Meters.

use biplane_geometry::vec3::dot;
use serde::Serialize;
use serde_json::Value;

use crate::formats::input::cloud_file::CloudFile;
use crate::model::Plane;
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::planes::labeled::SigmaSource;
use crate::reconstruct::planes::labels::explain::Explanation;
use crate::reconstruct::planes::paper::agreement::Agreement;
use crate::reconstruct::planes::paper::params::ReferenceParams;
use crate::reconstruct::planes::params::PlaneParams;

/// A plane as it is written.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct PlaneFigures {
    /// Its number, as at the points.
    pub plane: usize,
    /// Unit normal; towards the sensors where the input says where they were.
    pub normal: [f64; 3],
    /// Distance from the origin of the input's coordinates along the normal, meters.
    pub offset_m: f64,
    /// How many points are on it.
    pub points: usize,
    /// Root mean square distance of those to it, meters.
    pub rms_m: f64,
}

/// Time of the extraction alone: no reading, no writing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Cost {
    /// Seconds of processor time, over all threads.
    pub cpu_s: f64,
    /// Seconds on the clock.
    pub wall_s: f64,
    /// Threads that there were.
    pub threads: usize,
}

/// What was known of the input's scans.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct ScanFigures {
    /// Whether scans and beams were known.
    #[serde(rename = "organised")]
    pub organized: bool,
    /// Whether it was known where scans were taken from.
    pub origins: bool,
    /// Which points were left out because of their range; when asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_limit: Option<RangeLimit>,
}

/// Points farther from their scan's position than this are nowhere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct RangeLimit {
    /// The longest range, meters.
    pub max_range_m: f64,
    /// Points beyond.
    pub points_left_out: usize,
}

/// The paper's search: its limits, and the seed of its random starts.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct PaperSearch {
    /// Its limits.
    #[serde(flatten)]
    pub limits: ReferenceParams,
    /// Seed of its random starts.
    pub seed: u64,
}

/// Which search found the planes, with its parameters.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "name", rename_all = "lowercase")]
pub(crate) enum Method {
    /// Ours.
    Fast(PlaneParams),
    /// The paper's, with its fixed lengths.
    Paper(PaperSearch),
}

/// Everything in `planes.json`.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PlaneReport {
    /// Points of the input.
    pub points: usize,
    /// Of these, on a plane.
    pub points_on_planes: usize,
    /// The range noise that decided, meters; the paper's method knows none.
    pub sigma_m: Option<f64>,
    /// Where it comes from.
    pub sigma_source: Option<SigmaSource>,
    /// Time of the extraction alone.
    #[serde(flatten)]
    pub cost: Cost,
    /// What was known of scans.
    #[serde(flatten)]
    pub scans: ScanFigures,
    /// What was taken off the coordinates while working, meters. Equations and points are in the input's
    /// coordinates again.
    pub shift_m: [f64; 3],
    /// The search.
    pub method: Method,
    /// The planes, largest first.
    pub planes: Vec<PlaneFigures>,
    /// The round things, whose points are on no plane.
    pub cylinders: Vec<Value>,
    /// Seconds of processor time that these took, on top of the planes.
    pub shapes_cpu_s: f64,
    /// Why each plane ended, in the order of the planes; when asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explanation: Option<Explanation>,
    /// How far the labels agree with others; when asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub agreement: Option<Agreement>,
    /// The program's version.
    pub version: &'static str,
}

impl PlaneReport {
    /// The figures of planes found in a file's cloud.
    pub(crate) fn new(file: &CloudFile, found: &Planes, method: Method, cost: Cost) -> Self {
        let knows_noise = matches!(method, Method::Fast(_));
        Self {
            points: file.cloud.len(),
            points_on_planes: found.labels.iter().filter(|label| **label >= 0).count(),
            sigma_m: knows_noise.then_some(found.sigma_m),
            sigma_source: knows_noise.then_some(found.sigma_source),
            cost,
            scans: ScanFigures {
                organized: file.is_organized(),
                origins: file.has_positions(),
                range_limit: None,
            },
            shift_m: file.shift_m,
            method,
            planes: found
                .planes
                .iter()
                .enumerate()
                .map(|(index, plane)| figures(index, plane, file.shift_m))
                .collect(),
            cylinders: Vec::new(),
            shapes_cpu_s: 0.0,
            explanation: None,
            agreement: None,
            version: env!("CARGO_PKG_VERSION"),
        }
    }
}

/// A plane in the coordinates of the input.
fn figures(index: usize, plane: &Plane, shift_m: [f64; 3]) -> PlaneFigures {
    let moved_m = dot(plane.normal, shift_m);
    PlaneFigures {
        plane: index,
        normal: plane.normal,
        offset_m: plane.offset_m + moved_m,
        points: plane.points,
        rms_m: plane.rms_m,
    }
}

#[cfg(test)]
mod tests {
    use super::{Cost, Method, PlaneReport};
    use crate::formats::input::cloud_file::CloudFile;
    use crate::model::{Cloud, Plane};
    use crate::reconstruct::planes::labeled::Planes;
    use crate::reconstruct::planes::params::PlaneParams;

    #[test]
    fn equations_are_those_of_the_input_and_the_contract_s_names_stand_at_the_top() {
        let file = CloudFile {
            cloud: Cloud { points_m: vec![[0.0; 3]; 2], ..Cloud::default() },
            shift_m: [400_000.0, 0.0, 100.0],
            ..CloudFile::default()
        };
        let plane = Plane { normal: [0.6, 0.0, 0.8], offset_m: 2.5, points: 1, rms_m: 0.01 };
        let found = Planes { planes: vec![plane], labels: vec![-1, 0], sigma_m: 0.02, ..Planes::default() };
        let cost = Cost { cpu_s: 0.5, wall_s: 0.25, threads: 2 };
        let report = PlaneReport::new(&file, &found, Method::Fast(PlaneParams::default()), cost);
        // 0.6 * 400000 + 0.8 * 100 + 2.5
        assert!((report.planes[0].offset_m - 240_082.5).abs() < 1e-9);
        let value = serde_json::to_value(&report).unwrap();
        for (name, expected) in [("cpu_s", 0.5), ("wall_s", 0.25), ("sigma_m", 0.02)] {
            assert_eq!(value[name], expected, "{name}");
        }
        assert_eq!((&value["threads"], &value["points_on_planes"]), (&2.into(), &1.into()));
        assert_eq!((&value["sigma_source"], &value["method"]["name"]), (&"assumed".into(), &"fast".into()));
    }
}
