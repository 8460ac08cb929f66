//! The core that `record` and `replay` share: bytes with their times in, posed scans out. No I/O, no clock.
//!
//! ```text
//! bytes of the lines   -> sessions -> scans with stamps -> wait for odometry -> tracker -> /pose, /tf
//!                                          |                                       |
//!                                          +--> /scan/... at once                  +-> vertical poses
//! ```
//! Inputs carry the host's time in nanoseconds; the engine never asks for it. The order of outputs depends on
//! the inputs alone. Whoever drives it: one input, then [`Engine::next_command`] and [`Engine::next_event`]
//! until there are none, then the next input or, at [`Engine::wake_ns`], [`Engine::advance`].

mod decoded;
pub(crate) mod line;
pub(crate) mod localize;
pub(crate) mod mount_check;
pub(crate) mod options;
pub(crate) mod out;
pub(crate) mod scan_data;
pub(crate) mod schedule;
#[cfg(test)]
pub(crate) mod synthetic;
#[cfg(test)]
pub(crate) mod tests;

use biplane_recording::{Direction, Port, Rig, Topic};

use crate::engine::line::decoded::WithoutLine;
use crate::engine::line::devices::Devices;
use crate::engine::line::monotonic::Stream;
use crate::engine::localize::odometry_history::OdometrySample;
use crate::engine::localize::pending_scans::WAIT_OF_LINES_NS;
use crate::engine::localize::posing::Posing;
use crate::engine::localize::tracker_inputs::KeptScans;
use crate::engine::options::{Command, EngineOptions};
use crate::engine::out::publisher::Publisher;
use crate::engine::out::report::{account, state};
use crate::engine::out::sink::Sink;
use crate::engine::scan_data::ScanData;
use crate::engine::schedule::{HOLE_NS, Schedule, bounded};
use crate::session::base::reading::OdometryReading;
use crate::session::device_session::{Input, MAX_INPUT_BYTES, Output};
use crate::session::event::Event;
use crate::session::inertial::reading::InertialReading;
use crate::session::lms::scan::ranges::ScanReading;
use crate::types::run_report::RunReport;

/// What a base was due so long ago may come too late for its watchdog (2 s), nanoseconds.
const WATCHDOG_MISSED_NS: i64 = 800_000_000;

/// The onboard process without its threads and ports.
#[derive(Debug)]
pub struct Engine<S> {
    rig: Rig,
    /// Whether the bytes of the lines are recorded too.
    raw: bool,
    publisher: Publisher<S>,
    devices: Devices,
    without_line: WithoutLine,
    posing: Posing,
    schedule: Schedule,
}

impl<S: Sink> Engine<S> {
    /// An engine whose sessions begin at `now_ns`.
    #[must_use]
    pub fn new(options: &EngineOptions, sink: S, now_ns: i64) -> Self {
        let now_ns = bounded(now_ns);
        let EngineOptions { rig, matcher, feed, raw } = options;
        let mut engine = Self {
            rig: rig.clone(),
            raw: *raw,
            publisher: Publisher::new(sink),
            devices: Devices::new(rig, *feed, now_ns),
            without_line: WithoutLine::default(),
            posing: Posing::new(rig, *matcher),
            schedule: Schedule::new(*feed, now_ns),
        };
        engine.publisher.static_frames(now_ns, rig);
        for port in Port::ALL {
            engine.drain(now_ns, port);
        }
        engine
    }

    /// Bytes that a read of a line returned at `read_ns`. Reads of different lines may overtake each other by
    /// a little: stamps follow from the read's own time, everything else from the engine's. In a recording, a
    /// line whose time steps back is that of a clock that was set: the run's time goes on.
    pub fn bytes(&mut self, read_ns: i64, port: Port, bytes: &[u8]) {
        let unheard_ns = self.devices.watch.read_watermark.unheard_ns(port, read_ns);
        self.recorded_bytes(read_ns, unheard_ns, port, bytes);
    }

