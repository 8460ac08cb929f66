//! What a plane is: the parameters of the search.

use serde::{Deserialize, Serialize};

/// What a plane is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneParams {
    /// Range noise of the sensor, meters, one standard deviation; `None` = estimate it from the cloud.
    /// Larger: steps between parallel surfaces disappear. Smaller: one noisy wall becomes several planes.
    pub sigma_m: Option<f64>,
    /// Longest distance from a point to the rest of its plane, meters (the paper's delta).
    pub delta_m: f64,
    /// Fewest points of a plane. Larger: small surfaces stay triangles. Smaller: noise is taken for planes.
    pub min_points: usize,
    /// Edge of a cell of the search, meters; `None` = as the cloud's density asks. Larger: coarser borders.
    /// Smaller: too few points a cell to tell steps from noise.
    pub cell_m: Option<f64>,
    /// Large clouds are searched in squares of the floor of this side, meters. Larger: more memory at a time,
    /// fewer to share out. Smaller: planes in more parts, which have to be united.
    pub block_m: f64,
    /// Margin round a square that is searched with it, meters. Larger: what is searched twice costs more.
    /// Smaller: less is known of what lies at a border.
    pub halo_m: f64,
    /// Clouds of fewer points are searched as a whole.
    pub min_points_to_divide: usize,
}

impl Default for PlaneParams {
    fn default() -> Self {
        Self {
            sigma_m: None,
            delta_m: 0.3,
            min_points: 50,
            cell_m: None,
            block_m: 20.0,
            halo_m: 1.0,
            min_points_to_divide: 10_000_000,
        }
    }
}
