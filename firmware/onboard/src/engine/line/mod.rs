//! One serial line: its session, the times of its reads, and the stamps that follow from both.

pub(crate) mod decoded;
pub(crate) mod devices;
pub(crate) mod inertial_line;
pub(crate) mod laser_device;
pub(crate) mod lines;
pub(crate) mod monotonic;
pub(crate) mod stated;
pub(crate) mod watch;

use biplane_recording::rig::{self, BaseProtocol};
use biplane_wire::lms::MIRROR_TURN_NS;

use crate::engine::line::laser_device::LaserDevice;
use crate::engine::out::health::LineHealth;
use crate::engine::scan_data::ScanData;
use crate::session::base::BaseSession;
use crate::session::base::reading::OdometryReading;
use crate::session::cola::event::ColaEvent;
use crate::session::device_session::{Output, Session};
use crate::session::event::Event;
use crate::session::lms::scan::ranges::ScanReading;
use crate::session::scip::event::ScipEvent;
use crate::stamping::arrivals::{Arrivals, Bound, Extent, IN_TIME_NS, Pace};
use crate::stamping::cycle_clock::CycleClock;
use crate::stamping::cycle_params::CycleClockParams;
use crate::stamping::departure::{Departure, HostState};
use crate::stamping::device_clock::DeviceClock;
use crate::types::byte_time::byte_time_ns;

/// With so many bytes of a port that nobody read, a kernel's buffer was full: behind them some may be lost
/// (Linux: n_tty).
const KERNEL_BYTES: u64 = 4095;

/// Counts what a line brings, and how fast.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Meter {
    /// Measurements so far.
    pub measurements: u64,
    /// Stamps that stepped back.
    pub backward_stamps: u64,
    /// Starts of the session beyond the first.
    pub restarts: u64,
    /// Times that the port's buffer was full before it was read.
    pub overruns: u64,
    first_stamp_ns: Option<i64>,
    last_stamp_ns: Option<i64>,
    measurements_before: u64,
    latency_ns: i64,
}

impl Meter {
    /// A measurement with this stamp has come.
    pub(crate) fn count(&mut self, now_ns: i64, stamp_ns: i64) {
        self.measurements += 1;
        self.backward_stamps += u64::from(self.last_stamp_ns.is_some_and(|last| stamp_ns < last));
        self.first_stamp_ns.get_or_insert(stamp_ns);
        self.last_stamp_ns = Some(stamp_ns);
        self.latency_ns = self.latency_ns.max(now_ns.saturating_sub(stamp_ns));
    }

    /// From the first measurement to the last, nanoseconds; `None` before the first.
    pub(crate) fn span_ns(&self) -> Option<(i64, i64)> {
        self.first_stamp_ns.zip(self.last_stamp_ns)
    }

    /// A session has said something.
    pub(crate) fn note(&mut self, event: &Event) {
        self.restarts +=
            u64::from(matches!(event, Event::Silent { .. } | Event::Garbled { .. } | Event::PoweredOn));
    }

    /// The state of the last interval; the next one begins.
    pub(crate) fn health(&mut self, interval_s: f64) -> LineHealth {
        let new = self.measurements - self.measurements_before;
        self.measurements_before = self.measurements;
        let latency_s = std::mem::take(&mut self.latency_ns) as f64 * 1e-9;
        LineHealth {
            present: true,
            measurements: self.measurements,
            rate_hz: if interval_s > 0.0 { new as f64 / interval_s } else { 0.0 },
            restarts: self.restarts,
            overruns: self.overruns,
            latency_s,
            ..LineHealth::default()
        }
    }
}

/// A session with what its stamps need.
#[derive(Debug)]
pub(crate) struct Line<D> {
    /// The device's session.
    pub session: D,
    /// What it has brought.
    pub meter: Meter,
    arrivals: Arrivals,
    /// The device's cycles, where it works in such.
    cycles: Option<CycleClock>,
    bytes: u64,
    /// Bytes in a row that came before somebody listened.
    overdue_bytes: u64,
    /// From where to where bytes of such a row lie behind a buffer that may have been full.
    behind_full: (u64, u64),
    /// Bytes were lost in the row.
    has_lost: bool,
    /// Where the last measurement's telegram ended in the stream.
    end_offset: u64,
    wait_ns: i64,
}

