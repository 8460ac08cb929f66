//! Where a mock laser's scans come from, and when they may leave: a world measured turn by turn, or a capture
//! played back.
//!
//! Time model (contract, section 2): a scan of k mirror turns begins at t0, on a boundary between turns; the
//! first byte of its telegram leaves at t0 + k T. Times are nanoseconds on the device's clock.

use super::mean::Mean;
use crate::devices::lms::scans::value_words::{Scale, range_bits, recode};
use crate::devices::lms::settings::Variant;
use crate::rig::source::{ScanSource, ScanWords};

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

    /// A mirror that turns slower than it should by so many millionths (faster when negative).
    #[must_use]
    pub fn of_ppm(phase_ns: i64, ppm: f64) -> Self {
        Self { phase_ns, turn_ns: (Self::TURN_NS as f64 * (1.0 + ppm * 1e-6)).round() as i64 }
    }

    /// Number of the turn that ends at this boundary.
    #[must_use]
    pub fn turn_before(self, boundary_ns: i64) -> i64 {
        (boundary_ns - self.phase_ns).div_euclid(self.turn_ns) - 1
    }

    /// By how many quarters of a degree the beams of the turn that ends at this boundary are offset, when a
    /// scan takes `turns` of them.
    #[must_use]
    pub fn quarter_before(self, boundary_ns: i64, turns: i64) -> u8 {
        let turns = turns.max(1);
        u8::try_from(self.turn_before(boundary_ns).rem_euclid(turns) * 4 / turns).unwrap_or(0)
    }
}

/// What is to be measured for a telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// One whole scan.
    Scan,
    /// The mean of so many scans.
    Mean(u8),
    /// One turn of the mirror over 180 degrees.
    Turn,
}

/// What a laser asks of its feed: the next scan whose telegram can leave at or after `earliest_ns`.
#[derive(Clone, Copy, Debug)]
pub struct Ask {
    /// When the line is free.
    pub earliest_ns: i64,
    /// What is wanted.
    pub wanted: Wanted,
    /// The device's mirror.
    pub mirror: Mirror,
    /// Variant in force.
    pub variant: Variant,
    /// Unit and mode in force.
    pub scale: Scale,
}

impl Ask {
    /// Mirror turns after which the device offers a telegram: those of a scan, times n for a mean of n.
    #[must_use]
    pub fn turns(&self) -> i64 {
        match self.wanted {
            Wanted::Scan => self.variant.turns(),
            Wanted::Mean(n) => i64::from(n.max(1)) * self.variant.turns(),
            Wanted::Turn => 1,
        }
    }

    /// The first beam of the scan or turn whose telegram leaves at `start_ns`; of a mean, that of the last
    /// scan.
    #[must_use]
    pub fn t0_ns(&self, start_ns: i64) -> i64 {
        let turns = if self.wanted == Wanted::Turn { 1 } else { self.variant.turns() };
        start_ns - turns * self.mirror.turn_ns
    }
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
    /// The mean on its way, and when its telegram leaves.
    mean: Option<(i64, Mean)>,
}

impl MirrorFeed {
    /// A laser in the world of `source`, whose time runs as `timeline` says.
    #[must_use]
    pub fn new(source: Box<dyn ScanSource>, timeline: Box<dyn Timeline>) -> Self {
        Self { source, timeline, mean: None }
    }

    /// The scan or turn that begins at `t0_ns`, in the scale asked for.
    fn measure(&mut self, ask: &Ask, t0_ns: i64) -> Option<ScanWords> {
        let from = source_scale(ask.scale);
        let world_ns = self.timeline.world_ns(t0_ns);
        let Variant { fov_deg, resolution_cdeg } = ask.variant;
        let mut words = match ask.wanted {
            Wanted::Turn => {
                let end_ns = t0_ns + ask.mirror.turn_ns;
                let quarter = ask.mirror.quarter_before(end_ns, ask.variant.turns());
                self.source.turn(world_ns, quarter, from.mm)
            }
            _ => self.source.scan(world_ns, fov_deg, resolution_cdeg, from.mm),
        }?;
        words.iter_mut().for_each(|word| *word = recode(*word, from, ask.scale));
        Some(words)
    }

    /// Measures the scans of a mean one a call, each when it is whole, so that no caller waits for all of
    /// them.
    fn next_of_mean(&mut self, ask: &Ask, count: u8, start_ns: i64) -> Answer {
        let mut mean = match self.mean.take() {
            Some((begun_ns, mean)) if begun_ns == start_ns => mean,
            _ => Mean::default(),
        };
        let scan_ns = ask.variant.turns() * ask.mirror.turn_ns;
        let whole_ns = |scans: u32| start_ns - (i64::from(count) - i64::from(scans)) * scan_ns;
        let Some(words) = self.measure(ask, whole_ns(mean.scans())) else { return Answer::Ended };
        mean.add(&words, ask.scale.mode);
        if mean.scans() < u32::from(count) {
            let at_ns = whole_ns(mean.scans());
            self.mean = Some((start_ns, mean));
            return Answer::Later(at_ns);
        }
        Answer::Scan(Box::new(Offer { start_ns, words: mean.words(), status: STATUS_OK, skipped: 0 }))
    }
}

/// A 13-bit millimeter scan ends at 8.18 m, so the finer modes are measured in centimeters, as coarse as the
/// device is anyway.
#[must_use]
pub fn source_scale(asked: Scale) -> Scale {
    Scale { mode: 0, mm: asked.mm && range_bits(asked.mode) == 13 }
}

impl ScanFeed for MirrorFeed {
    fn holds(&self, variant: Variant) -> bool {
        Variant::ALL.contains(&variant) || variant == Variant::S14
    }

    fn next(&mut self, ask: &Ask) -> Answer {
        let start_ns = ask.mirror.boundary_at_or_after(ask.earliest_ns, ask.turns());
        if let Wanted::Mean(count) = ask.wanted {
            return self.next_of_mean(ask, count, start_ns);
        }
        match self.measure(ask, ask.t0_ns(start_ns)) {
            Some(words) => Answer::Scan(Box::new(Offer { start_ns, words, status: STATUS_OK, skipped: 0 })),
            None => Answer::Ended,
        }
    }
}
