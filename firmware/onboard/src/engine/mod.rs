//! The core that `record` and `replay` share: bytes with their times in, posed scans out. No I/O, no clock.
//!
//! ```text
//! bytes of three lines -> sessions -> scans with stamps -> wait for odometry -> tracker -> /pose, /tf
//!                                          |                                       |
//!                                          +--> /scan/... at once                  +-> poses of the vertical scans
//! ```
//! Inputs carry the host's time in nanoseconds; the engine never asks for it. Outputs leave in an order that depends on the inputs
//! alone. Whoever drives it: one input, then [`Engine::next_command`] and [`Engine::next_event`] until there are
//! none, then the next input or, at [`Engine::wake_ns`], [`Engine::advance`].

mod account;
mod beams;
mod line;
mod localise;
mod poses;
mod scan_data;
#[cfg(test)]
pub(crate) mod synthetic;
mod waiting;

use biplane_matcher::{Method, Pose2};
use biplane_recording::msg::{LaserScan, Odometry};
use biplane_recording::{Direction, Port, Rig, Topic, rig};

pub use scan_data::{MAX_BEAMS, ScanData};

use crate::odometry::{OdometryBuffer, OdometrySample};
use crate::publish::Publisher;
use crate::report::RunReport;
use crate::session::base::{BaseSession, BaseSettings, OdometryReading};
use crate::session::laser::{LaserSession, LaserSettings, ScanReading};
use crate::session::{Event, Input, MAX_INPUT_BYTES, Output, RequestBytes, Session};
use crate::sink::Sink;
use line::{LaserLine, Line, Meter};
use localise::Localiser;
use waiting::WaitingStamps;

/// Commands and events that may wait for the driver; more than one input leads to.
const QUEUE_CAPACITY: usize = 128;
/// Diagnostics interval, nanoseconds.
const HEALTH_NS: i64 = 1_000_000_000;
/// A hole in time longer than this is not lived through step by step: what was due in it happens at its end.
const HOLE_NS: i64 = 10_000_000_000;
/// Times beyond are taken as this one: sums and differences of two stay in range (nanoseconds, year 2116).
const LATEST_NS: i64 = i64::MAX / 2;

/// What the driver of an engine has to do on a serial line.
#[derive(Clone, PartialEq, Debug)]
pub enum Command {
    /// Send these bytes.
    Write(RequestBytes),
    /// Change the port's rate, bits per second.
    SetBaud(u32),
}

/// Whether the engine talks to devices or listens to what they once said.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Feed {
    /// Devices on serial lines.
    Live,
    /// Bytes of a capture, or decoded scans and odometry.
    Recorded,
}

/// What an engine is made for.
#[derive(Clone, PartialEq, Debug)]
pub struct EngineOptions {
    /// The robot.
    pub rig: Rig,
    /// How scans are matched.
    pub matcher: Method,
    /// Where the bytes come from.
    pub feed: Feed,
    /// Whether the bytes of the serial lines are recorded too.
    pub raw: bool,
}

/// The onboard process without its threads and ports.
#[derive(Debug)]
pub struct Engine<S> {
    rig: Rig,
    raw: bool,
    publisher: Publisher<S>,
    horizontal: LaserLine,
    vertical: Option<LaserLine>,
    base: Line<BaseSession>,
    /// Decoded scans and odometry that came without a line.
    decoded: [Meter; 3],
    odometry: OdometryBuffer,
    odometry_ns: Option<i64>,
    localiser: Localiser,
    waiting_verticals: WaitingStamps,
    poses_vertical: u64,
    commands: heapless::Deque<(Port, Command), QUEUE_CAPACITY>,
    events: heapless::Deque<(Port, Event), QUEUE_CAPACITY>,
    first_ns: i64,
    now_ns: i64,
    health_ns: i64,
    last_health_ns: i64,
}

impl<S: Sink> Engine<S> {
    /// An engine whose sessions begin at `now_ns`.
    #[must_use]
    pub fn new(options: &EngineOptions, sink: S, now_ns: i64) -> Self {
        let now_ns = bounded(now_ns);
        let mut engine = Self::at_rest(options, sink, now_ns);
        engine.publisher.static_frames(now_ns, &options.rig);
        for port in Port::ALL {
            engine.drain(now_ns, port);
        }
        engine
    }

