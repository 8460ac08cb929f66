//! How the cycles of a device are followed.

use std::fmt;

use crate::stamping::envelope::EnvelopeParams;

/// How a cycle clock follows.
#[derive(Copy, Clone, PartialEq)]
pub(crate) struct CycleClockParams {
    /// The line of the cycles.
    pub envelope: EnvelopeParams,
    /// So much before its cycle may a departure seem to be, nanoseconds: what the line is uncertain by.
    /// Larger: late ones are taken for early ones of the next cycle.
    pub early_ns: i64,
    /// So late is a departure still near its cycle, nanoseconds. Larger: cycles are seen where there are
    /// none.
    pub near_ns: i64,
    /// A departure up to this share of a cycle late bears the cycles out (an adapter with a latency timer is
    /// often so late). Larger: cycles are seen where there are none.
    pub bearing_share: f64,
    /// The same for one that comes as many cycles after the one before as was expected, which is a sign of
    /// its own.
    pub regular_share: f64,
    /// So many departures must have been judged before cycles are trusted.
    pub confident_after: u32,
    /// So many of the last sixteen may then be far from their cycle.
    pub max_outliers: u32,
    /// When for so long all departures may have been held back, such are believed: better ones do not come.
    /// Nanoseconds.
    pub blind_after_ns: i64,
    /// A departure later than this is not one held back, nanoseconds: the device has paused.
    pub longest_hold_ns: i64,
    /// An adapter's timer makes bytes no later than this, nanoseconds.
    pub longest_timer_ns: i64,
    /// When departures that are all late show that the phase is another one.
    pub lateness: LatenessParams,
    /// So many equal distances in a row are a habit.
    pub expected_interval: u32,
    /// After a pause so long, nanoseconds, everything is forgotten: the device may have been switched off and
    /// on, or be another one. Longer than a departure is held back, shorter than a laser takes to start.
    pub pause_ns: i64,
    /// The phase is forgotten when the line has become more uncertain than this, nanoseconds.
    pub forget_ns: i64,
}

impl fmt::Debug for CycleClockParams {
    /// All in one row, by the names that recordings have them under.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CycleClockParams")
            .field("envelope", &self.envelope)
            .field("early_ns", &self.early_ns)
            .field("near_ns", &self.near_ns)
            .field("bearing_share", &self.bearing_share)
            .field("regular_share", &self.regular_share)
            .field("trust_after", &self.confident_after)
            .field("trust_strays", &self.max_outliers)
            .field("blind_after_ns", &self.blind_after_ns)
            .field("longest_hold_ns", &self.longest_hold_ns)
            .field("longest_timer_ns", &self.longest_timer_ns)
            .field("alike_scans", &self.lateness.alike_scans)
            .field("raise_scans", &self.lateness.scans)
            .field("raise_after_ns", &self.lateness.after_ns)
            .field("raise_ns", &self.lateness.late_ns)
            .field("habit", &self.expected_interval)
            .field("pause_ns", &self.pause_ns)
            .field("forget_ns", &self.forget_ns)
            .finish()
    }
}

impl Default for CycleClockParams {
    fn default() -> Self {
        Self {
            envelope: EnvelopeParams::default(),
            early_ns: 1_000_000,
            near_ns: 2_000_000,
            bearing_share: 0.25,
            regular_share: 0.6,
            confident_after: 8,
            max_outliers: 3,
            blind_after_ns: 5_000_000_000,
            longest_hold_ns: 2_000_000_000,
            longest_timer_ns: 20_000_000,
            lateness: LatenessParams::default(),
            expected_interval: 4,
            pause_ns: 2_500_000_000,
            forget_ns: 1_000_000,
        }
    }
}

/// When departures that are all late show that the phase is another one.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct LatenessParams {
    /// So many departures in a row that were equally late, or ...
    pub alike_scans: u32,
    /// ... so many departures in a row ...
    pub scans: u32,
    /// ... over so long a time, nanoseconds ...
    pub after_ns: i64,
    /// ... all later than this, nanoseconds.
    pub late_ns: i64,
}

impl Default for LatenessParams {
    fn default() -> Self {
        Self { alike_scans: 3, scans: 8, after_ns: 800_000_000, late_ns: 1_000_000 }
    }
}
