//! A laser of a bag with the place where it sits, and how its fan lies by that.

use biplane_recording::rig::Mount;

use crate::recordings::import::bag::frames::{bare, tilt_deg};
use crate::recordings::import::bag::survey::LaserSeen;
use crate::recordings::mounts::base_from_mount;

/// A fan that is tilted by less lies flat, in degrees.
const FLAT_DEG: f64 = 15.0;
/// A fan that is tilted by more stands, in degrees.
const STANDING_DEG: f64 = 60.0;

/// How a laser's fan lies.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Fan {
    Flat,
    Standing,
    Inclined,
    Unknown,
}

impl Fan {
    pub(crate) fn of(mount: Option<&Mount>) -> Self {
        match mount.map(|mount| tilt_deg(&base_from_mount(mount))) {
            None => Self::Unknown,
            Some(tilt) if tilt < FLAT_DEG => Self::Flat,
            Some(tilt) if tilt > STANDING_DEG => Self::Standing,
            Some(_) => Self::Inclined,
        }
    }

    /// In a word.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Flat => "horizontal",
            Self::Standing => "vertical",
            Self::Inclined => "inclined",
            Self::Unknown => "not known",
        }
    }
}

/// A laser, and where it sits if that is known.
#[derive(Clone, Debug)]
pub(crate) struct Placed<'a> {
    pub seen: &'a LaserSeen,
    pub mount: Option<Mount>,
    pub fan: Fan,
}

impl Placed<'_> {
    /// Topic without a leading slash, and frame.
    pub(crate) fn key(&self) -> (&str, &str) {
        (bare(&self.seen.topic), &self.seen.frame)
    }

    /// Whether `TOPIC` or `TOPIC@FRAME` means it.
    pub(crate) fn is_named(&self, name: &str) -> bool {
        let (topic, frame) = name.split_once('@').map_or((name, None), |(topic, frame)| (topic, Some(frame)));
        let key = self.key();
        key.0 == bare(topic) && frame.is_none_or(|frame| bare(frame) == key.1)
    }
}
