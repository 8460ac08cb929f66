//! Whether a found pose is to be believed.

use crate::registration::gauss_newton::fit::Fit;

/// Below this share of explained end points, of those that say anything, the scan is lost. Larger: a changed
/// place counts as lost; smaller: a wrong match counts as found. Error 0.0248 m also when halved or doubled.
pub(crate) const LOST_BELOW_SCORE: f64 = 0.4;
/// A scan that has less than this share of its end points where the map knows anything is on its own. Larger:
/// more scans go on from the odometry; smaller: matches that rest on a few beams. Error 0.0248 m also when
/// halved or doubled.
const MIN_INFORMATIVE_SHARE: f64 = 0.1;

/// Whether an alignment is to be believed.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Verdict {
    /// It explains the scan.
    Found,
    /// It explains the scan, but nothing else expects it: not to be believed yet, nor to be learned from.
    Unconfirmed,
    /// The map knows too little of what the scan sees: go on from the odometry, and learn.
    NewGround,
    /// The scan contradicts the map everywhere around.
    Lost,
}

impl Verdict {
    /// What a fit by itself says.
    pub(crate) fn of(fit: &Fit) -> Self {
        if !is_informative(fit) {
            Self::NewGround
        } else if fit.score() < LOST_BELOW_SCORE {
            Self::Lost
        } else {
            Self::Found
        }
    }
}

/// Whether enough of the end points say anything.
pub(crate) fn is_informative(fit: &Fit) -> bool {
    fit.informative >= MIN_INFORMATIVE_SHARE * fit.total
}
