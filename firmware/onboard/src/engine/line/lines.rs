//! The serial lines of a rig, by their ports.

use biplane_recording::rig::Laser;
use biplane_recording::{Port, Rig};
use biplane_wire::Counts;

use crate::engine::line::inertial_line::InertialLine;
use crate::engine::line::laser_device::LaserDevice;
use crate::engine::line::{LaserLine, Line};
use crate::engine::options::Feed;
use crate::engine::out::health::LineHealth;
use crate::session::base::{BaseSession, BaseSettings};
use crate::session::device_session::{Input, Output, Session};
use crate::session::event::Event;

/// The lines of a rig. What is asked of a line that the rig does not have is answered as by one on which
/// nothing ever happens.
#[derive(Debug)]
pub(crate) struct Lines {
    /// Of the laser that localizes.
    /// Boxed: a session holds its queues in itself, and an engine is moved about by its value.
    pub(crate) horizontal: Box<LaserLine>,
    /// Of the laser that sees the building, where there is one.
    pub(crate) vertical: Option<Box<LaserLine>>,
    /// Of the base; of one that is not there, nothing comes.
    pub(crate) base: Box<Line<BaseSession>>,
    has_base: bool,
    /// Of the inertial unit, where there is one on a line.
    pub(crate) imu: Option<Box<InertialLine>>,
}

impl Lines {
    /// The lines of this rig, whose sessions begin at `now_ns`.
    pub(crate) fn new(rig: &Rig, feed: Feed, now_ns: i64) -> Self {
        let make_base: fn(BaseSettings, i64) -> BaseSession = match feed {
            Feed::Live => BaseSession::streaming,
            Feed::Recorded => BaseSession::listening,
        };
        let imu = rig.imu.as_ref().filter(|unit| unit.is_serial());
        let laser = |laser: &Laser| Box::new(LaserLine::new(LaserDevice::new(laser, feed, now_ns), laser));
        Self {
            horizontal: laser(&rig.horizontal),
            vertical: rig.vertical.as_ref().map(laser),
            base: Box::new(Line::of_base(make_base(BaseSettings::from(&rig.base), now_ns), &rig.base)),
            has_base: rig.base.is_present(),
            imu: imu.map(|unit| Box::new(InertialLine::new(unit, feed, now_ns))),
        }
    }

    /// The line of a laser.
    pub(crate) fn laser_mut(&mut self, port: Port) -> Option<&mut LaserLine> {
        match port {
            Port::Horizontal => Some(&mut self.horizontal),
            Port::Vertical => self.vertical.as_deref_mut(),
            Port::Base | Port::Imu => None,
        }
    }

    /// The lines of all lasers.
    pub(crate) fn lasers(&self) -> impl Iterator<Item = &Line<LaserDevice>> {
        [Some(&*self.horizontal), self.vertical.as_deref()].into_iter().flatten().map(|laser| &laser.line)
    }

    /// From a device's first measurement to its last, nanoseconds.
    pub(crate) fn span_ns(&self, port: Port) -> Option<(i64, i64)> {
        match port {
            Port::Horizontal => self.horizontal.line.meter.span_ns(),
            Port::Vertical => self.vertical.as_ref()?.line.meter.span_ns(),
            Port::Base => self.base.meter.span_ns(),
            Port::Imu => self.imu.as_ref()?.line.meter.span_ns(),
        }
    }

    fn session(&self, port: Port) -> Option<&dyn Session> {
        Some(match port {
            Port::Horizontal => &self.horizontal.line.session,
            Port::Vertical => &self.vertical.as_ref()?.line.session,
            Port::Base => Some(&self.base.session).filter(|_| self.has_base)?,
            Port::Imu => &self.imu.as_ref()?.line.session,
        })
    }

    fn session_mut(&mut self, port: Port) -> Option<&mut dyn Session> {
        Some(match port {
            Port::Horizontal => &mut self.horizontal.line.session,
            Port::Vertical => &mut self.vertical.as_mut()?.line.session,
            Port::Base => Some(&mut self.base.session).filter(|_| self.has_base)?,
            Port::Imu => &mut self.imu.as_mut()?.line.session,
        })
    }

    /// Whether the rig has such a line.
    pub(crate) fn has(&self, port: Port) -> bool {
        self.session(port).is_some()
    }

    /// A read of a line has returned, so long after the line was listened to last.
    pub(crate) fn arrived(&mut self, port: Port, read_ns: i64, count: usize, unheard_ns: i64) {
        match port {
            Port::Base => self.base.arrived(read_ns, count, unheard_ns),
            Port::Imu => {
                if let Some(unit) = &mut self.imu {
                    unit.line.arrived(read_ns, count, unheard_ns);
                }
            }
            Port::Horizontal | Port::Vertical => {
                if let Some(laser) = self.laser_mut(port) {
                    laser.line.arrived(read_ns, count, unheard_ns);
                }
            }
        }
    }

