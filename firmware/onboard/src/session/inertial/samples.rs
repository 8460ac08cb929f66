//! From measurements to samples: whole ones, with possible numbers, at times that follow each other.

use biplane_wire::xsens::{Sample, status};

use crate::session::event::Event;
use crate::session::inertial::clock::{Acceptance, SampleClock, SampleTime, StatedTime};
use crate::session::inertial::event::InertialEvent;
use crate::session::inertial::health::InertialHealth;
use crate::session::inertial::reading::InertialReading;

/// Turns faster than any unit's largest range (2000 degrees a second), radians per second.
const MAX_TURN_RAD_S: f64 = 50.0;
/// Accelerates harder than any unit's largest range (20 g), meters per second squared.
const MAX_FORCE_M_S2: f64 = 400.0;
/// A unit that sends something else sends it again and again: so many messages in a row that are no sample
/// were sent so. Fewer were damaged in a way that the checksum does not show. It does not see the order of
/// bytes: where a quarter of all messages is damaged so, 16 in a row come once in billions. Larger: said
/// later.
const SENT_SO: u32 = 16;

/// Where and when a message came.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Arrived {
    /// Index in the stream of its first byte.
    pub offset: u64,
    /// Its bytes.
    pub length: usize,
    /// When it came, nanoseconds.
    pub now_ns: i64,
}

/// What is said once a run: whether it has happened, and whether it was said.
#[derive(Copy, Clone, Debug, Default)]
struct Once {
    has_happened: bool,
    is_reported: bool,
}

impl Once {
    fn is_news(&mut self) -> bool {
        self.has_happened && !std::mem::replace(&mut self.is_reported, true)
    }
}

/// Judges measurements.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Samples {
    clock: SampleClock,
    /// A sample whose time is not believed yet.
    doubted: Option<InertialReading>,
    /// Messages in a row with a good checksum that are no sample, though the unit has been told what to send.
    unlike: u32,
    health: InertialHealth,
    incomplete: Once,
    clipped: Once,
    fault: Once,
    has_fault: Option<bool>,
}

impl Samples {
    /// The unit is told to measure: its time and count may begin anew.
    pub(crate) fn expect_anew(&mut self) {
        self.clock.expect_anew();
    }

    /// Counts over the whole session.
    pub(crate) fn health(&self) -> &InertialHealth {
        &self.health
    }

    /// Whether the unit says that it has not passed its self-test; `None` before it has said anything.
    pub(crate) fn has_fault(&self) -> Option<bool> {
        self.has_fault
    }

    /// What has happened for the first time.
    pub(crate) fn news(&mut self) -> Option<Event> {
        if self.incomplete.is_news() {
            return Some(Event::Inertial(InertialEvent::Incomplete));
        }
        if self.clipped.is_news() {
            return Some(Event::Inertial(InertialEvent::Clipped));
        }
        self.fault.is_news().then_some(Event::HasFault)
    }

    /// The samples that are accepted with this measurement; `None` when it is none. Whether the unit has been
    /// told what to send decides what an incomplete one is.
    pub(crate) fn take(
        &mut self,
        arrived: Arrived,
        sample: &Sample,
        is_configured: bool,
    ) -> Option<[Option<InertialReading>; 2]> {
        let (Some(counter), Some(ticks), Some(force_m_s2), Some(turn_rad_s)) =
            (sample.packet_counter, sample.time_fine, sample.acceleration_m_s2, sample.turn_rad_s)
        else {
            self.no_sample(is_configured);
            self.health.incomplete += u64::from(!is_configured);
            return None;
        };
        let is_possible = turn_rad_s.iter().all(|turn| turn.abs() <= MAX_TURN_RAD_S)
            && force_m_s2.iter().all(|force| force.abs() <= MAX_FORCE_M_S2);
        if !is_possible {
            self.health.rejected += 1;
            return None;
        }
        self.unlike = 0;
        self.flags(sample.status_word.unwrap_or(status::SELF_TEST));
        let Arrived { offset, length, now_ns } = arrived;
        let reading = |time| InertialReading { offset, length, time, turn_rad_s, force_m_s2 };
        let rejected = self.clock.rejected();
        let acceptance = self.clock.take(StatedTime { ticks, counter, now_ns });
        self.health.rejected += self.clock.rejected() - rejected;
        let before = self.doubted.take();
        let readings = match acceptance {
            Acceptance::Accepted(time) => [None, Some(reading(time))],
            Acceptance::Undecided => {
                self.doubted = Some(reading(SampleTime::default()));
                [None; 2]
            }
            Acceptance::BothAccepted([earlier, time]) => {
                [before.map(|before| InertialReading { time: earlier, ..before }), Some(reading(time))]
            }
        };
        let missing = readings.iter().flatten().map(|reading| u64::from(reading.time.missing));
        self.health.missing += missing.sum::<u64>();
        Some(readings)
    }

    /// A message with a good checksum that cannot be read. Before the unit was told what to send it is
    /// damaged.
    pub(crate) fn unreadable(&mut self, is_configured: bool) {
        self.no_sample(is_configured);
        self.health.rejected += u64::from(!is_configured);
    }

    /// Whether messages that are no sample are still taken for damaged ones.
    pub(crate) fn takes_back(&self) -> bool {
        self.unlike < SENT_SO
    }

    fn no_sample(&mut self, is_configured: bool) {
        if !is_configured {
            return;
        }
        self.unlike = self.unlike.saturating_add(1);
        if self.unlike < SENT_SO {
            self.health.rejected += 1;
        } else if self.unlike == SENT_SO {
            self.health.rejected -= u64::from(SENT_SO - 1);
            self.not_kept(u64::from(SENT_SO));
        } else {
            self.not_kept(1);
        }
    }

    fn not_kept(&mut self, messages: u64) {
        self.health.not_kept += messages;
        self.health.incomplete += messages;
        self.incomplete.has_happened = true;
    }

    fn flags(&mut self, word: u32) {
        let is_clipped = word & status::CLIPPING != 0;
        self.health.clipped += u64::from(is_clipped);
        self.clipped.has_happened |= is_clipped;
        let has_fault = word & status::SELF_TEST == 0;
        self.has_fault = Some(has_fault);
        self.fault.has_happened |= has_fault;
    }
}
