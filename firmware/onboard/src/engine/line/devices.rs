//! The lines with what is watched on them, and what waits there for the driver of the engine.

use biplane_recording::{Port, Rig};

use crate::engine::line::LaserLine;
use crate::engine::line::decoded::with_decoded;
use crate::engine::line::inertial_line::InertialLine;
use crate::engine::line::lines::Lines;
use crate::engine::line::watch::LineWatch;
use crate::engine::options::Feed;
use crate::engine::out::health::LineHealth;
use crate::engine::out::outbox::Outbox;
use crate::session::device_session::Input;
use crate::session::event::Event;

/// The devices of a rig, behind their lines.
#[derive(Debug)]
pub(crate) struct Devices {
    pub(crate) lines: Lines,
    pub(crate) watch: LineWatch,
    pub(crate) outbox: Outbox,
}

impl Devices {
    /// Those of this rig, whose sessions begin at `now_ns`.
    pub(crate) fn new(rig: &Rig, feed: Feed, now_ns: i64) -> Self {
        Self { lines: Lines::new(rig, feed, now_ns), watch: LineWatch::new(rig), outbox: Outbox::default() }
    }

    /// When a session wants to be asked again; one without a port does not, and not before it is known what
    /// came until then.
    pub(crate) fn wait_ns(&self, port: Port) -> i64 {
        let wait_ns = if self.is_lost(port) { i64::MAX } else { self.lines.wait_ns(port) };
        if self.watch.read_watermark.is_due(port, wait_ns) { wait_ns } else { i64::MAX }
    }

    /// Something happened to a session.
    pub(crate) fn handle(&mut self, now_ns: i64, port: Port, input: Input<'_>) {
        let session_ns = self.watch.read_watermark.session_ns(now_ns, port, &input);
        self.lines.handle(port, session_ns, input);
    }

    /// A session, or what is watched on its line, has said something.
    pub(crate) fn event(&mut self, port: Port, event: Event) {
        self.lines.note(port, &event);
        if self.watch.faults.note(port, &event) {
            self.outbox.event(port, event);
        }
    }

    /// Bytes that a session has had: says so when another device speaks.
    pub(crate) fn listen_for_foreign_devices(&mut self, now_ns: i64, port: Port, bytes: &[u8]) {
        // A connection leads to one device, and nobody else speaks on it. Who listens here knows no SCIP.
        if self.lines.laser_mut(port).is_some_and(|laser| laser.line.session.states_its_time()) {
            return;
        }
        let Some(counts) = self.lines.counts(port) else { return };
        if let Some(foreign_protocol) = self.watch.foreign_device(port).hear(now_ns, counts.frames, bytes) {
            self.event(port, Event::ForeignDevice(foreign_protocol));
        }
    }

    /// Whether a port is gone.
    pub(crate) fn is_lost(&self, port: Port) -> bool {
        self.watch.faults.is_lost(port)
    }

    /// Whether all sessions are done that have a port.
    pub(crate) fn is_stopped(&self) -> bool {
        Port::ALL.into_iter().all(|port| self.is_lost(port) || self.lines.is_done(port))
    }

    /// The state of a line, with its damage, which is said when it begins or ends.
    pub(crate) fn state(&mut self, port: Port, interval_s: f64) -> Option<LineHealth> {
        let line = self.lines.health(port, interval_s)?;
        let (line, event) = self.watch.damage(port).judge(line);
        let odd = self.lines.laser_mut(port).and_then(LaserLine::interval_news);
        let restart = match port {
            Port::Imu => self.lines.imu.as_deref_mut().and_then(InertialLine::restart_news),
            _ => self.lines.laser_mut(port).and_then(LaserLine::restart_news),
        };
        for event in [event, odd, restart].into_iter().flatten() {
            self.event(port, event);
        }
        Some(line)
    }

    /// The state of a line with what came decoded, and its fault.
    pub(crate) fn reported(
        &mut self,
        port: Port,
        line: Option<LineHealth>,
        decoded: &LineHealth,
    ) -> LineHealth {
        line.map(|line| self.watch.faults.reported(port, with_decoded(line, decoded))).unwrap_or_default()
    }

    /// Commands and outputs that a full queue has dropped.
    pub(crate) fn dropped(&self) -> u64 {
        self.outbox.commands_dropped + self.lines.overflowed()
    }
}
