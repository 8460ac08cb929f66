//! How finely all scans and one map of them are brought together.

/// One resolution of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Side of a cell of the map, meters. Larger: poses farther off are brought together; smaller: walls
    /// close to each other stay apart.
    pub cell_m: f64,
    /// Points this close to a surface's line are the same surface, meters. The same.
    pub merge_m: f64,
    /// Points farther off their surface count less (Cauchy), meters. Larger: people and moved things do more
    /// harm; smaller: so do walls that are still off.
    pub scale_m: f64,
    /// Standard deviation of a point across its surface, meters: the laser's noise, and how far a surface of
    /// this size is from being a line. Larger: the steps between nodes hold the poses where they are.
    pub noise_m: f64,
    /// Maps of this resolution that are made. More: closer to the end, slower.
    pub rounds: usize,
}

/// See the module's text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointParams {
    /// From coarse to fine.
    pub levels: [Level; 2],
    /// Points about what is no line (legs, corners) are noisier by this factor. Larger: clutter counts less
    /// against walls.
    pub point_noise: f64,
    /// So many beams together know what one would if their errors were independent. Larger: steps count more
    /// against scans.
    pub beams_per_independent_one: f64,
    /// The direction of a surface is that of the line through those up to this far on either side, meters.
    /// Smaller: noise tilts it, and scans seem to know where along a wall they are; larger: bent walls become
    /// straight.
    pub straight_m: f64,
}

impl Default for JointParams {
    fn default() -> Self {
        let coarse = Level { cell_m: 0.1, merge_m: 0.08, scale_m: 0.08, noise_m: 0.06, rounds: 3 };
        let fine = Level { cell_m: 0.05, merge_m: 0.04, scale_m: 0.05, noise_m: 0.015, rounds: 4 };
        Self { levels: [coarse, fine], point_noise: 2.5, beams_per_independent_one: 5.0, straight_m: 0.25 }
    }
}

impl JointParams {
    /// Rounds of all levels.
    pub fn rounds(&self) -> usize {
        self.levels.iter().map(|level| level.rounds).sum()
    }
}
