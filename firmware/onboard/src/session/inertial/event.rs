//! What a session with an inertial unit has to say, beside what all sessions say.

use std::fmt;

use biplane_wire::xsens::ErrorCode;

/// Something worth saying.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum InertialEvent {
    /// The unit reports an error.
    Error(ErrorCode),
    /// The unit sends at another rate than the rig asks.
    RateKept {
        /// In force, samples a second.
        rate_hz: u16,
    },
    /// The unit does not send all of count, time, accelerations and turn rates.
    NotOffered,
    /// Measurements come that lack some of it.
    Incomplete,
    /// A sensor was out of its range.
    Clipped,
    /// The unit's clock began anew: it was switched on or reset.
    Restarted,
}

impl InertialEvent {
    /// In two or three words what keeps the line from bringing anything.
    #[must_use]
    pub fn fault(&self) -> Option<&'static str> {
        match self {
            Self::NotOffered => Some("does not send what is needed"),
            Self::Incomplete => Some("sends incomplete measurements"),
            _ => None,
        }
    }
}

impl fmt::Display for InertialEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Error(code) => match code.words() {
                Some(words) => write!(f, "reports an error: {words}"),
                None => write!(f, "reports error {:02X}h", code.0),
            },
            Self::RateKept { rate_hz } => {
                write!(f, "sends {rate_hz} samples a second, not as many as the rig asks")
            }
            Self::NotOffered => {
                write!(f, "does not send all of count, time, accelerations and turn rates: is it an MTi?")
            }
            Self::Incomplete => {
                write!(f, "sends measurements without count, time, accelerations or turn rates: not kept")
            }
            Self::Clipped => {
                write!(f, "a sensor was out of its range: it shakes or turns harder than it can measure")
            }
            Self::Restarted => write!(f, "was switched on or reset"),
        }
    }
}
