//! What an alignment takes for granted: noise, scales, and when it ends.
//!
//! Units: meters, radians.

use crate::parameter_group::parameter_group;

parameter_group! { "align";
/// The alignment of end points with a map.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct AlignParams {
    /// Cauchy scale of the last iterations, meters: residuals beyond it are mostly people and changes.
    /// Smaller: less harm from these; larger: less harm from a map that is off itself.
    pub outlier_m: f64 [0.0001, 100.0],
    /// Standard deviation of an end point across its wall, meters. Smaller: the scan counts more against the
    /// odometry. What the residuals of the last scans show bounds it.
    pub range_noise_m: f64 [0.0001, 10.0],
    not by name:
    /// Iterations at most; at the cap the last pose counts. Fewer: cheaper; poses from far away are not
    /// reached.
    pub max_iterations: u32,
    /// Cauchy scale of the first iteration, meters. Larger: wider basin; smaller: fewer iterations.
    pub capture_m: f64,
    /// Standard deviation of an end point about a surface that is no line, meters. Smaller: clutter counts
    /// more against walls.
    pub point_noise_m: f64,
    /// How far the directions of mapped walls are off, radians. Larger: a corridor needs more structure
    /// before the scan is believed along its axis; smaller: noise is taken for structure and the pose wanders
    /// along bare corridors.
    pub direction_noise_rad: f64,
    /// A step shorter than this ends the iterations, meters. Larger: fewer iterations, a rougher pose.
    pub rest_m: f64,
    /// A turn smaller than this ends the iterations, radians. Larger: fewer iterations, a rougher heading.
    pub rest_rad: f64,
    /// End points this close to a surface are explained, meters. Larger: poor matches pass for good ones;
    /// smaller: good ones call for a search.
    pub explained_m: f64,
}
}

/// The tracker's iterations at most, which bounds the time: from odometry's pose a scan of Intel takes four.
/// Error 0.0248 m also when halved or doubled.
const MAX_ITERATIONS: u32 = 20;
/// The tracker's first Cauchy scale, meters: three cells of the map. Error 0.0250 m halved, 0.0296 m doubled.
const CAPTURE_M: f64 = 0.15;
/// Standard deviation about a mapped point, meters: about a cell of the map. Error 0.0471 m halved, 0.0344 m
/// doubled.
const POINT_NOISE_M: f64 = 0.04;
/// How far mapped normals are off, radians: three degrees. Error 0.0287 m halved, 0.0263 m doubled.
const DIRECTION_NOISE_RAD: f64 = 0.05;
/// The tracker's shortest step, meters: a fifteenth of the range noise. Error 0.0249 m halved, 0.0251 m
/// doubled.
const REST_M: f64 = 0.001;
/// The tracker's smallest turn, radians: 2 mm at 4 m. Error 0.0245 m halved, 0.0250 m doubled.
const REST_RAD: f64 = 0.0005;
/// Explained end points lie this close to a surface, meters: four times the range noise. Error 0.0248 m also
/// when halved or doubled.
const EXPLAINED_M: f64 = 0.06;
/// So many beams together know what one would know if their errors were independent: neighbors share the
/// errors of their wall. Larger: larger covariances. Error 0.0248 m halved, 0.0265 m doubled.
pub(crate) const BEAMS_PER_INDEPENDENT_ONE: f64 = 5.0;
/// When the scan alone leaves more than this in some direction the match is weak, meters (standard
/// deviation): as much as odometry loses in half a meter. Error 0.0249 m halved, 0.0287 m doubled.
pub(crate) const WEAK_M: f64 = 0.05;

impl Default for AlignParams {
    fn default() -> Self {
        Self {
            outlier_m: 0.06,
            range_noise_m: 0.015,
            max_iterations: MAX_ITERATIONS,
            capture_m: CAPTURE_M,
            point_noise_m: POINT_NOISE_M,
            direction_noise_rad: DIRECTION_NOISE_RAD,
            rest_m: REST_M,
            rest_rad: REST_RAD,
            explained_m: EXPLAINED_M,
        }
    }
}
/// A residual of so many Cauchy scales has a tenth of its weight: a map need not look farther for a surface.
pub(crate) const REACH_SCALES: f32 = 3.0;
