//! The tracker's parameters: one documented struct a stage, each with the defaults that the physics suggests.

use std::fmt;
use std::str::FromStr;

/// How scans are matched.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub enum Method {
    /// The paper's (section 2): gradient ascent on a likelihood field with occlusion, made from earlier scans.
    Gradient,
    /// Every scan against a map of everything seen so far.
    #[default]
    Map,
}

/// A matcher's name that is not known.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("expected a matcher (gradient or map), found \"{found}\"")]
pub struct UnknownMethod {
    /// What was given.
    pub found: String,
}

impl Method {
    /// All methods, the default first.
    pub const ALL: [Self; 2] = [Self::Map, Self::Gradient];

    /// The name by which command lines know the method.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Gradient => "gradient",
            Self::Map => "map",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(text: &str) -> Result<Self, UnknownMethod> {
        let found = Self::ALL.into_iter().find(|method| method.name() == text);
        found.ok_or_else(|| UnknownMethod { found: text.to_owned() })
    }
}

/// How much the odometry's own motion is worth. Smaller: the match follows the odometry more; larger: it follows the
/// scans more, also where they say little (along a bare corridor).
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct MotionParams {
    /// Standard deviation of position per metre driven, metres.
    pub position_m_per_m: f64,
    /// Standard deviation of position per radian turned, metres.
    pub position_m_per_rad: f64,
    /// Standard deviation of heading per radian turned, radians.
    pub heading_rad_per_rad: f64,
    /// Standard deviation of heading per metre driven, radians.
    pub heading_rad_per_m: f64,
    /// Standard deviation of position that every step has, metres.
    pub position_floor_m: f64,
    /// Standard deviation of heading that every step has, radians.
    pub heading_floor_rad: f64,
    /// A longer step of the odometry is a jump and not believed, metres. Smaller: dropped scans at speed look like
    /// jumps; larger: jumps cost a search.
    pub jump_m: f64,
    /// A larger turn of the odometry in one step is not believed, radians.
    pub jump_rad: f64,
    /// Standard deviation of position when a step is only guessed from the one before, metres.
    pub unmeasured_m: f64,
    /// Standard deviation of heading when a step is only guessed, radians.
    pub unmeasured_rad: f64,
}

impl Default for MotionParams {
    fn default() -> Self {
        Self {
            position_m_per_m: 0.1,
            position_m_per_rad: 0.05,
            heading_rad_per_rad: 0.1,
            heading_rad_per_m: 0.05,
            position_floor_m: 0.01,
            heading_floor_rad: 0.005,
            jump_m: 3.0,
            jump_rad: 2.0,
            unmeasured_m: 0.1,
            unmeasured_rad: 0.1,
        }
    }
}

/// Which beams become end points, and what the scan itself says about the surfaces they lie on.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct PointParams {
    /// Beams that the buffers hold; a scan with more is thinned evenly.
    pub max_beams: usize,
    /// A scan with fewer usable end points counts as empty.
    pub min_points: usize,
    /// Shorter ranges are left out (the robot itself, dirt on the window), metres.
    pub range_min_m: f64,
    /// Longer ranges are left out: sparse, and turned into large errors by small angles; metres.
    pub range_max_m: f64,
    /// Beams closer together than this share one beam's weight, metres. Larger: a near wall with many beams counts
    /// less against a far one with few; zero: every beam counts the same.
    pub spacing_m: f64,
    /// Neighbours up to this far (and 5 beams) on either side give a point its normal, metres. Smaller: noisier
    /// normals; larger: corners and short walls have none.
    pub normal_reach_m: f64,
    /// Neighbours must span this much for a line, metres. Smaller: normals from range noise.
    pub line_length_m: f64,
    /// Neighbours farther from the common line than this: no normal, metres. A few times the range noise.
    pub line_tolerance_m: f64,
    /// A surface that a beam strikes flatter than this (sine of the angle) gives no normal: the beam may have jumped
    /// from an edge to the wall behind.
    pub grazing_sine: f64,
}

impl Default for PointParams {
    fn default() -> Self {
        Self {
            max_beams: 2048,
            min_points: 5,
            range_min_m: 0.1,
            range_max_m: 40.0,
            spacing_m: 0.02,
            normal_reach_m: 0.2,
            line_length_m: 0.06,
            line_tolerance_m: 0.02,
            grazing_sine: 0.1,
        }
    }
}

/// The map that the method `map` matches against.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct MapParams {
    /// Side of a cell, metres: at most one surface a cell. Smaller: finer, more memory, slower to fill; larger:
    /// the two faces of a thin wall run together.
    pub cell_m: f64,
    /// From how far an end point finds a surface, metres. Larger: a wider basin of convergence, slower to fill.
    pub reach_m: f64,
    /// Tiles of 32 x 32 cells in the pool (4 KB each). When all are used, the place not needed for the longest time
    /// is forgotten.
    pub tiles: usize,
    /// Surfaces in the pool (32 bytes each). When all are used, new ones wait until others go.
    pub surfaces: usize,
    /// A surface's mean moves by at least 1 / this many hits. Larger: steadier; smaller: it follows later scans.
    pub memory_hits: f64,
    /// An end point this close to the line of a neighbouring surface joins it, metres. A few times the range noise.
    pub merge_across_m: f64,
    /// What a hit counts for a surface, in beams that pass through it.
    pub evidence_per_hit: i16,
    /// The most evidence a surface has: so many beams must pass through before it goes.
    pub evidence_max: i16,
    /// Only every so-many-th beam is followed through the map. Larger: cheaper, moved things stay longer.
    pub carve_every_beams: usize,
    /// So far before its end point a beam is not sure to be clear, metres.
    pub carve_margin_m: f64,
    /// The map learns from a scan when the base has moved this far since the last one it learnt from, metres.
    pub learn_every_m: f64,
    /// The same for turning, radians.
    pub learn_every_rad: f64,
}