    /// The same in a recording that is replayed, which knows for how long nobody had listened to the line
    /// when the read returned.
    pub fn recorded_bytes(&mut self, read_ns: i64, unheard_ns: i64, port: Port, bytes: &[u8]) {
        let stream = Stream { port, direction: Direction::Rx };
        let read_ns = self.schedule.time_line.run_ns(stream, bounded(read_ns));
        let now_ns = self.begin(read_ns);
        if self.raw {
            self.publisher.serial(read_ns, read_ns - unheard_ns, port, Direction::Rx, bytes);
        }
        if !self.devices.lines.has(port) {
            self.without_line.unknown_read(port);
            return;
        }
        self.devices.lines.arrived(port, read_ns, bytes.len(), unheard_ns);
        for piece in bytes.chunks(MAX_INPUT_BYTES) {
            self.input(now_ns, port, Input::Bytes(piece));
        }
        self.devices.listen_for_foreign_devices(now_ns, port, bytes);
        self.settle(now_ns);
    }

    /// What a host once sent on a line, in a recording that is replayed: some answers only mean something
    /// with their question, and a telegram that a request has cut is not damaged.
    pub fn host_sent(&mut self, sent_ns: i64, port: Port, bytes: &[u8]) {
        let stream = Stream { port, direction: Direction::Tx };
        let sent_ns = self.schedule.time_line.run_ns(stream, bounded(sent_ns));
        let now_ns = self.begin(sent_ns);
        self.devices.lines.host_sent(port, now_ns, bytes);
    }

    /// The port of a line has gone. Its session stands still until [`Engine::port_back`]: nobody would hear
    /// it.
    pub fn port_lost(&mut self, now_ns: i64, port: Port) {
        self.begin(now_ns);
        self.devices.event(port, Event::PortLost);
    }

    /// The port of a line does not run at the rate that a command asked for.
    pub fn rate_refused(&mut self, now_ns: i64, port: Port, baud: u32) {
        let now_ns = self.begin(now_ns);
        self.input(now_ns, port, Input::RateRefused(baud));
    }

    /// The port of a line is there again. Its session sets its rate, and listens first whether the device
    /// still streams.
    pub fn port_back(&mut self, now_ns: i64, port: Port) {
        let now_ns = self.begin(now_ns);
        self.devices.event(port, Event::PortBack);
        self.input(now_ns, port, Input::PortBack);
        self.settle(now_ns);
    }

    /// Everything that came on a line until `up_to_ns` has been given to [`Engine::bytes`]: said before a
    /// read, how old its bytes may be. What is due later on this line waits for the next such word. A line of
    /// which this is never said is always listened to.
    pub fn read_watermark(&mut self, port: Port, up_to_ns: i64) {
        self.devices.watch.read_watermark.listened(port, up_to_ns);
    }

    /// Time has come to `now_ns`: whatever was due until then happens, each at its own time.
    pub fn advance(&mut self, now_ns: i64) {
        let now_ns = bounded(now_ns).max(self.schedule.now_ns);
        if now_ns.saturating_sub(self.schedule.health_ns()) > HOLE_NS {
            self.health(now_ns);
        }
        if now_ns.saturating_sub(self.devices.wait_ns(Port::Base)) >= WATCHDOG_MISSED_NS {
            self.devices.lines.base.session.watchdog_missed();
        }
        let hole_end_ns = now_ns.saturating_sub(HOLE_NS);
        loop {
            let wake_ns = self.wake_ns();
            if wake_ns > now_ns {
                break;
            }
            self.tick(wake_ns.max(self.schedule.now_ns).max(hole_end_ns));
        }
        self.schedule.now_ns = now_ns;
    }

    /// When something is due without further input; `i64::MAX` for never.
    #[must_use]
    pub fn wake_ns(&self) -> i64 {
        let others_ns = [self.posing.deadline_ns(), self.schedule.health_ns()];
        let lines_ns = Port::ALL.into_iter().map(|port| self.devices.wait_ns(port));
        lines_ns.chain(others_ns).min().unwrap_or(i64::MAX)
    }

