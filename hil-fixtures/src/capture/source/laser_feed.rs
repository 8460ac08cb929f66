//! A capture's scans for a mock laser: in order, each at its time since the capture's start, on the turns of
//! the mirror.
//!
//! As long as the line keeps up no scan is passed over; when it does not, the newest whole scan goes out
//! next, as from a real device. Where a capture pauses (imported logs do while their robot stands) the last
//! scan is sent again: a laser never falls silent.

use super::laser_track::{LaserTrack, RecordedScan};
use super::slots::{Slots, onto_turns};
use crate::devices::lms::scans::feed::{Answer, Ask, Mirror, Offer, ScanFeed, Wanted};
use crate::devices::lms::scans::mean::Mean;
use crate::devices::lms::scans::value_words::{Scale, recode};
use crate::devices::lms::settings::Variant;
use crate::devices::run::Run;
use crate::rig::source::ScanWords;
use std::sync::Arc;

const MS: i64 = 1_000_000;

/// A laser that has nothing to send is asked again after this long.
const PATIENCE_NS: i64 = 5 * MS;

/// A scan is handed to the device at most this long before it leaves.
const AHEAD_NS: i64 = 30 * MS;

/// A pause this long is filled: long enough that scans lost to a fault stay lost, shorter than a driver's
/// patience.
pub const HOLD_NS: i64 = 500 * MS;

/// A filling scan leaves the line free this long before the next recorded one.
const CLEAR_NS: i64 = 250 * MS;

/// The feed.
pub struct CaptureScans {
    track: Arc<LaserTrack>,
    slots: Slots,
    /// From a scan to the next, to go on with the last one.
    usual_ns: i64,
    variant: Option<Variant>,
    mode: u8,
    run: Run,
    run_number: u64,
    /// The scan that was not offered yet.
    next: usize,
    /// When the last scan left, since the capture's start.
    last_ns: i64,
    once: bool,
}

/// A scan and when it leaves, since the capture's start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Choice {
    index: usize,
    start_ns: i64,
    skipped: usize,
}

impl CaptureScans {
    /// `origin_ns` is the capture's start; with `once` the feed ends with the capture, else the last scan
    /// goes on.
    #[must_use]
    pub fn new(track: Arc<LaserTrack>, origin_ns: i64, run: Run, once: bool) -> Self {
        let times_ns: Vec<i64> = track.scans.iter().map(|scan| scan.time_ns - origin_ns).collect();
        let slots = onto_turns(&times_ns, Mirror::TURN_NS);
        let mut steps_ns: Vec<i64> = slots.starts_ns.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps_ns.sort_unstable();
        let variant = track.variant();
        let min_ns = variant.map_or(1, Variant::turns) * Mirror::TURN_NS;
        let usual_ns = steps_ns.get(steps_ns.len() / 2).copied().unwrap_or(min_ns).max(min_ns);
        let mode = track.initial_config().measuring_mode();
        Self {
            track,
            slots,
            usual_ns,
            variant,
            mode,
            run,
            run_number: 0,
            next: 0,
            last_ns: i64::MIN / 2,
            once,
        }
    }

    /// The next time at which a scan may leave: on a boundary, if the scans follow a mirror.
    fn boundary_ns(&self, earliest_ns: i64, turn_ns: i64) -> i64 {
        match self.slots.phase_ns {
            Some(phase_ns) => Mirror { phase_ns, turn_ns }.boundary_at_or_after(earliest_ns, 1),
            None => earliest_ns,
        }
    }

    /// The newest scan that is whole within a turn from now or, when none is new, the next one.
    fn choose(&self, earliest_ns: i64, turn_ns: i64) -> Option<Choice> {
        let starts_ns = &self.slots.starts_ns;
        let whole = starts_ns.partition_point(|&start_ns| start_ns < earliest_ns + turn_ns);
        if whole > self.next {
            let start_ns = starts_ns[whole - 1].max(self.boundary_ns(earliest_ns, turn_ns));
            return Some(Choice { index: whole - 1, start_ns, skipped: whole - 1 - self.next });
        }
        if let Some(&start_ns) = starts_ns.get(self.next) {
            let scan = Choice { index: self.next, start_ns, skipped: 0 };
            return Some(self.fill_pause(earliest_ns, start_ns).unwrap_or(scan));
        }
        let index = starts_ns.len().checked_sub(1).filter(|_| !self.once)?;
        let start_ns = self.boundary_ns(earliest_ns.max(self.last_ns + self.usual_ns), turn_ns);
        Some(Choice { index, start_ns, skipped: 0 })
    }

    /// The scan before once more, when the next one is far away.
    fn fill_pause(&self, earliest_ns: i64, next_ns: i64) -> Option<Choice> {
        let index = self.next.checked_sub(1)?;
        let start_ns = self.boundary_ns(earliest_ns.max(self.last_ns + HOLD_NS), Mirror::TURN_NS);
        (start_ns + CLEAR_NS <= next_ns).then_some(Choice { index, start_ns, skipped: 0 })
    }

    fn words(&self, scan: &RecordedScan, scale: Scale) -> ScanWords {
        let from = Scale { mode: self.mode, mm: scan.mm };
        scan.words.iter().map(|&word| recode(word, from, scale)).collect()
    }

