//! The status byte of scans: what is said when a trouble begins and when it is over.

use std::fmt;

use biplane_wire::lms::{Severity, Status};

/// A trouble that comes and goes in the status byte is over when it was not seen for so long, nanoseconds.
const OVER_NS: i64 = 2_000_000_000;

/// What a status byte can complain of.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Trouble {
    /// The front window is dirty.
    WindowPolluted,
    /// The device holds its own values for implausible.
    Implausible,
    /// A fault that still lets it measure.
    Warning,
    /// A fault that may not.
    Error,
}

impl Trouble {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::WindowPolluted, Self::Implausible, Self::Warning, Self::Error];

    fn is_in(self, status: Status) -> bool {
        match self {
            Self::WindowPolluted => status.polluted(),
            Self::Implausible => status.implausible(),
            Self::Warning => status.severity() == Severity::Warning,
            Self::Error => matches!(status.severity(), Severity::Error | Severity::Fatal),
        }
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::WindowPolluted => "front window polluted",
            Self::Implausible => "implausible measured values",
            Self::Warning => "a warning",
            Self::Error => "an error",
        })
    }
}

/// The troubles that are on, in the order of [`Trouble::ALL`].
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct Troubles([bool; 4]);

impl Troubles {
    /// Those that are on.
    pub fn iter(self) -> impl Iterator<Item = Trouble> {
        Trouble::ALL.into_iter().zip(self.0).filter_map(|(trouble, is_on)| is_on.then_some(trouble))
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self == Self::default()
    }
}

impl fmt::Display for Troubles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return f.write_str("none");
        }
        for (index, trouble) in self.iter().enumerate() {
            let gap = if index == 0 { "" } else { ", " };
            write!(f, "{gap}{trouble}")?;
        }
        Ok(())
    }
}

/// Follows the status bytes of a device.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Condition {
    /// When each trouble that is on was seen last.
    seen_ns: [Option<i64>; 4],
}

impl Condition {
    /// A scan has this status; `say` is told of each trouble that begins (`true`) or is over.
    pub(super) fn see(&mut self, now_ns: i64, status: Status, mut say: impl FnMut(Trouble, bool)) {
        for (trouble, seen_ns) in Trouble::ALL.into_iter().zip(&mut self.seen_ns) {
            if trouble.is_in(status) {
                if seen_ns.replace(now_ns).is_none() {
                    say(trouble, true);
                }
            } else if seen_ns.is_some_and(|last_ns| now_ns.saturating_sub(last_ns) >= OVER_NS) {
                *seen_ns = None;
                say(trouble, false);
            }
        }
    }

    /// The troubles that are on.
    pub(super) fn troubles(&self) -> Troubles {
        Troubles(self.seen_ns.map(|seen_ns| seen_ns.is_some()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trouble_is_said_when_it_begins_and_when_it_is_over_and_not_in_between() {
        let mut condition = Condition::default();
        let mut said = Vec::new();
        for (at_ms, status) in [
            (0, 0x10),
            (100, 0x90),
            (200, 0x10),
            (300, 0x92),
            (2_200, 0x10),
            (2_300, 0x10),
            (2_400, 0x10),
            (2_500, 0xD3),
        ] {
            condition.see(at_ms * 1_000_000, Status(status), |trouble, begins| {
                said.push((at_ms, trouble, begins));
            });
        }
        assert_eq!(
            said,
            [
                (100, Trouble::WindowPolluted, true),
                (300, Trouble::Warning, true),
                (2_300, Trouble::WindowPolluted, false),
                (2_300, Trouble::Warning, false),
                (2_500, Trouble::WindowPolluted, true),
                (2_500, Trouble::Implausible, true),
                (2_500, Trouble::Error, true),
            ]
        );
        assert_eq!(
            condition.troubles().to_string(),
            "front window polluted, implausible measured values, an error"
        );
    }
}
