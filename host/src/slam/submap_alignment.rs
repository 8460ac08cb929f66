//! How scans and submaps of a drive are laid on each other: with the matcher's own alignment and its
//! parameters, but for those named here, which were measured to serve the two differently.
//!
//! Measured on Intel, ACES, MIT CSAIL, the Freiburg building 079, three thin drives, and four copies of each
//! with one per cent of the scans left out. Units: meters, radians.

use biplane_matcher::{AlignParams, EndPoint, PointAlignment, PointMap, Pose2};
use nalgebra::Matrix3;

/// Cauchy scale of the last iterations, meters: smaller than the tracker's, whose map does not show a wall
/// twice where a submap has drifted. With the tracker's 6 cm the map of ACES has 1.6 % more bits, and those
/// of its four copies 0.7 to 2.3 %; the others have 0.2 % less error on average.
const OUTLIER_M: f64 = 0.05;
/// End points this close to a surface are explained, meters: submaps drift by centimeters within themselves.
/// With the tracker's 6 cm the thin Edmonton drive has 1.6 % more error.
pub(crate) const EXPLAINED_M: f64 = 0.1;

/// How an alignment begins and ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Approach {
    /// Off by up to this much the end points are drawn in from the first iteration on (Cauchy scale), meters.
    pub capture_m: f64,
    /// Iterations at most.
    pub max_iterations: u32,
}

impl Approach {
    fn params(self) -> AlignParams {
        AlignParams {
            max_iterations: self.max_iterations,
            capture_m: self.capture_m,
            outlier_m: OUTLIER_M,
            explained_m: EXPLAINED_M,
            ..AlignParams::default()
        }
    }
}

/// Lays end points on a map, beginning where they are expected, which these standard deviations of x, y and
/// heading hold.
pub(crate) fn align(
    map: &PointMap,
    points: &[EndPoint],
    expected: &Pose2,
    sigma: &[f64; 3],
    approach: Approach,
) -> PointAlignment {
    let mut information = [[0.0; 3]; 3];
    for (axis, sigma) in sigma.iter().enumerate() {
        information[axis][axis] = 1.0 / (sigma * sigma);
    }
    map.align(points, expected, information, &approach.params())
}

/// What an alignment knows, as the graph takes it.
pub(crate) fn information(found: &PointAlignment) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| found.information[row][column])
}