    /// The scan chosen; a mean of it and the ones before it, or one of its turns, if that is wanted.
    fn offer(&self, choice: Choice, start_ns: i64, ask: &Ask) -> Answer {
        let Some(scan) = self.track.scans.get(choice.index) else { return Answer::Ended };
        let mut words = self.words(scan, ask.scale);
        match ask.wanted {
            Wanted::Scan => {}
            Wanted::Mean(count) => {
                let first = (choice.index + 1).saturating_sub(usize::from(count));
                let mut mean = Mean::default();
                for scan in &self.track.scans[first..=choice.index] {
                    mean.add(&self.words(scan, ask.scale), ask.scale.mode);
                }
                words = mean.words();
            }
            Wanted::Turn => {
                let turns = ask.variant.turns();
                let quarter = ask.mirror.quarter_before(start_ns, turns);
                let first = usize::from(quarter) * usize::try_from(turns).unwrap_or(1) / 4;
                words = words.into_iter().skip(first).step_by(usize::try_from(turns).unwrap_or(1)).collect();
            }
        }
        Answer::Scan(Box::new(Offer { start_ns, words, status: scan.status, skipped: choice.skipped as u64 }))
    }
}

impl ScanFeed for CaptureScans {
    fn holds(&self, variant: Variant) -> bool {
        self.variant == Some(variant)
    }

    fn next(&mut self, ask: &Ask) -> Answer {
        let Some(begun) = self.run.begun() else { return Answer::Later(ask.earliest_ns + PATIENCE_NS) };
        if begun.number != self.run_number {
            self.run_number = begun.number;
            self.next = 0;
            self.last_ns = i64::MIN / 2;
        }
        let earliest_ns = ask.earliest_ns - begun.start_ns;
        let Some(choice) = self.choose(earliest_ns, ask.mirror.turn_ns) else { return Answer::Ended };
        let start_ns = begun.start_ns + choice.start_ns;
        if start_ns - ask.earliest_ns > AHEAD_NS {
            return Answer::Later(start_ns - AHEAD_NS);
        }
        self.next = choice.index + 1;
        self.last_ns = choice.start_ns;
        self.offer(choice, start_ns, ask)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::run::RunRules;

    const TURN_NS: i64 = Mirror::TURN_NS;

    fn feed(spacing_turns: i64, once: bool) -> CaptureScans {
        let scan = |n: i64| RecordedScan {
            time_ns: 1_000 + n * spacing_turns * TURN_NS,
            words: [n as u16; 181].into_iter().collect(),
            mm: false,
            status: 0x10,
        };
        let track = LaserTrack { scans: (0..40).map(scan).collect(), ..LaserTrack::default() };
        let rules =
            RunRules { lasers: 1, others: 0, pause_ns: 0, patience_ns: None, start_at_ns: Some(7_000) };
        CaptureScans::new(Arc::new(track), 1_000, Run::new(rules), once)
    }

    /// Start (in turns since the run's) and first word of each scan sent by a line that is busy for `busy_ns`
    /// a scan.
    fn play(feed: &mut CaptureScans, busy_ns: i64, maximum: usize) -> Vec<(i64, u16)> {
        let mut ask = Ask {
            earliest_ns: 7_000,
            wanted: Wanted::Scan,
            mirror: Mirror { phase_ns: 0, turn_ns: TURN_NS },
            variant: Variant::of(180, 100),
            scale: Scale { mode: 0, mm: false },
        };
        let mut sent = Vec::new();
        while sent.len() < maximum {
            match feed.next(&ask) {
                Answer::Scan(offer) => {
                    sent.push(((offer.start_ns - 7_000) / TURN_NS, offer.words[0]));
                    ask.earliest_ns = offer.start_ns + busy_ns;
                }
                Answer::Later(at_ns) => ask.earliest_ns = at_ns,
                Answer::Ended => break,
            }
        }
        sent
    }

    #[test]
    fn a_line_as_fast_as_the_captures_gets_every_scan_at_its_time() {
        let sent = play(&mut feed(8, true), 96_900_000, 100);
        assert_eq!(sent, (0..40).map(|n| (n * 8, n as u16)).collect::<Vec<_>>());
    }

    #[test]
    fn a_slower_line_gets_every_nth_scan_as_it_is_measured() {
        let sent = play(&mut feed(1, true), 96_900_000, 100);
        assert_eq!(sent, [(0, 0), (8, 8), (16, 16), (24, 24), (32, 32), (40, 39)]);
    }

    #[test]
    fn after_the_end_the_last_scan_goes_on_at_the_usual_pace() {
        let sent = play(&mut feed(8, false), 96_900_000, 43);
        assert_eq!(sent[39..], [(312, 39), (320, 39), (328, 39), (336, 39)]);
    }

    #[test]
    fn a_pause_is_filled_with_the_scan_before_it() {
        let sent = play(&mut feed(100, true), 96_900_000, 6);
        assert_eq!(sent, [(0, 0), (38, 0), (76, 0), (100, 1), (138, 1), (176, 1)]);
    }

    #[test]
    fn only_the_variant_of_the_capture_can_be_had() {
        let feed = feed(8, true);
        assert!(feed.holds(Variant::of(180, 100)) && !feed.holds(Variant::of(180, 50)));
    }
}
