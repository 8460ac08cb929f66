//! What became of the starts of all pairs.

use biplane_matcher::Pose2;

use crate::replay::basin::pairs::Pair;

/// What became of one start.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Trial {
    /// Index of its pair in the list.
    pub pair: usize,
    /// Index of its heading in [`HEADINGS_DEG`](crate::replay::basin::starts::HEADINGS_DEG).
    pub heading: usize,
    /// The start's error: true pose to start, in the reference's axes.
    pub start: Pose2,
    /// Distance between the pose found and the true one, meters.
    pub error_m: f64,
    /// The same in heading, radians.
    pub error_rad: f64,
    /// Distance to where the same method ends from the true pose, meters: its own optimum.
    pub own_error_m: f64,
    /// The same in heading, radians.
    pub own_error_rad: f64,
    /// Iterations.
    pub iterations: u32,
    /// Processor time without the preparation of the reference, nanoseconds.
    pub cpu_ns: i64,
}

/// All starts of all pairs.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Basin {
    /// The pairs.
    pub pairs: Vec<Pair>,
    /// Which pairs have a stamp that several scans of the recording bear.
    pub ambiguous: Vec<bool>,
    /// Processor time to prepare each pair's reference, nanoseconds.
    pub prepare_ns: Vec<i64>,
    /// The starts, pair after pair.
    pub trials: Vec<Trial>,
}