    fn at_rest(options: &EngineOptions, sink: S, now_ns: i64) -> Self {
        let make = match options.feed {
            Feed::Live => LaserSession::streaming,
            Feed::Recorded => LaserSession::listening,
        };
        let make_base = match options.feed {
            Feed::Live => BaseSession::streaming,
            Feed::Recorded => BaseSession::listening,
        };
        let laser = |laser: &rig::Laser| LaserLine::new(make(LaserSettings::from(laser), now_ns), laser);
        Self {
            raw: options.raw,
            publisher: Publisher::new(sink),
            horizontal: laser(&options.rig.horizontal),
            vertical: options.rig.vertical.as_ref().map(laser),
            base: Line::new(make_base(BaseSettings::from(&options.rig.base), now_ns)),
            decoded: [Meter::default(); 3],
            odometry: OdometryBuffer::default(),
            odometry_ns: None,
            localiser: Localiser::new(&options.rig.horizontal.mount, options.matcher),
            waiting_verticals: WaitingStamps::default(),
            poses_vertical: 0,
            commands: heapless::Deque::new(),
            events: heapless::Deque::new(),
            first_ns: now_ns,
            now_ns,
            health_ns: now_ns.saturating_add(HEALTH_NS),
            last_health_ns: now_ns,
            rig: options.rig.clone(),
        }
    }

    /// Bytes that a read of a line returned at `read_ns`. Reads of different lines may overtake each other by a little: stamps follow
    /// from the read's own time, everything else from the engine's.
    pub fn bytes(&mut self, read_ns: i64, port: Port, bytes: &[u8]) {
        let now_ns = self.begin(read_ns);
        let read_ns = bounded(read_ns);
        if self.raw {
            self.publisher.serial(read_ns, port, Direction::Rx, bytes);
        }
        match port {
            Port::Horizontal => self.horizontal.line.arrived(read_ns, bytes.len()),
            Port::Vertical => match &mut self.vertical {
                Some(vertical) => vertical.line.arrived(read_ns, bytes.len()),
                None => return,
            },
            Port::Base => self.base.arrived(read_ns, bytes.len()),
        }
        for piece in bytes.chunks(MAX_INPUT_BYTES) {
            self.input(now_ns, port, Input::Bytes(piece));
        }
        self.settle(now_ns);
    }

    /// A scan of another recording, decoded.
    pub fn decoded_scan(&mut self, now_ns: i64, port: Port, scan: &LaserScan) {
        let now_ns = self.begin(now_ns);
        let (topic, meter, laser) = match port {
            Port::Vertical => (Topic::ScanVertical, 1, self.rig.vertical.as_ref()),
            _ => (Topic::ScanHorizontal, 0, Some(&self.rig.horizontal)),
        };
        let data = ScanData::of_message(scan, laser);
        if let Some(meter) = self.decoded.get_mut(meter) {
            meter.count(now_ns, data.stamp_ns);
        }
        self.publisher.forward(now_ns, topic, scan.stamp_ns, scan);
        self.take_scan(now_ns, topic, data);
        self.settle(now_ns);
    }

    /// An odometry report of another recording, decoded.
    pub fn decoded_odometry(&mut self, now_ns: i64, odometry: &Odometry) {
        let now_ns = self.begin(now_ns);
        self.decoded[2].count(now_ns, odometry.stamp_ns);
        self.publisher.forward(now_ns, Topic::Odom, odometry.stamp_ns, odometry);
        let [x_m, y_m, _] = odometry.position_m;
        let odom_from_base = Pose2::new(x_m, y_m, heading_rad(odometry.orientation_xyzw));
        self.take_odometry(now_ns, OdometrySample { stamp_ns: odometry.stamp_ns, odom_from_base });
        self.settle(now_ns);
    }

    /// Time has come to `now_ns`: whatever was due until then happens, each at its own time.
    pub fn advance(&mut self, now_ns: i64) {
        let now_ns = bounded(now_ns).max(self.now_ns);
        if now_ns.saturating_sub(self.health_ns) > HOLE_NS {
            self.health(now_ns);
        }
        let hole_end_ns = now_ns.saturating_sub(HOLE_NS);
        loop {
            let wake_ns = self.wake_ns();
            if wake_ns > now_ns {
                break;
            }
            self.tick(wake_ns.max(self.now_ns).max(hole_end_ns));
        }
        self.now_ns = now_ns;
    }

