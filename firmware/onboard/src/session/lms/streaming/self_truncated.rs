//! Telegrams that our own requests cut: a laser that is told to stop does so within a telegram, and one that
//! was left streaming is stopped before it is asked anything. That is no damage on the line, and is counted
//! apart from it.

use biplane_wire::Counts;

/// In a recording, scans so long after the last request stream again; earlier ones may have been under way,
/// nanoseconds.
const UNDER_WAY_NS: i64 = 300_000_000;

/// What was cut.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct TruncationCounts {
    /// Telegrams: not finished, or with the rest of another one in them.
    pub telegrams: u64,
    /// Bytes that belong to no intact telegram for that reason.
    pub bytes: u64,
}

impl TruncationCounts {
    fn between(from: Counts, to: Counts) -> Self {
        let telegrams = |counts: Counts| counts.bad_checksums + counts.bad_lengths + counts.abandoned;
        Self {
            telegrams: telegrams(to).saturating_sub(telegrams(from)),
            bytes: to.skipped_bytes.saturating_sub(from.skipped_bytes),
        }
    }
}

/// Tells these from damage: what comes damaged after a request, before the first scan or after the last one.
/// In between, requests follow from something that went wrong.
#[derive(Clone, Debug, Default)]
pub(crate) struct SelfTruncation {
    /// The account when the first request since the last scan was sent.
    asked: Option<Counts>,
    asked_ns: i64,
    has_measured: bool,
    at_start: TruncationCounts,
}

impl SelfTruncation {
    /// A request was sent.
    pub(crate) fn asked(&mut self, now_ns: i64, counts: Counts) {
        self.asked.get_or_insert(counts);
        self.asked_ns = now_ns;
    }

    /// Scans flow.
    pub(crate) fn measured(&mut self, counts: Counts) {
        let asked = self.asked.take();
        if let (false, Some(asked)) = (self.has_measured, asked) {
            self.at_start = TruncationCounts::between(asked, counts);
        }
        self.has_measured = true;
    }

    /// The last scan of a recording is of this time; it is not known whether it was under way when the
    /// request was sent.
    pub(crate) fn recorded(&mut self, scan_ns: i64, counts: Counts) {
        if self.asked.is_none() || scan_ns.saturating_sub(self.asked_ns) > UNDER_WAY_NS {
            self.measured(counts);
        }
    }

    /// What was cut up to now.
    pub(crate) fn truncated(&self, counts: Counts) -> TruncationCounts {
        let TruncationCounts { telegrams, bytes } = match (self.has_measured, self.asked) {
            (true, Some(asked)) => TruncationCounts::between(asked, counts),
            _ => TruncationCounts::default(),
        };
        TruncationCounts {
            telegrams: self.at_start.telegrams + telegrams,
            bytes: self.at_start.bytes + bytes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn damage(telegrams: u64) -> Counts {
        Counts { abandoned: telegrams, skipped_bytes: 100 * telegrams, ..Counts::default() }
    }

    #[test]
    fn damage_before_the_first_scan_and_after_the_last_is_our_own_and_none_between() {
        let mut own = SelfTruncation::default();
        own.asked(0, damage(0));
        assert_eq!(
            own.truncated(damage(1)),
            TruncationCounts::default(),
            "a device that never streams has no telegram to cut"
        );
        own.measured(damage(1));
        assert_eq!(own.truncated(damage(3)), TruncationCounts { telegrams: 1, bytes: 100 });
        // It falls silent, is asked, and streams again.
        own.asked(5, damage(3));
        own.measured(damage(4));
        assert_eq!(own.truncated(damage(4)), TruncationCounts { telegrams: 1, bytes: 100 });
        own.asked(9, damage(4));
        assert_eq!(own.truncated(damage(5)), TruncationCounts { telegrams: 2, bytes: 200 });
    }

    #[test]
    fn a_scan_that_was_under_way_when_the_laser_was_stopped_does_not_hide_the_cut() {
        let mut own = SelfTruncation::default();
        own.recorded(0, damage(0));
        own.asked(1_000_000_000, damage(0));
        own.recorded(1_020_000_000, damage(0));
        assert_eq!(own.truncated(damage(1)).telegrams, 1);
    }
}
