//! One serial line: its session, the times of its reads, and the stamps that follow from both.

use biplane_recording::rig;
use biplane_wire::lms::MIRROR_TURN_NS;

use super::scan_data::ScanData;
use crate::health::LineHealth;
use crate::session::base::{BaseSession, OdometryReading};
use crate::session::laser::{LaserSession, ScanReading};
use crate::session::{Event, Output, Session};
use crate::stamping::{Arrivals, Departure, TurnClock, TurnClockParams, byte_time_ns};

/// Counts what a line brings, and how fast.
#[derive(Copy, Clone, Debug, Default)]
pub struct Meter {
    /// Measurements so far.
    pub measurements: u64,
    /// Stamps that stepped back.
    pub backward_stamps: u64,
    /// Starts of the session beyond the first.
    pub restarts: u64,
    last_stamp_ns: Option<i64>,
    measurements_before: u64,
    latency_ns: i64,
}

impl Meter {
    /// A measurement with this stamp has come.
    pub fn count(&mut self, now_ns: i64, stamp_ns: i64) {
        self.measurements += 1;
        self.backward_stamps += u64::from(self.last_stamp_ns.is_some_and(|last| stamp_ns < last));
        self.last_stamp_ns = Some(stamp_ns);
        self.latency_ns = self.latency_ns.max(now_ns.saturating_sub(stamp_ns));
    }

    /// A session has said something.
    pub fn note(&mut self, event: &Event) {
        self.restarts +=
            u64::from(matches!(event, Event::Silent { .. } | Event::Garbled { .. } | Event::PoweredOn));
    }

    /// The state of the last interval; the next one begins.
    pub fn health(&mut self, interval_s: f64) -> LineHealth {
        let new = self.measurements - self.measurements_before;
        self.measurements_before = self.measurements;
        let latency_s = std::mem::take(&mut self.latency_ns) as f64 * 1e-9;
        LineHealth {
            present: true,
            measurements: self.measurements,
            rate_hz: if interval_s > 0.0 { new as f64 / interval_s } else { 0.0 },
            restarts: self.restarts,
            latency_s,
            ..LineHealth::default()
        }
    }
}

/// A session with what its stamps need.
#[derive(Debug)]
pub struct Line<D> {
    /// The device's session.
    pub session: D,
    /// What it has brought.
    pub meter: Meter,
    arrivals: Arrivals,
    bytes: u64,
    wait_ns: i64,
}

impl<D: Session> Line<D> {
    /// A line with this session.
    #[must_use]
    pub fn new(session: D) -> Self {
        Self { session, meter: Meter::default(), arrivals: Arrivals::default(), bytes: 0, wait_ns: i64::MIN }
    }

    /// A read has returned; the bytes themselves go to the session in pieces.
    pub fn arrived(&mut self, now_ns: i64, count: usize) {
        self.bytes += count as u64;
        self.arrivals.push(self.bytes, now_ns);
    }

    /// What the session wants done; remembers how long it can wait.
    pub fn poll(&mut self) -> Output {
        let output = self.session.poll();
        if let Output::WaitUntil(wait_ns) = output {
            self.wait_ns = wait_ns;
        }
        output
    }

    /// When the session wants to be asked again; at once before it has been polled.
    #[must_use]
    pub fn wait_ns(&self) -> i64 {
        self.wait_ns
    }

    fn departure_ns(&self, offset: u64, length: usize, now_ns: i64) -> i64 {
        let byte_ns = byte_time_ns(self.session.baud());
        self.arrivals.departure_ns(offset, length, byte_ns).unwrap_or(now_ns)
    }

    /// State of the line, for diagnostics.
    pub fn health(&mut self, interval_s: f64, streaming: bool) -> LineHealth {
        LineHealth {
            streaming,
            baud: self.session.baud(),
            counts: Some(self.session.counts()),
            ..self.meter.health(interval_s)
        }
    }
}

/// A laser's line.
#[derive(Debug)]
pub struct LaserLine {
    /// The line.
    pub line: Line<LaserSession>,
    turn_clock: TurnClock,
    /// Where the last scan's telegram ended in the stream.
    end_offset: u64,
    delay_ns: i64,
}

impl LaserLine {
    /// The line of this laser of the rig.
    #[must_use]
    pub fn new(session: LaserSession, laser: &rig::Laser) -> Self {
        let delay_ns = (laser.delay_ms * 1e6).round() as i64;
        let turn_clock = TurnClock::new(TurnClockParams::default());
        Self { line: Line::new(session), turn_clock, end_offset: 0, delay_ns }
    }

    /// The scan with its stamp: its first byte left the device after all its turns.
    pub fn stamped(&mut self, now_ns: i64, reading: &ScanReading) -> ScanData {
        let departure_ns = self.line.departure_ns(reading.offset, reading.length, now_ns);
        let turns = reading.fan.turns;
        let is_next = reading.offset == self.end_offset;
        self.end_offset = reading.offset.saturating_add(reading.length as u64);
        let turns_ns = i64::from(turns.max(1)) * MIRROR_TURN_NS;
        let transfer_ns = byte_time_ns(self.line.session.baud()) * reading.length as i64;
        let step_scans = (transfer_ns + turns_ns - 1) / turns_ns;
        let departure = Departure { time_ns: departure_ns, turns, is_next, step_scans };
        let smooth_ns = self.turn_clock.smooth(departure);
        let stamp_ns = smooth_ns.saturating_sub(turns_ns).saturating_sub(self.delay_ns);
        self.line.meter.count(now_ns, stamp_ns);
        ScanData::of_reading(reading, stamp_ns)
    }

    /// The session has said something; a device that was started anew has a new phase.
    pub fn note(&mut self, event: &Event) {
        self.line.meter.note(event);
        if matches!(event, Event::Streaming) {
            self.turn_clock.reset();
        }
    }
}

impl Line<BaseSession> {
    /// The stamp of an odometry report: it was taken when the packet's first byte left the base.
    pub fn stamp_ns(&mut self, now_ns: i64, reading: &OdometryReading) -> i64 {
        let stamp_ns = self.departure_ns(reading.offset, reading.length, now_ns);
        self.meter.count(now_ns, stamp_ns);
        stamp_ns
    }
}