/// What is known of a measurement's telegram beside its extent.
#[derive(Copy, Clone, Debug)]
struct Cycles {
    /// Cycles of one measurement.
    unit: i64,
    /// Cycles from one telegram to the next when only the line keeps them apart.
    step: i64,
    /// The device's own count of cycles, modulo 256.
    index: Option<u8>,
}

impl<D: Session> Line<D> {
    /// A line with this session, and the cycles of its device if it has such.
    #[must_use]
    pub(crate) fn new(session: D, cycles: Option<CycleClock>) -> Self {
        Self {
            session,
            meter: Meter::default(),
            arrivals: Arrivals::default(),
            cycles,
            bytes: 0,
            overdue_bytes: 0,
            behind_full: (0, 0),
            has_lost: false,
            end_offset: 0,
            wait_ns: i64::MIN,
        }
    }

    /// A read has returned, so long after the line was listened to last; the bytes themselves go to the
    /// session in pieces.
    pub(crate) fn arrived(&mut self, now_ns: i64, count: usize, unheard_ns: i64) {
        let is_overdue = unheard_ns > IN_TIME_NS;
        self.bytes += count as u64;
        self.has_lost &= self.overdue_bytes > 0;
        let was_full = self.overdue_bytes >= KERNEL_BYTES;
        self.overdue_bytes = if is_overdue { self.overdue_bytes + count as u64 } else { 0 };
        if self.overdue_bytes >= KERNEL_BYTES {
            self.meter.overruns += u64::from(!was_full);
            self.behind_full = (self.bytes - self.overdue_bytes + KERNEL_BYTES, self.bytes);
        }
        self.arrivals.push_read(self.bytes, now_ns, unheard_ns);
    }

    /// What the host's part was in this telegram, behind so many bytes that belong to none: where a full
    /// buffer has lost bytes, a telegram is cut.
    fn host_state(&mut self, telegram: &Extent, bound: Bound, between: u64) -> HostState {
        let end = telegram.offset.saturating_add(telegram.length as u64);
        let (from, to) = self.behind_full;
        let is_cut = between > 0 && end >= from && telegram.offset.saturating_sub(between) <= to && to > 0;
        self.has_lost |= is_cut;
        if bound.is_overdue && !self.has_lost {
            HostState::Overdue
        } else if bound.is_overdue || is_cut {
            HostState::Resumed
        } else {
            HostState::Listening
        }
    }

    /// What the session wants done; remembers how long it can wait.
    pub(crate) fn poll(&mut self) -> Output {
        let output = self.session.poll();
        if let Output::WaitUntil(wait_ns) = output {
            self.wait_ns = wait_ns;
        }
        output
    }

    /// When the session wants to be asked again; at once before it has been polled.
    #[must_use]
    pub(crate) fn wait_ns(&self) -> i64 {
        self.wait_ns
    }

    /// When a telegram left, by its reads and the device's cycles; as late as now when none of its reads is
    /// remembered.
    fn departure_ns(&mut self, now_ns: i64, telegram: &Extent, cycles: Cycles) -> i64 {
        let unknown = Bound { time_ns: now_ns, pace: Pace::AtOnce, is_overdue: false };
        let bound = self.arrivals.departure(telegram).unwrap_or(unknown);
        let between = telegram.offset.saturating_sub(self.end_offset);
        let host = self.host_state(telegram, bound, between);
        self.end_offset = telegram.offset.saturating_add(telegram.length as u64);
        let Some(clock) = &mut self.cycles else { return bound.time_ns };
        // What is between was telegrams that arrived damaged.
        let missing = i64::try_from(between.div_ceil(telegram.length.max(1) as u64)).unwrap_or(i64::MAX);
        clock.smooth(&Departure {
            time_ns: bound.time_ns,
            pace: bound.pace,
            unit: cycles.unit,
            min_cycles: cycles.step.saturating_mul(missing.saturating_add(1)),
            is_next: between == 0,
            index: cycles.index,
            host,
        })
    }

    /// The session has said something. A device that was switched on has a new phase and counts anew; whether
    /// it was, a session that had to look for it cannot tell, because the message of it may not have been
    /// heard.
    pub(crate) fn note(&mut self, event: &Event) {
        self.meter.note(event);
        let is_new = matches!(event, Event::PoweredOn | Event::Streaming | Event::OdometryRestarted);
        if let (true, Some(cycles)) = (is_new, &mut self.cycles) {
            cycles.reset();
        }
    }

