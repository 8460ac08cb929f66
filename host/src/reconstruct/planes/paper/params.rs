//! The paper's fixed limits. Meters. Source: the paper, section 3.1 and table 1.

use serde::Serialize;

/// The paper's limits.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ReferenceParams {
    /// A point joins when it is nearer than this to a point of the set, meters. Larger: gaps are bridged.
    pub delta_m: f64,
    /// Largest mean squared distance of the set to its best plane, square meters. The paper says 2.8 without
    /// a unit; in square centimeters it is a deviation of 1.7 cm. Smaller than the sensor's noise: walls fall
    /// apart. Larger: steps disappear.
    pub epsilon_m2: f64,
    /// Farthest that a point which joins may be from the best plane, meters. Larger: more of what is near a
    /// wall joins it.
    pub gamma_m: f64,
    /// Fewest points of a plane. Smaller: noise is taken for planes.
    pub min_points: usize,
    /// Random starts of each round, of which the largest plane is kept. Larger: better planes, more time.
    pub starts: usize,
}

impl Default for ReferenceParams {
    fn default() -> Self {
        Self { delta_m: 0.3, epsilon_m2: 2.8e-4, gamma_m: 0.1, min_points: 50, starts: 8 }
    }
}
