//! The status byte of scans: what is said when a trouble begins and when it is over.

use std::fmt;

use biplane_wire::lms::{Severity, Status};

/// A trouble that was not seen in the status byte for so long is off, nanoseconds.
const OFF_NS: i64 = 2_000_000_000;
/// It is said to be over when it was not seen for so long, nanoseconds ...
const OVER_NS: i64 = 10_000_000_000;
/// ... and each time that it then comes back, for twice as long as before, up to this: what comes and goes
/// for hours is said a few times, not every few seconds.
const LONGEST_OVER_NS: i64 = 640_000_000_000;

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
pub(crate) struct Condition([Watch; 4]);

/// One trouble.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
struct Watch {
    /// When it was seen last, unless it is said to be over.
    seen_ns: Option<i64>,
    /// When it was said to be over.
    over_ns: Option<i64>,
    /// It is over when it was not seen for so long.
    quiet_ns: i64,
}

impl Default for Watch {
    fn default() -> Self {
        Self { seen_ns: None, over_ns: None, quiet_ns: OVER_NS }
    }
}

impl Watch {
    /// Whether it is there now; `Some` when it begins or is over.
    fn see(&mut self, now_ns: i64, is_there: bool) -> Option<bool> {
        if is_there {
            let begins = self.seen_ns.replace(now_ns).is_none();
            if let (true, Some(over_ns)) = (begins, self.over_ns) {
                let is_new = now_ns.saturating_sub(over_ns) >= LONGEST_OVER_NS;
                self.quiet_ns = if is_new { OVER_NS } else { (2 * self.quiet_ns).min(LONGEST_OVER_NS) };
            }
            return begins.then_some(true);
        }
        if now_ns.saturating_sub(self.seen_ns?) < self.quiet_ns {
            return None;
        }
        self.seen_ns = None;
        self.over_ns = Some(now_ns);
        Some(false)
    }
}

impl Condition {
    /// A scan has this status; `say` is told of each trouble that begins (`true`) or is over.
    pub(crate) fn see(&mut self, now_ns: i64, status: Status, mut say: impl FnMut(Trouble, bool)) {
        for (trouble, watch) in Trouble::ALL.into_iter().zip(&mut self.0) {
            if let Some(begins) = watch.see(now_ns, trouble.is_in(status)) {
                say(trouble, begins);
            }
        }
    }

    /// The troubles that are on.
    pub(crate) fn troubles(&self, now_ns: i64) -> Troubles {
        let is_on = |watch: Watch| watch.seen_ns.is_some_and(|at_ns| now_ns.saturating_sub(at_ns) < OFF_NS);
        Troubles(self.0.map(is_on))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trouble_is_said_when_it_begins_and_when_it_is_over_and_not_in_between() {
        let mut condition = Condition::default();
        let mut reported = Vec::new();
        for (at_ms, status) in [
            (0, 0x10),
            (100, 0x90),
            (200, 0x10),
            (300, 0x92),
            (10_200, 0x10),
            (10_300, 0x10),
            (10_400, 0x10),
            (10_500, 0xD3),
        ] {
            condition.see(at_ms * 1_000_000, Status(status), |trouble, begins| {
                reported.push((at_ms, trouble, begins));
            });
        }
        assert_eq!(
            reported,
            [
                (100, Trouble::WindowPolluted, true),
                (300, Trouble::Warning, true),
                (10_300, Trouble::WindowPolluted, false),
                (10_300, Trouble::Warning, false),
                (10_500, Trouble::WindowPolluted, true),
                (10_500, Trouble::Implausible, true),
                (10_500, Trouble::Error, true),
            ]
        );
        assert_eq!(
            condition.troubles(10_500_000_000).to_string(),
            "front window polluted, implausible measured values, an error"
        );
        assert!(condition.troubles(13_000_000_000).is_empty());
    }

    #[test]
    fn a_trouble_that_comes_and_goes_for_an_hour_is_said_a_few_times() {
        for (period_s, times) in [(6, 1), (25, 4)] {
            let (mut condition, mut reported) = (Condition::default(), 0);
            for step in 0..36_000 {
                let status = if step % (period_s * 10) < 4 { 0x90 } else { 0x10 };
                condition.see(step * 100_000_000, Status(status), |_, begins| reported += u8::from(begins));
            }
            assert!(reported <= times, "every {period_s} s: {reported}");
        }
    }
}