    /// Leaves the devices idle; [`Engine::is_stopped`] tells when they are.
    pub fn stop(&mut self, now_ns: i64) {
        let now_ns = self.begin(now_ns);
        // The last state is that of the run, not of devices at rest.
        self.last_health(now_ns);
        self.schedule.end_health();
        for port in Port::ALL {
            if !self.devices.is_lost(port) {
                self.input(now_ns, port, Input::Stop);
            }
        }
    }

    /// Whether all sessions are done that have a port.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.devices.is_stopped()
    }

    /// The devices that were told to stop, or could not be told, and of which nobody knows whether they did.
    pub fn unstopped(&self) -> impl Iterator<Item = Port> {
        Port::ALL.into_iter().filter(|&port| !self.devices.lines.is_done(port))
    }

    /// The input ends: everything that waits goes on with what is known. Returns the account and the sink.
    pub fn finish(mut self, now_ns: i64) -> (RunReport, S) {
        let now_ns = self.begin(now_ns);
        self.devices.lines.finish();
        for port in Port::ALL {
            self.drain(now_ns, port);
        }
        self.posing.finish(&mut self.publisher, now_ns);
        if self.schedule.health_ns() != i64::MAX {
            self.last_health(now_ns);
        }
        (self.report(), self.publisher.into_sink())
    }

    /// The next thing to do on a serial line.
    pub fn next_command(&mut self) -> Option<(Port, Command)> {
        self.devices.outbox.next_command()
    }

    /// The next thing that a session has said.
    pub fn next_event(&mut self) -> Option<(Port, Event)> {
        self.devices.outbox.next_event()
    }

    /// The sink.
    pub fn sink(&mut self) -> &mut S {
        self.publisher.sink()
    }

    /// Gives the sink from here on the iterations of every match.
    pub fn keep_journal(&mut self) {
        self.posing.localizer.keep_journal();
    }

    /// Keeps from here on what the tracker is given, in memory without a bound: for files, not for live runs.
    pub fn keep_scans(&mut self) {
        self.posing.localizer.keep_scans();
    }

    /// What was kept so far.
    pub fn take_kept_scans(&mut self) -> KeptScans {
        self.posing.localizer.take_kept_scans()
    }

    /// Whether all lasers of the rig stream.
    #[must_use]
    pub fn is_streaming(&self) -> bool {
        self.devices.lines.lasers_stream()
    }

    /// Whether a laser may be at work on its EEPROM, which takes up to 15 s: whoever stops waits that long.
    #[must_use]
    pub fn is_writing(&self) -> bool {
        self.devices.lines.is_writing()
    }

    /// Every input begins here: what was due before it happens first. Time does not step back.
    fn begin(&mut self, now_ns: i64) -> i64 {
        self.advance(now_ns);
        self.schedule.now_ns
    }

    fn tick(&mut self, now_ns: i64) {
        self.schedule.now_ns = now_ns;
        for port in Port::ALL {
            if self.devices.wait_ns(port) <= now_ns {
                self.input(now_ns, port, Input::Time);
            }
        }
        self.settle(now_ns);
        if self.schedule.health_ns() <= now_ns {
            self.health(now_ns);
        }
    }

    fn input(&mut self, now_ns: i64, port: Port, input: Input<'_>) {
        self.devices.handle(now_ns, port, input);
        self.drain(now_ns, port);
    }

    fn drain(&mut self, now_ns: i64, port: Port) {
        loop {
            match self.devices.lines.poll(port) {
                Output::WaitUntil(_) => return,
                Output::Write(bytes) => self.command(now_ns, port, Command::Write(bytes)),
                Output::SetBaud(baud) => self.command(now_ns, port, Command::SetBaud(baud)),
                Output::Event(event) => self.devices.event(port, event),
                Output::Reconnect => self.command(now_ns, port, Command::Reconnect),
                Output::TimedScan => self.timed_scan(now_ns, port),
                Output::Scan(reading) => self.scan(now_ns, port, &reading),
                Output::Odometry(reading) => self.odometry(now_ns, &reading),
                Output::Inertial(reading) => self.inertial(now_ns, &reading),
            }
        }
    }

    fn command(&mut self, now_ns: i64, port: Port, command: Command) {
        if let Command::Write(bytes) = &command {
            self.devices.watch.foreign_device(port).sent(bytes);
            if self.raw {
                self.publisher.serial(now_ns, now_ns, port, Direction::Tx, bytes);
            }
        }
        self.devices.outbox.command(port, command);
    }

    fn scan(&mut self, now_ns: i64, port: Port, reading: &ScanReading) {
        self.devices.watch.foreign_device(port).measured();
        let Some(laser) = self.devices.lines.laser_mut(port) else { return };
        let data = laser.stamped(now_ns, reading);
        self.publisher.scan(now_ns, Topic::scan_of(port), &data, &reading.intensities);
        self.take_scan(now_ns, Topic::scan_of(port), data, WAIT_OF_LINES_NS);
    }

    /// The scan that the session of a laser with a clock holds.
    fn timed_scan(&mut self, now_ns: i64, port: Port) {
        let Some(laser) = self.devices.lines.laser_mut(port) else { return };
        let Some((data, remissions)) = laser.stamped_by_device(now_ns) else { return };
        self.publisher.scan(now_ns, Topic::scan_of(port), &data, remissions);
        self.take_scan(now_ns, Topic::scan_of(port), data, WAIT_OF_LINES_NS);
    }

    /// A scan, posed as soon as odometry covers it, and after `wait_ns` without.
    fn take_scan(&mut self, now_ns: i64, topic: Topic, data: ScanData, wait_ns: i64) {
        if topic == Topic::ScanVertical {
            self.posing.take_vertical(&mut self.publisher, now_ns, &data);
        } else {
            self.posing.take_scan(&mut self.publisher, now_ns, data, now_ns.saturating_add(wait_ns));
        }
    }

    fn odometry(&mut self, now_ns: i64, reading: &OdometryReading) {
        self.devices.watch.foreign_device(Port::Base).measured();
        let stamp_ns = self.devices.lines.base.stamp_ns(now_ns, reading);
        let sample = OdometrySample { stamp_ns, odom_from_base: reading.odom_from_base };
        self.posing.take_odometry(now_ns, sample);
        let twist_in_base = self.posing.odometry.twist_at(stamp_ns);
        self.publisher.odometry(now_ns, stamp_ns, &reading.odom_from_base, twist_in_base);
    }

    /// A sample of the rig's inertial unit: the matcher makes no use of it, what refines poses later does.
    fn inertial(&mut self, now_ns: i64, reading: &InertialReading) {
        self.devices.watch.foreign_device(Port::Imu).measured();
        let Some(unit) = self.devices.lines.imu.as_deref_mut() else { return };
        let stamp_ns = unit.stamp_ns(now_ns, reading);
        self.publisher.inertial(now_ns, stamp_ns, reading);
    }

    /// Lets go on whatever has what it waited for.
    fn settle(&mut self, now_ns: i64) {
        self.posing.settle(&mut self.publisher, now_ns);
    }

    /// Publishes the state.
    fn health(&mut self, now_ns: i64) {
        let interval_s = self.schedule.health_reported(now_ns);
        let mut health = state(&mut self.devices, &mut self.posing, &mut self.without_line, interval_s);
        health.clock_steps = self.schedule.time_line.steps();
        health.dropped += self.publisher.sink().dropped();
        health.unreported += self.publisher.sink().unreported();
        self.publisher.health(now_ns, &health);
    }

    /// The state at the end, unless one was told a moment ago.
    fn last_health(&mut self, now_ns: i64) {
        if self.schedule.wants_last_health(now_ns) {
            self.health(now_ns);
        }
    }

    /// The account so far.
    fn report(&mut self) -> RunReport {
        let mut report = account(&self.devices, &mut self.posing, &self.without_line);
        report.duration_s = self.schedule.duration_s();
        report.arrival.clock_steps = self.schedule.time_line.steps();
        report.losses.dropped += self.publisher.sink().dropped();
        report.losses.unreported += self.publisher.sink().unreported();
        report.losses.lost += self.publisher.sink().dropped();
        report
    }
}
