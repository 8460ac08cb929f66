//! The rhythm of the scans, by their stamps: whether some were dropped, and whether they come in order.
//!
//! Units: seconds; stamps in nanoseconds.

/// A gap so many times the usual one means dropped scans.
const DROPPED: f64 = 1.5;
/// A guess is not stretched over more than this many scans.
const LONGEST_GUESS: f64 = 4.0;
/// Longer gaps between scans are a leap of the clock, seconds.
pub(crate) const LONGEST_GAP_S: f64 = 10.0;
/// Scans that come after less than this share of the mean gap come at once.
const AT_ONCE: f64 = 0.2;
/// What the newest scan counts for the share of those that come at once.
const DISORDER_RATE: f64 = 0.05;
/// Where more than this share of the scans come at once, their order is not sure.
const DISORDERED: f64 = 0.2;

/// What the stamps so far have shown.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cadence {
    last_stamp_ns: Option<i64>,
    usual_gap_s: Option<f64>,
    /// The same with stamps that repeat or step back: scans that come in bursts.
    mean_gap_s: Option<f64>,
    /// The share of the last scans whose stamps came at once with others, or stepped back.
    disorder: f64,
}

impl Cadence {
    /// Seconds since the last scan; `None` when the stamp repeats, steps back or is missing.
    pub(crate) fn gap_s(&self, stamp_ns: i64) -> Option<f64> {
        let gap_ns = stamp_ns.checked_sub(self.last_stamp_ns?)?;
        (gap_ns > 0).then_some(gap_ns as f64 * 1e-9)
    }

    /// Mean seconds between scans; `None` before the second.
    pub(crate) fn mean_gap_s(&self) -> Option<f64> {
        self.mean_gap_s
    }

    /// Whether the order of the scans is not sure.
    pub(crate) fn is_disordered(&self) -> bool {
        self.disorder >= DISORDERED
    }

    /// So many scans have usually come in the time since the last one, four at most: more than one when some
    /// seem to have been dropped. Stamps that repeat, step back or jitter change nothing.
    pub(crate) fn scans_since_last(&self, stamp_ns: i64) -> f64 {
        self.usual_gaps(stamp_ns).min(LONGEST_GUESS)
    }

    /// What the base has done since the last scan counts as so many steps from scan to scan: one where scans
    /// come in disorder, as gaps between them say nothing then.
    pub(crate) fn steps_since_last(&self, stamp_ns: i64) -> f64 {
        if self.is_disordered() { 1.0 } else { self.usual_gaps(stamp_ns) }
    }

    /// So many of these steps a guess goes on for.
    pub(crate) fn steps_to_guess(&self, stamp_ns: i64) -> f64 {
        self.steps_since_last(stamp_ns).min(LONGEST_GUESS)
    }

    fn usual_gaps(&self, stamp_ns: i64) -> f64 {
        match (self.gap_s(stamp_ns), self.usual_gap_s) {
            (Some(gap_s), Some(usual_s)) if gap_s > DROPPED * usual_s => gap_s / usual_s,
            _ => 1.0,
        }
    }

    /// Takes note of a scan's stamp.
    pub(crate) fn note(&mut self, stamp_ns: i64) {
        if let Some(gap_s) = self.gap_s(stamp_ns) {
            let usual_s = self.usual_gap_s.unwrap_or(gap_s);
            self.usual_gap_s = Some(usual_s + 0.1 * (gap_s.min(2.0 * usual_s) - usual_s));
        }
        if let Some(last_ns) = self.last_stamp_ns {
            let gap_s = (stamp_ns.saturating_sub(last_ns) as f64 * 1e-9).clamp(0.0, LONGEST_GAP_S);
            let mean_s = self.mean_gap_s.unwrap_or(gap_s);
            self.mean_gap_s = Some(mean_s + 0.1 * (gap_s - mean_s));
            let is_odd = gap_s < AT_ONCE * mean_s;
            self.disorder += DISORDER_RATE * (f64::from(u8::from(is_odd)) - self.disorder);
        }
        self.last_stamp_ns = Some(stamp_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: i64 = 1_000_000_000;

    fn after(stamps_ns: impl IntoIterator<Item = i64>) -> Cadence {
        let mut cadence = Cadence::default();
        stamps_ns.into_iter().for_each(|stamp_ns| cadence.note(stamp_ns));
        cadence
    }

    #[test]
    fn scans_in_pairs_or_out_of_order_are_disordered_and_a_rare_stamp_that_repeats_is_not() {
        assert!(!after((0..40).map(|number| number * S)).is_disordered());
        assert!(!after((0..40).map(|number| number.max(1) * S)).is_disordered());
        assert!(after((0..40).map(|number| number / 2 * S)).is_disordered());
        assert!(after((0..40).map(|number| (number ^ 1) * S)).is_disordered());
    }

    #[test]
    fn a_gap_counts_as_scans_up_to_four_and_odd_stamps_as_one() {
        let cadence = after((0..4).map(|number| number * S));
        assert_eq!(cadence.scans_since_last(5 * S), 2.0);
        assert_eq!(cadence.scans_since_last(i64::MAX), 4.0);
        assert_eq!([cadence.steps_since_last(9 * S), cadence.steps_to_guess(9 * S)], [6.0, 4.0]);
        for stamp_ns in [4 * S, 3 * S, 0, i64::MIN] {
            assert_eq!(cadence.scans_since_last(stamp_ns), 1.0, "{stamp_ns}");
        }
        let in_pairs = after((0..40).map(|number| number / 2 * S));
        assert!(in_pairs.scans_since_last(21 * S) > 1.5);
        assert_eq!(in_pairs.steps_since_last(21 * S), 1.0);
    }
}
