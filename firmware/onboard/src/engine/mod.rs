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
mod damage;
mod decoded;
mod faults;
mod flow;
mod heard;
mod kept;
mod line;
mod localise;
mod port;
mod poses;
mod scan_data;
mod seats;
mod stranger;
#[cfg(test)]
pub(crate) mod synthetic;
mod time_line;
mod waiting;

use biplane_matcher::TrackerParams;
use biplane_recording::{Direction, Port, Rig, rig};

pub use kept::KeptScans;
pub use poses::MatchedPose;
pub use scan_data::{MAX_BEAMS, ScanData};
pub use stranger::Speech;

use crate::mounting::MountWatch;
use crate::odometry::OdometryBuffer;
use crate::publish::Publisher;
use crate::report::RunReport;
use crate::session::base::{BaseSession, BaseSettings};
use crate::session::laser::{LaserSession, LaserSettings};
use crate::session::{Event, Input, MAX_INPUT_BYTES, Output, RequestBytes};
use crate::sink::Sink;
use damage::Damage;
use faults::Faults;
use heard::Heard;
use line::{LaserLine, Line, Meter};
use localise::Localiser;
use stranger::Stranger;
use time_line::TimeLine;
use waiting::WaitingStamps;

/// Commands and events that may wait for the driver; more than one input leads to.
const QUEUE_CAPACITY: usize = 128;
/// Diagnostics interval, nanoseconds.
const HEALTH_NS: i64 = 1_000_000_000;
/// A hole in time longer than this is not lived through step by step: what was due in it happens at its end.
const HOLE_NS: i64 = 10_000_000_000;
/// What a base was due so long ago may come too late for its watchdog (2 s), nanoseconds.
const OVERSLEPT_NS: i64 = 800_000_000;
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
    pub matcher: TrackerParams,
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
    faults: Faults,
    strangers: Box<[Stranger; 3]>,
    damage: [Damage; Port::ALL.len()],
    heard: Heard,
    odometry: OdometryBuffer,
    odometry_ns: Option<i64>,
    localiser: Localiser,
    mounting: MountWatch,
    waiting_verticals: WaitingStamps,
    poses_vertical: u64,
    /// Reads of a line that the rig does not have.
    unknown_reads: u64,
    /// Decoded scans of a laser that the rig does not have.
    unknown_scans: u64,
    commands: heapless::Deque<(Port, Command), QUEUE_CAPACITY>,
    events: heapless::Deque<(Port, Event), QUEUE_CAPACITY>,
    /// Commands that nobody fetched in time.
    commands_dropped: u64,
    /// The same of events.
    untold: u64,
    time_line: TimeLine,
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
            base: Line::of_base(make_base(BaseSettings::from(&options.rig.base), now_ns), &options.rig.base),
            decoded: [Meter::default(); 3],
            faults: Faults::default(),
            strangers: Box::new(Port::ALL.map(|port| Stranger::on(port, &options.rig.base.protocol))),
            damage: Default::default(),
            heard: Heard::default(),
            odometry: OdometryBuffer::default(),
            odometry_ns: None,
            localiser: Localiser::new(&options.rig.horizontal.mount, options.matcher),
            mounting: MountWatch::new(&options.rig),
            waiting_verticals: WaitingStamps::default(),
            poses_vertical: 0,
            unknown_reads: 0,
            unknown_scans: 0,
            commands: heapless::Deque::new(),
            events: heapless::Deque::new(),
            commands_dropped: 0,
            untold: 0,
            time_line: TimeLine::new(options.feed, now_ns),
            first_ns: now_ns,
            now_ns,
            health_ns: now_ns.saturating_add(HEALTH_NS),
            last_health_ns: now_ns,
            rig: options.rig.clone(),
        }
    }

    /// Bytes that a read of a line returned at `read_ns`. Reads of different lines may overtake each other by a little: stamps follow
    /// from the read's own time, everything else from the engine's. In a recording, a line whose time steps back is that of a clock
    /// that was set: the run's time goes on.
    pub fn bytes(&mut self, read_ns: i64, port: Port, bytes: &[u8]) {
        let read_ns = self.time_line.run_ns((port, Direction::Rx), bounded(read_ns));
        let now_ns = self.begin(read_ns);
        if self.raw {
            self.publisher.serial(read_ns, port, Direction::Rx, bytes);
        }
        let unheard_ns = self.heard.unheard_ns(port, read_ns);
        match port {
            Port::Horizontal => self.horizontal.line.arrived(read_ns, bytes.len(), unheard_ns),
            Port::Vertical => match &mut self.vertical {
                Some(vertical) => vertical.line.arrived(read_ns, bytes.len(), unheard_ns),
                None => {
                    self.unknown_reads += 1;
                    return;
                }
            },
            Port::Base => self.base.arrived(read_ns, bytes.len(), unheard_ns),
        }
        for piece in bytes.chunks(MAX_INPUT_BYTES) {
            self.input(now_ns, port, Input::Bytes(piece));
        }
        self.listen_for_strangers(now_ns, port, bytes);
        self.settle(now_ns);
    }

    /// What a host once sent on a line, in a recording that is replayed: some answers only mean something with their question,
    /// and a telegram that a request has cut is not damaged.
    pub fn host_sent(&mut self, sent_ns: i64, port: Port, bytes: &[u8]) {
        let sent_ns = self.time_line.run_ns((port, Direction::Tx), bounded(sent_ns));
        let now_ns = self.begin(sent_ns);
        match (port, &mut self.vertical) {
            (Port::Base, _) => self.base.session.host_sent(now_ns, bytes),
            (Port::Horizontal, _) => self.horizontal.line.session.host_sent(now_ns),
            (Port::Vertical, Some(vertical)) => vertical.line.session.host_sent(now_ns),
            (Port::Vertical, None) => {}
        }
    }

    /// Time has come to `now_ns`: whatever was due until then happens, each at its own time.
    pub fn advance(&mut self, now_ns: i64) {
        let now_ns = bounded(now_ns).max(self.now_ns);
        if now_ns.saturating_sub(self.health_ns) > HOLE_NS {
            self.health(now_ns);
        }
        if now_ns.saturating_sub(self.line_wait_ns(Port::Base)) >= OVERSLEPT_NS {
            self.base.session.overslept();
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
        let others_ns = [self.localiser.deadline_ns(), self.health_ns, self.waiting_verticals.deadline_ns()];
        let lines_ns = Port::ALL.into_iter().map(|port| self.line_wait_ns(port));
        lines_ns.chain(others_ns).min().unwrap_or(i64::MAX)
    }

    /// Leaves the devices idle; [`Engine::is_stopped`] tells when they are.
    pub fn stop(&mut self, now_ns: i64) {
        let now_ns = self.begin(now_ns);
        // The last state is that of the run, not of devices at rest.
        self.last_health(now_ns);
        self.health_ns = i64::MAX;
        for port in Port::ALL {
            if !self.faults.is_lost(port) {
                self.input(now_ns, port, Input::Stop);
            }
        }
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

    /// Keeps from here on what the tracker is given, in memory without a bound: for files, not for live runs.
    pub fn keep_scans(&mut self) {
        self.localiser.keep_scans();
    }

    /// What was kept so far.
    pub fn take_kept_scans(&mut self) -> KeptScans {
        self.localiser.take_kept_scans()
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
            if self.line_wait_ns(port) <= now_ns {
                self.input(now_ns, port, Input::Time);
            }
        }
        self.settle(now_ns);
        if self.health_ns <= now_ns {
            self.health(now_ns);
        }
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
        if let Command::Write(bytes) = &command {
            self.stranger_of(port).sent(bytes);
            if self.raw {
                self.publisher.serial(now_ns, port, Direction::Tx, bytes);
            }
        }
        self.commands_dropped += u64::from(self.commands.push_back((port, command)).is_err());
    }

    fn event(&mut self, port: Port, event: Event) {
        match port {
            Port::Horizontal => self.horizontal.line.note(&event),
            Port::Vertical => {
                if let Some(vertical) = &mut self.vertical {
                    vertical.line.note(&event);
                }
            }
            Port::Base => self.base.note(&event),
        }
        if self.faults.note(port, &event) {
            self.untold += u64::from(self.events.push_back((port, event)).is_err());
        }
    }
}

fn bounded(time_ns: i64) -> i64 {
    time_ns.clamp(-LATEST_NS, LATEST_NS)
}

#[cfg(test)]
mod tests;
