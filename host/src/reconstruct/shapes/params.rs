//! What a round thing is: the parameters of the search for cylinders.

use serde::Serialize;

/// What a round thing is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShapeParams {
    /// Whether round things are looked for at all.
    pub enabled: bool,
    /// Smallest radius, meters. Smaller: noise is taken for wires.
    pub min_radius_m: f64,
    /// Largest radius, meters. Larger: flat walls with bent poses become curved.
    pub max_radius_m: f64,
    /// Smallest part of the way round that was seen, degrees. Smaller: bays and bent walls become round.
    pub min_arc_deg: f64,
    /// Fewest points. Smaller: table legs are found, and some that are none.
    pub min_points: usize,
    /// Height of a floor that is known to be there, seen or not, meters: what stands reaches down to it.
    pub floor_m: Option<f64>,
}

impl Default for ShapeParams {
    fn default() -> Self {
        Self {
            enabled: true,
            min_radius_m: 0.03,
            max_radius_m: 10.0,
            min_arc_deg: 60.0,
            min_points: 50,
            floor_m: None,
        }
    }
}
