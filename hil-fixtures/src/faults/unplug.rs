//! One device whose plug is pulled, and put back after a while. Meanwhile it keeps its power and goes on.

use super::episodes::Episode;
use std::str::FromStr;

/// Names of devices, and those of their links.
const DEVICES: [(&str, &str); 4] =
    [("horizontal", "lms-horizontal"), ("vertical", "lms-vertical"), ("base", "base"), ("imu", "imu")];
/// No plug is pulled later than this, and none is out for longer, seconds.
const LONGEST_S: f64 = 1e6;

/// A plug that is pulled once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unplug {
    /// The name of the device's link.
    pub link: &'static str,
    /// While it is out, in the time of the run.
    pub out: Episode,
}

/// A text that says of no device when its plug is pulled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected DEVICE:AT:FOR with the device horizontal, vertical, base or imu, and seconds: vertical:20:5 pulls its \
     plug 20 s after the start for 5 s"
)]
pub struct NotUnplug;

impl FromStr for Unplug {
    type Err = NotUnplug;

    fn from_str(text: &str) -> Result<Self, NotUnplug> {
        let parts: Vec<&str> = text.split(':').collect();
        let &[device, at, length] = &parts[..] else { return Err(NotUnplug) };
        let found = DEVICES.iter().find(|(name, link)| [*name, *link].contains(&device));
        let (_, link) = found.ok_or(NotUnplug)?;
        let ns = |text: &str| {
            let seconds = text.parse::<f64>().ok().filter(|seconds| (0.0..=LONGEST_S).contains(seconds));
            seconds.map(|seconds| (seconds * 1e9) as i64).ok_or(NotUnplug)
        };
        let (from_ns, length_ns) = (ns(at)?, ns(length)?);
        Ok(Self { link, out: Episode { from_ns, to_ns: from_ns + length_ns } })
    }
}

#[cfg(test)]
mod tests {
    use super::{Episode, Unplug};

    #[test]
    fn a_plug_is_pulled_by_name_at_a_time_and_for_a_while() {
        let out = Episode { from_ns: 20_000_000_000, to_ns: 22_500_000_000 };
        for text in ["vertical:20:2.5", "lms-vertical:20:2.5"] {
            assert_eq!(text.parse(), Ok(Unplug { link: "lms-vertical", out }));
        }
        for wrong in ["vertical", "vertical:20", "roof:1:1", "base:-1:1", "base:1:nan", "base:1:1:1", ""] {
            assert!(wrong.parse::<Unplug>().unwrap_err().to_string().contains("vertical:20:5"), "{wrong}");
        }
    }
}