    /// State of the line, for diagnostics.
    pub(crate) fn health(&mut self, interval_s: f64, streaming: bool) -> LineHealth {
        LineHealth {
            streaming,
            baud: self.session.baud(),
            counts: Some(self.session.counts()),
            ..self.meter.health(interval_s)
        }
    }
}

/// Bytes that an LMS sends in a turn of its mirror at most (SICK telegram listing, figures on data output):
/// at 500000 Bd it pauses after them.
const BYTES_PER_TURN: usize = 508;

/// A laser's line.
#[derive(Debug)]
pub(crate) struct LaserLine {
    /// The line.
    pub line: Line<LaserDevice>,
    /// The clock of a device that states its own time.
    device_clock: DeviceClock,
    delay_ns: i64,
    /// At which distance its scans came last that is none of its nominal mirror, nanoseconds; and whether
    /// that was said.
    odd_interval_ns: Option<i64>,
    is_odd_reported: bool,
}

impl LaserLine {
    /// The line of this laser of the rig.
    #[must_use]
    pub(crate) fn new(session: LaserDevice, laser: &rig::Laser) -> Self {
        let delay_ns = (laser.delay_ms * 1e6).round() as i64;
        let turns = || CycleClock::new(CycleClockParams::default(), MIRROR_TURN_NS).measured();
        let cycles = (!session.states_its_time()).then(turns);
        Self {
            line: Line::new(session, cycles),
            device_clock: DeviceClock::default(),
            delay_ns,
            odd_interval_ns: None,
            is_odd_reported: false,
        }
    }

    /// At which distance its scans come, if that is no whole number of nominal turns, milliseconds.
    pub(crate) fn odd_interval_ms(&self) -> Option<f64> {
        self.odd_interval_ns.map(|interval_ns| interval_ns as f64 * 1e-6)
    }

    /// The same when it is new.
    pub(crate) fn interval_news(&mut self) -> Option<Event> {
        let interval_ns = self.odd_interval_ns.filter(|_| !self.is_odd_reported)?;
        self.is_odd_reported = true;
        Some(Event::OddInterval { micros: u32::try_from(interval_ns / 1000).unwrap_or(u32::MAX) })
    }

    /// The distance of its telegrams, where that is no whole number of nominal turns, nanoseconds.
    fn interval_ns(&self) -> Option<i64> {
        self.line.cycles.as_ref().and_then(CycleClock::odd_interval_ns)
    }

    /// The scan with its stamp: its first byte left the device after all its turns. A laser sends every n-th
    /// scan, n being as small as its line allows.
    pub(crate) fn stamped(&mut self, now_ns: i64, reading: &ScanReading) -> ScanData {
        let turns = i64::from(reading.geometry.turns.max(1));
        let scan_ns = turns * MIRROR_TURN_NS;
        let byte_ns = byte_time_ns(self.line.session.baud());
        let transfer_ns = byte_ns * reading.length as i64;
        let scans = (transfer_ns + scan_ns - 1) / scan_ns;
        let pauses = byte_ns * BYTES_PER_TURN as i64 <= MIRROR_TURN_NS;
        let telegram = Extent {
            offset: reading.offset,
            length: reading.length,
            byte_ns,
            burst: if pauses { BYTES_PER_TURN } else { usize::MAX },
            spacing_ns: self.interval_ns().unwrap_or(scans * scan_ns),
        };
        let index = reading.index.map(|index| index.scan);
        let cycles = Cycles { unit: turns, step: scans * turns, index };
        let departure_ns = self.line.departure_ns(now_ns, &telegram, cycles);
        self.odd_interval_ns = self.interval_ns().or(self.odd_interval_ns);
        let stamp_ns = departure_ns.saturating_sub(scan_ns).saturating_sub(self.delay_ns);
        self.line.meter.count(now_ns, stamp_ns);
        ScanData::of_reading(reading, stamp_ns)
    }

