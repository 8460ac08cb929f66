//! What an import of bags did.

use std::collections::BTreeMap;

use super::container::Losses;

/// What was made of bags, and what was not.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct BagReport {
    /// Scans written of the laser that localizes, and of the one that sees the building.
    pub scans: [usize; 2],
    /// Odometry messages written.
    pub odometry: usize,
    /// Messages of an inertial unit written.
    pub imu: usize,
    /// Messages that came twice, with the same stamp and the same content.
    pub duplicates: usize,
    /// Messages whose stamp lies before that of the one before, by more than what waits to be sorted.
    pub backward_stamps: usize,
    /// Scans without beams, or in directions that are no numbers.
    pub unusable_scans: usize,
    /// Poses and transforms that are no numbers.
    pub unusable_poses: usize,
    /// First and last scan's stamp, ns.
    pub stamps_ns: Option<[i64; 2]>,
    /// What of the files could not be read.
    pub losses: Losses,
    /// What somebody should know: a sentence each.
    pub notes: Vec<String>,
    /// Topics that are not taken: type, and number of messages.
    pub others: BTreeMap<String, (String, usize)>,
}
