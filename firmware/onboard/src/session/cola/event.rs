//! What a session with a laser on a network has to say, beside what all sessions say.

use std::fmt;

use biplane_wire::cola::Dialect;

use crate::session::cola::settings::{ColaChange, NotOffered};

/// Something worth saying.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum ColaEvent {
    /// The device answers, in this dialect.
    Answers(Dialect),
    /// No answer in either dialect; the session goes on asking.
    NoAnswer,
    /// What the rig asks for cannot be had; the device stays as it is set.
    NotOffered(NotOffered),
    /// The device is set otherwise than the rig asks, and the rig does not allow to log in.
    Kept(ColaChange),
    /// Its scans come otherwise than the rig asks, whatever it says of its settings.
    Streams {
        /// Scans a second, 1/100 Hz.
        rate_chz: u32,
        /// From beam to beam, 1/10000 degree.
        step_e4deg: u32,
    },
    /// This was written, because it differed from what the rig asks.
    Written(ColaChange),
    /// What was written is kept without power.
    Saved,
    /// The device refused the login: it stays as it is set.
    LoginRefused,
    /// The device refused to be set, or set itself otherwise.
    SettingRefused {
        /// The code of its refusal or result.
        code: u16,
    },
    /// The device's clock began anew: it was switched on or reset.
    Restarted,
    /// Intact scans come without ranges, or with more beams than are kept.
    NoRanges,
}

impl ColaEvent {
    /// Whether something is not as it should be.
    #[must_use]
    pub fn is_warning(&self) -> bool {
        !matches!(self, Self::Answers(_) | Self::Written(_) | Self::Saved)
    }

    /// In two or three words what keeps the line from bringing anything.
    #[must_use]
    pub fn fault(&self) -> Option<&'static str> {
        match self {
            Self::NoAnswer => Some("no answer"),
            _ => None,
        }
    }
}

impl fmt::Display for ColaEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Answers(Dialect::A) => write!(f, "answers in CoLa A"),
            Self::Answers(Dialect::B) => write!(f, "answers in CoLa B"),
            Self::NoAnswer => write!(f, "no answer yet; retrying (is it a SICK LMS1xx, LMS5xx or TiM?)"),
            Self::NotOffered(offered) => {
                write!(f, "does not offer what the rig asks and stays as it is set: {offered}")
            }
            Self::Kept(change) => {
                write!(
                    f,
                    "is set otherwise than the rig asks ({change}); the rig needs `login = true` to change it"
                )
            }
            Self::Streams { rate_chz, step_e4deg } => {
                let (rate_hz, step_deg) = (f64::from(*rate_chz) / 100.0, f64::from(*step_e4deg) / 1e4);
                write!(
                    f,
                    "sends scans otherwise than the rig asks: {rate_hz} Hz in steps of {step_deg} degrees"
                )
            }
            Self::Written(change) => write!(f, "configuration written: {change}"),
            Self::Saved => write!(f, "configuration saved in the device"),
            Self::LoginRefused => write!(f, "refuses the login: it stays as it is set"),
            Self::SettingRefused { code } => write!(f, "refuses to be set (code {code:X}h)"),
            Self::Restarted => write!(f, "was switched on or reset"),
            Self::NoRanges => {
                write!(f, "sends scans without ranges or with too many beams; they are counted only")
            }
        }
    }
}
