//! Planes in a point cloud, after the paper's definition (section 3.1).
//!
//! A set of points is a plane when each lies close to another of the set, the mean squared distance to the best plane stays small
//! and no point is far from it. Frame `map`, metres.

use crate::model::{Cloud, Plane};
use serde::Serialize;

/// What a plane is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlaneParams {
    /// Range noise of the sensor, metres, one standard deviation; `None` = estimate it from the cloud.
    /// Larger: steps between parallel surfaces disappear. Smaller: one noisy wall becomes several planes.
    pub sigma_m: Option<f64>,
    /// Longest distance from a point to the rest of its plane, metres (the paper's delta).
    pub delta_m: f64,
    /// Fewest points of a plane. Larger: small surfaces stay triangles. Smaller: noise is taken for planes.
    pub min_points: usize,
}

impl Default for PlaneParams {
    fn default() -> Self {
        Self { sigma_m: None, delta_m: 0.3, min_points: 50 }
    }
}

/// The planes of a cloud and which point is on which.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planes {
    /// The planes, largest first.
    pub planes: Vec<Plane>,
    /// For every point the index of its plane, or -1.
    pub labels: Vec<i32>,
    /// The range noise that was assumed or estimated, metres.
    pub sigma_m: f64,
}

/// Finds the planes of a cloud.
pub fn extract(_params: &PlaneParams, cloud: &Cloud) -> Planes {
    Planes { planes: Vec::new(), labels: vec![-1; cloud.len()], sigma_m: 0.0 }
}
