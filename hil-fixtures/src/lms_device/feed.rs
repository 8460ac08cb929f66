//! Where a mock laser's scans come from, and when they may leave: a world measured turn by turn, or a capture played back.
//!
//! Time model (contract, section 2): a scan of k mirror turns begins at t0, on a boundary between turns; the first byte of its
//! telegram leaves at t0 + k T. Times are nanoseconds on the device's clock.

use super::settings::Variant;
use super::words::{Scale, recode};
use crate::source::{ScanSource, ScanWords};

/// When the mirror passes its zero: boundary n is at `phase_ns + n * turn_ns`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mirror {
    /// Time of boundary 0.
    pub phase_ns: i64,
    /// One turn.
    pub turn_ns: i64,
}

impl Mirror {
    /// One turn of an LMS 2xx at 75 Hz.
    pub const TURN_NS: i64 = 13_320_000;

    /// The first boundary at or after `at_ns` whose number is a multiple of `turns`.
    #[must_use]
    pub fn boundary_at_or_after(self, at_ns: i64, turns: i64) -> i64 {
        let period_ns = self.turn_ns * turns;
        let since = (at_ns - self.phase_ns).rem_euclid(period_ns);
        if since == 0 { at_ns } else { at_ns + period_ns - since }
    }
}

/// What a laser asks of its feed: the next scan whose telegram can leave at or after `earliest_ns`.
#[derive(Clone, Copy, Debug)]
pub struct Ask {
    /// When the line is free.
    pub earliest_ns: i64,
    /// Mirror turns after which the device offers a telegram: those of a scan, times n for a mean of n.
    pub turns: i64,
    /// The device's mirror.
    pub mirror: Mirror,
    /// Variant in force.
    pub variant: Variant,
    /// Unit and mode in force.
    pub scale: Scale,
}

/// A scan to send.
#[derive(Clone, Debug)]
pub struct Offer {
    /// When the first byte leaves; t0 is this less the scan's turns.
    pub start_ns: i64,
    /// Value words in the unit and mode asked for.
    pub words: ScanWords,
    /// Status byte of the telegram.
    pub status: u8,
    /// Whole scans of the source that were passed over because the line was busy.
    pub skipped: u64,
}

/// Status byte of an undisturbed LMS type 6.
pub const STATUS_OK: u8 = 0x10;

/// A feed's answer.
#[derive(Clone, Debug)]
pub enum Answer {
    /// Send this.
    Scan(Box<Offer>),
    /// Nothing yet: ask again at this time.
    Later(i64),
    /// Nothing any more.
    Ended,
}

/// Gives a mock laser its scans.
pub trait ScanFeed: Send {
    /// Whether the device can be set to this variant.
    fn holds(&self, variant: Variant) -> bool;

    /// The next scan for a device that streams or was asked for one.
    fn next(&mut self, ask: &Ask) -> Answer;

    /// Status byte of replies at this time.
    fn status(&mut self, now_ns: i64) -> u8 {
        let _ = now_ns;
        STATUS_OK
    }
}

/// Maps a device's clock to the time of what it measures.
pub trait Timeline: Send {
    /// Time in the world at this time on the device's clock; negative before a drive has begun.
    fn world_ns(&self, device_ns: i64) -> i64;
}

/// A feed that measures a [`ScanSource`] scan by scan.
pub struct MirrorFeed {
    source: Box<dyn ScanSource>,
    timeline: Box<dyn Timeline>,
}

impl MirrorFeed {
    /// A laser in the world of `source`, whose time runs as `timeline` says.
    #[must_use]
    pub fn new(source: Box<dyn ScanSource>, timeline: Box<dyn Timeline>) -> Self {
        Self { source, timeline }
    }

    /// A 13-bit millimetre scan ends at 8.18 m, so the finer modes are measured in centimetres, as coarse as the device is anyway.
    fn source_scale(asked: Scale) -> Scale {
        Scale { mode: 0, mm: asked.mm && asked.mode <= 2 }
    }
}

impl ScanFeed for MirrorFeed {
    fn holds(&self, variant: Variant) -> bool {
        Variant::ALL.contains(&variant)
    }

    fn next(&mut self, ask: &Ask) -> Answer {
        let start_ns = ask.mirror.boundary_at_or_after(ask.earliest_ns, ask.turns);
        let t0_ns = start_ns - ask.variant.turns() * ask.mirror.turn_ns;
        let from = Self::source_scale(ask.scale);
        let world_ns = self.timeline.world_ns(t0_ns);
        let Variant { fov_deg, resolution_cdeg } = ask.variant;
        match self.source.scan(world_ns, fov_deg, resolution_cdeg, from.mm) {
            Some(mut words) => {
                words.iter_mut().for_each(|word| *word = recode(*word, from, ask.scale));
                Answer::Scan(Box::new(Offer { start_ns, words, status: STATUS_OK, skipped: 0 }))
            }
            None => Answer::Ended,
        }
    }
}
