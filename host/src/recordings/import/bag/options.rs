//! What an import of bags may be told.

use std::fmt;
use std::str::FromStr;

use biplane_recording::WriterOptions;
use biplane_recording::rig::Mount;

/// A topic by name, none at all, or whichever makes sense.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum TopicChoice {
    /// The only one that makes sense.
    #[default]
    Any,
    /// None.
    Without,
    /// This one; of several frames on one topic, `TOPIC@FRAME`.
    Named(String),
}

impl FromStr for TopicChoice {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(if text == "none" { Self::Without } else { Self::Named(text.to_owned()) })
    }
}

/// Which echo of a beam that came back several times.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Echo {
    /// The nearest: edges and dust too. What other programs take of such bags.
    #[default]
    First,
    /// The farthest: the wall behind dust and edges.
    Last,
    /// The brightest; the nearest where the bag tells no intensities.
    Strongest,
}

impl FromStr for Echo {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "first" => Ok(Self::First),
            "last" => Ok(Self::Last),
            "strongest" => Ok(Self::Strongest),
            other => Err(format!("expected `first`, `last` or `strongest`, found {other:?}")),
        }
    }
}

impl fmt::Display for Echo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::First => "first",
            Self::Last => "last",
            Self::Strongest => "strongest",
        })
    }
}

/// Which stamps.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Stamps {
    /// Those of the messages' headers.
    #[default]
    Header,
    /// When the recorder got a message; for a scan, less the time from its first beam to its last.
    Receipt,
}

impl FromStr for Stamps {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "header" => Ok(Self::Header),
            "receipt" => Ok(Self::Receipt),
            other => Err(format!("expected `header` or `receipt`, found {other:?}")),
        }
    }
}

/// What is said of one laser.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LaserOptions {
    /// Its topic.
    pub topic: TopicChoice,
    /// Where it sits; by the bag's frames when `None`.
    pub mount: Option<Mount>,
    /// Added to its stamps, in ms. Too large puts scans too late.
    pub delay_ms: f64,
    /// From a beam to the next, in s; the bag's own when `None`. Too large turns and shifts what is seen from
    /// a moving robot.
    pub time_increment_s: Option<f64>,
}

/// How bags are imported.
#[derive(Clone, Debug, Default)]
pub struct BagOptions {
    /// The laser that localizes.
    pub horizontal: LaserOptions,
    /// The laser that sees the building.
    pub vertical: LaserOptions,
    /// Where odometry comes from; `/tf` where the bag has no topic of it.
    pub odometry: TopicChoice,
    /// The inertial measurement unit.
    pub imu: TopicChoice,
    /// The frame that becomes `base_link`; found when `None`.
    pub base_frame: Option<String>,
    /// Which echo of several.
    pub echo: Echo,
    /// Which stamps.
    pub stamps: Stamps,
    /// How the recording is written.
    pub writer: WriterOptions,
}

/// A mount as `x,y,z,roll,pitch,yaw`, in m and degrees.
///
/// # Errors
/// With what was expected and found.
pub fn parse_mount(text: &str) -> Result<Mount, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z, roll, pitch, yaw] if numbers.iter().all(|v| v.is_finite()) => {
            Ok(Mount { x, y, z, roll, pitch, yaw })
        }
        _ => Err(format!("expected six numbers x,y,z,roll,pitch,yaw (m and degrees), found {text:?}")),
    }
}