    /// The scan that the session of a laser with a clock holds, with its remissions and its stamp.
    pub(crate) fn stamped_by_device(&mut self, now_ns: i64) -> Option<(ScanData, &[u16])> {
        let (offset, length, (stated, before_us)) = match &self.line.session {
            LaserDevice::Lms(_) => return None,
            LaserDevice::Cola(session) => {
                let scan = session.scan();
                (scan.offset, scan.length, stated::of_sick(scan))
            }
            LaserDevice::Scip(session) => {
                let scan = session.scan();
                (scan.offset, scan.length, stated::of_hokuyo(scan))
            }
        };
        // The network carries a telegram at once, and USB as good as: its first byte tells.
        let telegram = Extent { offset, length, byte_ns: 0, burst: usize::MAX, spacing_ns: 0 };
        let arrived_ns = self.line.arrivals.departure(&telegram).map_or(now_ns, |bound| bound.time_ns);
        let first_beam_ns = self.device_clock.stamp_ns(stated, arrived_ns, before_us);
        let stamp_ns = first_beam_ns.saturating_sub(self.delay_ns);
        self.line.meter.count(now_ns, stamp_ns);
        match &self.line.session {
            LaserDevice::Lms(_) => None,
            LaserDevice::Cola(session) => {
                let scan = session.scan();
                Some((ScanData::of_cola(scan, stamp_ns), &scan.intensities))
            }
            LaserDevice::Scip(session) => {
                let scan = session.scan();
                Some((ScanData::of_scip(scan, stamp_ns), &scan.intensities))
            }
        }
    }

    /// Whether the device's own clock began anew since this was asked last.
    pub(crate) fn restart_news(&mut self) -> Option<Event> {
        let event = match &self.line.session {
            LaserDevice::Scip(_) => Event::Scip(ScipEvent::Restarted),
            _ => Event::Cola(ColaEvent::Restarted),
        };
        self.device_clock.take_restart().then_some(event)
    }
}

/// From one packet of a Pioneer to the next, nanoseconds (its default; one that is set otherwise is stamped
/// packet by packet).
const REPORT_NS: i64 = 100_000_000;

impl Line<BaseSession> {
    /// The line of the rig's base. A Pioneer reports at fixed times by itself; answers come when they were
    /// asked for.
    #[must_use]
    pub(crate) fn of_base(session: BaseSession, base: &rig::Base) -> Self {
        let reports = matches!(base.protocol, BaseProtocol::P2os { .. });
        // Of a cycle of a tenth of a second, the times that matter are smaller shares than of a mirror's
        // turn.
        let params =
            CycleClockParams { bearing_share: 0.02, regular_share: 0.02, ..CycleClockParams::default() };
        Self::new(session, reports.then(|| CycleClock::new(params, REPORT_NS)))
    }

    /// The stamp of an odometry report: it was taken when the packet's first byte left the base.
    pub(crate) fn stamp_ns(&mut self, now_ns: i64, reading: &OdometryReading) -> i64 {
        let byte_ns = byte_time_ns(self.session.baud());
        let telegram = Extent {
            offset: reading.offset,
            length: reading.length,
            byte_ns,
            burst: usize::MAX,
            // Of packets that arrive in one read, each was on the line for as long as its bytes take.
            spacing_ns: byte_ns.saturating_mul(i64::try_from(reading.length).unwrap_or(i64::MAX)),
        };
        let stamp_ns = self.departure_ns(now_ns, &telegram, Cycles { unit: 1, step: 1, index: None });
        self.meter.count(now_ns, stamp_ns);
        stamp_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::base::BaseSettings;
    use biplane_matcher::Pose2;

    const MS: i64 = 1_000_000;

    #[test]
    fn packets_of_a_base_that_arrive_in_one_read_are_as_far_apart_as_the_line_takes() {
        let base = rig::Base::default();
        let settings = BaseSettings { baud: 9600, protocol: base.protocol };
        let mut line = Line::of_base(BaseSession::listening(settings, 0), &base);
        let length = 37;
        let read_ns = 1_000 * MS;
        line.arrived(read_ns, 3 * length, 0);
        let stamps_ns: Vec<i64> = (0..3)
            .map(|packet| {
                let offset = packet * length as u64;
                let odom_from_base = Pose2::default();
                line.stamp_ns(read_ns, &OdometryReading { offset, length, odom_from_base, battery_v: 12.0 })
            })
            .collect();
        // 37 bytes take 38.5 ms at 9600 Bd.
        let ago_ms: Vec<i64> = stamps_ns.iter().map(|stamp_ns| (read_ns - stamp_ns) / MS).collect();
        assert_eq!(ago_ms, [115, 77, 38]);
        assert_eq!(line.meter.backward_stamps, 0);
    }
}