impl Default for MapParams {
    fn default() -> Self {
        Self {
            cell_m: 0.05,
            reach_m: 0.25,
            tiles: 4096,
            surfaces: 200_000,
            memory_hits: 50.0,
            merge_across_m: 0.04,
            evidence_per_hit: 3,
            evidence_max: 60,
            carve_every_beams: 3,
            carve_margin_m: 0.2,
            learn_every_m: 0.05,
            learn_every_rad: 0.05,
        }
    }
}

/// The alignment of the method `map`.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct AlignParams {
    /// Iterations at most; at the cap the last pose counts.
    pub max_iterations: u32,
    /// Cauchy scale of the first iteration, metres. Larger: wider basin; smaller: fewer iterations.
    pub capture_m: f64,
    /// Cauchy scale of the last iterations, metres: residuals beyond it are mostly people and changes.
    pub outlier_m: f64,
    /// Standard deviation of an end point across its wall, metres.
    pub range_noise_m: f64,
    /// Standard deviation of an end point about a surface that is no line, metres.
    pub point_noise_m: f64,
    /// Squared length of the mean normal from which on a surface is a line.
    pub line_strength: f64,
    /// How far the directions of mapped walls are off, radians. Larger: a corridor needs more structure before the scan
    /// is believed along its axis; smaller: noise is taken for structure and the pose wanders along bare corridors.
    pub direction_noise_rad: f64,
    /// So many beams together know what one would know if their errors were independent. Larger: larger
    /// covariances.
    pub beams_per_independent_one: f64,
    /// A step shorter than this ends the iterations, metres.
    pub rest_m: f64,
    /// A turn smaller than this ends the iterations, radians.
    pub rest_rad: f64,
    /// End points this close to a surface are explained, metres.
    pub explained_m: f64,
    /// When the scan alone leaves more than this in some direction the match is weak, metres (standard deviation).
    pub weak_m: f64,
}

impl Default for AlignParams {
    fn default() -> Self {
        Self {
            max_iterations: 20,
            capture_m: 0.15,
            outlier_m: 0.06,
            range_noise_m: 0.015,
            point_noise_m: 0.04,
            line_strength: 0.7,
            direction_noise_rad: 0.05,
            beams_per_independent_one: 5.0,
            rest_m: 0.0005,
            rest_rad: 0.0001,
            explained_m: 0.06,
            weak_m: 0.05,
        }
    }
}

/// The search when the alignment from the prior is poor.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct SearchParams {
    /// Headings this far on either side of the prior are looked at for every scan, radians: odometry read a moment
    /// before or after the scan is off by degrees in a turn.
    pub glance_rad: f64,
    /// Below this share of explained end points the surroundings are searched.
    pub below_score: f64,
    /// Below this share of explained end points the scan is lost.
    pub lost_below_score: f64,
    /// A scan that has less than this share of its end points where the map knows anything is on its own.
    pub min_informative: f64,
    /// The search looks at least this far each way, metres, and as far as three standard deviations of the prior.
    pub least_half_m: f64,
    /// The same for heading, radians.
    pub least_half_rad: f64,
    /// Lattice step, metres.
    pub step_m: f64,
    /// Lattice step, radians.
    pub step_rad: f64,
    /// Lattice steps each way at most, x and y.
    pub max_shifts: f64,
    /// Lattice steps each way at most, heading.
    pub max_turns: f64,
    /// End points used at most.
    pub beams: usize,
    /// Width of the likelihood about a surface, metres.
    pub blur_m: f64,
    /// What an end point in free space costs, in end points on a surface.
    pub free_space_cost: f64,
    /// Lost scans in a row after which the map goes on from the odometry.
    pub patience_scans: u32,
}

impl Default for SearchParams {
    fn default() -> Self {
        Self {
            glance_rad: 0.3,
            below_score: 0.6,
            lost_below_score: 0.4,
            min_informative: 0.1,
            least_half_m: 0.3,
            least_half_rad: 0.3,
            step_m: 0.1,
            step_rad: 0.035,
            max_shifts: 10.0,
            max_turns: 15.0,
            beams: 60,
            blur_m: 0.1,
            free_space_cost: 0.3,
            patience_scans: 20,
        }
    }
}

/// All parameters of a [`Tracker`](crate::Tracker).
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct TrackerParams {
    /// How scans are matched.
    pub method: Method,
    /// What the odometry is worth.
    pub motion: MotionParams,
    /// Which beams are used.
    pub points: PointParams,
    /// The map.
    pub map: MapParams,
    /// The alignment with the map.
    pub align: AlignParams,
    /// The search when that fails.
    pub search: SearchParams,
}

impl TrackerParams {
    /// The defaults of a method.
    #[must_use]
    pub fn for_method(method: Method) -> Self {
        Self { method, ..Self::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_is_found_by_its_name_and_others_are_refused_with_what_was_given() {
        for method in Method::ALL {
            assert_eq!(method.name().parse(), Ok(method));
        }
        let error = "csm".parse::<Method>().unwrap_err();
        assert_eq!(error.to_string(), "expected a matcher (gradient or map), found \"csm\"");
        assert_eq!(Method::default(), Method::ALL[0]);
    }
}
