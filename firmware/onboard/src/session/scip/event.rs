//! What a session with a Hokuyo laser has to say, beside what all sessions say.

use std::fmt;

use crate::session::scip::settings::ScipOffer;

/// Something worth saying.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum ScipEvent {
    /// No answer on the network; the session goes on asking.
    NoAnswer,
    /// The device spoke SCIP 1.1 and was switched to 2.0.
    LeftScip1,
    /// The device knows SCIP 1.1 only.
    Scip1Only,
    /// The device was left in the mode in which its clock is read.
    LeftTimeMode,
    /// What the rig asks for cannot be had; all that the device measures is recorded.
    NotOffered(ScipOffer),
    /// The device refuses to measure.
    Refused {
        /// Its status.
        code: [u8; 2],
    },
    /// The device has stopped to verify an error.
    Verifying,
    /// The device says that it is defective.
    Defect {
        /// Its status.
        code: [u8; 2],
    },
    /// The device's clock began anew: it was switched on or reset.
    Restarted,
    /// Intact scans come with more beams than are kept.
    NoRanges,
    /// Geometry and reach are not known from this recording and follow from the steps of the scans.
    GeometryAssumed,
}

impl ScipEvent {
    /// Whether something is not as it should be.
    #[must_use]
    pub fn is_warning(&self) -> bool {
        !matches!(self, Self::LeftScip1 | Self::LeftTimeMode)
    }

    /// In two or three words what keeps the line from bringing anything.
    #[must_use]
    pub fn fault(&self) -> Option<&'static str> {
        match self {
            Self::NoAnswer => Some("no answer"),
            Self::Scip1Only => Some("knows SCIP 1.1 only"),
            Self::Refused { .. } => Some("refuses to measure"),
            Self::Defect { .. } => Some("is defective"),
            _ => None,
        }
    }
}

impl fmt::Display for ScipEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = |code: &[u8; 2]| code.map(|byte| char::from(byte & 0x7F));
        match self {
            Self::NoAnswer => write!(f, "no answer yet; retrying (is it a Hokuyo laser with Ethernet?)"),
            Self::LeftScip1 => write!(f, "spoke SCIP 1.1 and was switched to SCIP 2.0"),
            Self::Scip1Only => {
                write!(f, "knows SCIP 1.1 only, which Biplane does not speak: update its firmware")
            }
            Self::LeftTimeMode => write!(f, "was left in the mode in which its clock is read; ended it"),
            Self::NotOffered(offer) => {
                write!(f, "does not offer what the rig asks and sends all that it measures: {offer}")
            }
            Self::Refused { code } => {
                let [a, b] = text(code);
                write!(f, "refuses to measure (status {a}{b})")
            }
            Self::Verifying => write!(f, "has stopped to verify an error"),
            Self::Defect { code } => {
                let [a, b] = text(code);
                write!(f, "says that it is defective (status {a}{b})")
            }
            Self::Restarted => write!(f, "was switched on or reset"),
            Self::NoRanges => write!(f, "sends scans with too many beams; they are counted only"),
            Self::GeometryAssumed => {
                write!(
                    f,
                    "its reply to PP is not in this recording: geometry assumed by the steps of its scans"
                )
            }
        }
    }
}