    /// Something happened to a session.
    pub(crate) fn handle(&mut self, port: Port, now_ns: i64, input: Input<'_>) {
        if let Some(session) = self.session_mut(port) {
            session.handle(now_ns, input);
        }
    }

    /// What a session wants done.
    pub(crate) fn poll(&mut self, port: Port) -> Output {
        let output = match port {
            Port::Base => Some(self.base.poll()),
            Port::Imu => self.imu.as_mut().map(|unit| unit.line.poll()),
            Port::Horizontal | Port::Vertical => self.laser_mut(port).map(|laser| laser.line.poll()),
        };
        output.unwrap_or(Output::WaitUntil(i64::MAX))
    }

    /// When a session wants to be asked again.
    pub(crate) fn wait_ns(&self, port: Port) -> i64 {
        match port {
            Port::Horizontal => self.horizontal.line.wait_ns(),
            Port::Vertical => self.vertical.as_ref().map_or(i64::MAX, |vertical| vertical.line.wait_ns()),
            Port::Base => self.base.wait_ns(),
            Port::Imu => self.imu.as_ref().map_or(i64::MAX, |unit| unit.line.wait_ns()),
        }
    }

    /// A session has said something.
    pub(crate) fn note(&mut self, port: Port, event: &Event) {
        match port {
            Port::Base => self.base.note(event),
            Port::Imu => {
                if let Some(unit) = &mut self.imu {
                    unit.line.note(event);
                }
            }
            Port::Horizontal | Port::Vertical => {
                if let Some(laser) = self.laser_mut(port) {
                    laser.line.note(event);
                }
            }
        }
    }

    /// In a recording: what the host once sent on a line.
    pub(crate) fn host_sent(&mut self, port: Port, now_ns: i64, bytes: &[u8]) {
        match self.laser_mut(port) {
            Some(laser) => laser.line.session.host_sent(now_ns),
            None if port == Port::Base => self.base.session.host_sent(now_ns, bytes),
            None => {}
        }
    }

    /// The input ends: what is held of unfinished telegrams is let go.
    pub(crate) fn finish(&mut self) {
        self.horizontal.line.session.finish();
        if let Some(vertical) = &mut self.vertical {
            vertical.line.session.finish();
        }
        self.base.session.finish();
        if let Some(unit) = &mut self.imu {
            unit.line.session.finish();
        }
    }

    /// Whether a session has nothing left to do.
    pub(crate) fn is_done(&self, port: Port) -> bool {
        self.session(port).is_none_or(Session::is_done)
    }

    /// Whether all lasers stream.
    pub(crate) fn lasers_stream(&self) -> bool {
        self.lasers().all(|line| line.session.is_streaming())
    }

    /// Whether a laser may be at work on its EEPROM.
    pub(crate) fn is_writing(&self) -> bool {
        self.lasers().any(|line| line.session.is_writing())
    }

    /// The account of the bytes of a line.
    pub(crate) fn counts(&self, port: Port) -> Option<Counts> {
        self.session(port).map(Session::counts)
    }

    /// Outputs of sessions that nobody polled in time.
    pub(crate) fn overflowed(&self) -> u64 {
        Port::ALL.into_iter().filter_map(|port| self.session(port)).map(Session::overflowed).sum()
    }

    /// Stamps of scans that stepped back.
    pub(crate) fn backward_stamps(&self) -> u64 {
        self.lasers().map(|line| line.meter.backward_stamps).sum()
    }

    /// The state of a line in the last interval; the next one begins.
    pub(crate) fn health(&mut self, port: Port, interval_s: f64) -> Option<LineHealth> {
        if port == Port::Imu {
            return self.imu.as_mut().map(|unit| unit.health(interval_s));
        }
        let Some(laser) = self.laser_mut(port) else {
            let session = &self.base.session;
            let (streaming, metres_per_tick) = (session.is_streaming(), session.metres_per_tick());
            let is_there = self.has(port);
            let line = is_there.then(|| self.base.health(interval_s, streaming));
            return line.map(|line| LineHealth { metres_per_tick, ..line });
        };
        let odd_interval_ms = laser.odd_interval_ms();
        let line = &mut laser.line;
        let streaming = line.session.is_streaming();
        let laser = Some(*line.session.health());
        Some(LineHealth { laser, odd_interval_ms, ..line.health(interval_s, streaming) })
    }
}