    /// When something is due without further input; `i64::MAX` for never.
    #[must_use]
    pub fn wake_ns(&self) -> i64 {
        let lasers = [Some(&self.horizontal), self.vertical.as_ref()];
        let lasers_ns = lasers.into_iter().flatten().map(|laser| laser.line.wait_ns());
        lasers_ns
            .chain([self.base.wait_ns(), self.localiser.deadline_ns(), self.health_ns])
            .chain([self.waiting_verticals.deadline_ns()])
            .min()
            .unwrap_or(i64::MAX)
    }

    /// Leaves the devices idle; [`Engine::is_stopped`] tells when they are.
    pub fn stop(&mut self, now_ns: i64) {
        let now_ns = self.begin(now_ns);
        // The last state is that of the run, not of devices at rest.
        self.last_health(now_ns);
        self.health_ns = i64::MAX;
        for port in Port::ALL {
            self.input(now_ns, port, Input::Stop);
        }
    }

    /// Whether all sessions are done.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.horizontal.line.session.is_done()
            && self.vertical.as_ref().is_none_or(|vertical| vertical.line.session.is_done())
            && self.base.session.is_done()
    }

    /// The input ends: everything that waits goes on with what is known. Returns the account and the sink.
    pub fn finish(mut self, now_ns: i64) -> (RunReport, S) {
        let now_ns = self.begin(now_ns);
        self.horizontal.line.session.finish();
        if let Some(vertical) = &mut self.vertical {
            vertical.line.session.finish();
        }
        self.base.session.finish();
        for port in Port::ALL {
            self.drain(now_ns, port);
        }
        while let Some(scan) = self.localiser.pop_any() {
            self.localise(now_ns, &scan);
        }
        while let Some(stamp_ns) = self.waiting_verticals.pop_any() {
            self.pose_vertical(now_ns, stamp_ns);
        }
        if self.health_ns != i64::MAX {
            self.last_health(now_ns);
        }
        (self.report(), self.publisher.into_sink())
    }

    /// The next thing to do on a serial line.
    pub fn next_command(&mut self) -> Option<(Port, Command)> {
        self.commands.pop_front()
    }

    /// The next thing that a session has said.
    pub fn next_event(&mut self) -> Option<(Port, Event)> {
        self.events.pop_front()
    }

    /// The sink.
    pub fn sink(&mut self) -> &mut S {
        self.publisher.sink()
    }

    /// Whether all devices of the rig stream.
    #[must_use]
    pub fn is_streaming(&self) -> bool {
        self.horizontal.line.session.is_streaming()
            && self.vertical.as_ref().is_none_or(|vertical| vertical.line.session.is_streaming())
    }

    /// Every input begins here: what was due before it happens first. Time does not step back.
    fn begin(&mut self, now_ns: i64) -> i64 {
        self.advance(now_ns);
        self.now_ns
    }

    fn tick(&mut self, now_ns: i64) {
        self.now_ns = now_ns;
        for port in Port::ALL {
            let wait_ns = match port {
                Port::Horizontal => self.horizontal.line.wait_ns(),
                Port::Vertical => self.vertical.as_ref().map_or(i64::MAX, |vertical| vertical.line.wait_ns()),
                Port::Base => self.base.wait_ns(),
            };
            if wait_ns <= now_ns {
                self.input(now_ns, port, Input::Time);
            }
        }
        self.settle(now_ns);
        if self.health_ns <= now_ns {
            self.health(now_ns);
        }
    }

    fn input(&mut self, now_ns: i64, port: Port, input: Input<'_>) {
        match port {
            Port::Horizontal => self.horizontal.line.session.handle(now_ns, input),
            Port::Vertical => match &mut self.vertical {
                Some(vertical) => vertical.line.session.handle(now_ns, input),
                None => return,
            },
            Port::Base => self.base.session.handle(now_ns, input),
        }
        self.drain(now_ns, port);
    }

    fn drain(&mut self, now_ns: i64, port: Port) {
        loop {
            let output = match port {
                Port::Horizontal => self.horizontal.line.poll(),
                Port::Vertical => match &mut self.vertical {
                    Some(vertical) => vertical.line.poll(),
                    None => return,
                },
                Port::Base => self.base.poll(),
            };
            match output {
                Output::WaitUntil(_) => return,
                Output::Write(bytes) => self.command(now_ns, port, Command::Write(bytes)),
                Output::SetBaud(baud) => self.command(now_ns, port, Command::SetBaud(baud)),
                Output::Event(event) => self.event(port, event),
                Output::Scan(reading) => self.scan(now_ns, port, &reading),
                Output::Odometry(reading) => self.odometry(now_ns, &reading),
            }
        }
    }

    fn command(&mut self, now_ns: i64, port: Port, command: Command) {
        if let (true, Command::Write(bytes)) = (self.raw, &command) {
            self.publisher.serial(now_ns, port, Direction::Tx, bytes);
        }
        // A driver that does not fetch commands (a replay) has no line to apply them to.
        let _ = self.commands.push_back((port, command));
    }

    fn event(&mut self, port: Port, event: Event) {
        match port {
            Port::Horizontal => self.horizontal.note(&event),
            Port::Vertical => {
                if let Some(vertical) = &mut self.vertical {
                    vertical.note(&event);
                }
            }
            Port::Base => self.base.meter.note(&event),
        }
        let _ = self.events.push_back((port, event));
    }

    fn scan(&mut self, now_ns: i64, port: Port, reading: &ScanReading) {
        let (topic, data) = match (port, &mut self.vertical) {
            (Port::Vertical, Some(vertical)) => (Topic::ScanVertical, vertical.stamped(now_ns, reading)),
            _ => (Topic::ScanHorizontal, self.horizontal.stamped(now_ns, reading)),
        };
        self.publisher.scan(now_ns, topic, &data);
        self.take_scan(now_ns, topic, data);
    }

    fn take_scan(&mut self, now_ns: i64, topic: Topic, data: ScanData) {
        if topic == Topic::ScanVertical {
            if let Some(oldest_ns) = self.waiting_verticals.push(now_ns, data.stamp_ns) {
                self.pose_vertical(now_ns, oldest_ns);
            }
        } else if let Some(oldest) = self.localiser.push(now_ns, data) {
            self.localise(now_ns, &oldest);
        }
    }

    fn odometry(&mut self, now_ns: i64, reading: &OdometryReading) {
        let stamp_ns = self.base.stamp_ns(now_ns, reading);
        let sample = OdometrySample { stamp_ns, odom_from_base: reading.odom_from_base };
        self.take_odometry(now_ns, sample);
        let twist_in_base = self.odometry.twist_at(stamp_ns);
        self.publisher.odometry(now_ns, stamp_ns, &reading.odom_from_base, twist_in_base);
    }

    fn take_odometry(&mut self, now_ns: i64, sample: OdometrySample) {
        if sample.odom_from_base.is_finite() {
            self.odometry.push(sample);
            self.odometry_ns = Some(now_ns);
        }
    }

    /// Lets go on whatever has what it waited for.
    fn settle(&mut self, now_ns: i64) {
        while let Some(scan) = self.localiser.pop(now_ns, &self.odometry, self.odometry_ns) {
            self.localise(now_ns, &scan);
        }
        while let Some(stamp_ns) = self.waiting_verticals.pop(now_ns, self.localiser.poses()) {
            self.pose_vertical(now_ns, stamp_ns);
        }
    }

    fn localise(&mut self, now_ns: i64, scan: &ScanData) {
        let pose = self.localiser.localise(now_ns, scan, &self.odometry);
        let odom_from_base = pose.odom_from_base.unwrap_or_default();
        let map_from_odom = pose.map_from_base * odom_from_base.inverse();
        self.publisher.pose(now_ns, Topic::Pose, pose.stamp_ns, &pose.map_from_base, &pose.covariance);
        self.publisher.frames(now_ns, pose.stamp_ns, &map_from_odom, &odom_from_base);
    }

    fn pose_vertical(&mut self, now_ns: i64, stamp_ns: i64) {
        // Without any matched pose there is no map yet.
        if let Some((map_from_base, covariance)) = self.localiser.poses().at(stamp_ns, &self.odometry) {
            self.publisher.pose(now_ns, Topic::PoseVertical, stamp_ns, &map_from_base, &covariance);
            self.poses_vertical += 1;
        }
    }
}

fn bounded(time_ns: i64) -> i64 {
    time_ns.clamp(-LATEST_NS, LATEST_NS)
}

/// Heading of a rotation about z; other parts of the rotation are left out.
fn heading_rad([x, y, z, w]: [f64; 4]) -> f64 {
    (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
}

#[cfg(test)]
mod tests;
