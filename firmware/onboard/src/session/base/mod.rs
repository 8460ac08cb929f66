//! The session of a Pioneer base (PSOS, P2OS, AROS, ARCOS): synchronise, open, keep it alive, read its odometry.
//!
//! ```text
//! SYNC0 -> SYNC1 -> SYNC2 -> OPEN -> running (PULSE every 0.8 s) -> CLOSE
//!   ^  CLOSE first, when packets come instead of an echo     |
//!   +------------------------------ silence -----------------+
//! ```
//! The motors are never enabled: the operator drives. Frame of the odometry: the base's own (`odom`). Units: metres, radians.
//! Source: Pioneer 3 operations manual, and the fact sheet `p2os.md`.

mod machine;
mod odometer;

use biplane_matcher::Pose2;
use biplane_recording::rig;
use biplane_wire::p2os;
use biplane_wire::{Counts, Item};

use super::{Input, Output, Session, ShortText};
use machine::{Machine, State};

/// What the rig says of the base.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct BaseSettings {
    /// Rate of the line, bits per second.
    pub baud: u32,
    /// Length of one unit of the base's position, metres.
    pub metres_per_tick: f64,
}

impl From<&rig::Base> for BaseSettings {
    fn from(base: &rig::Base) -> Self {
        let metres_per_tick = match base.protocol {
            rig::BaseProtocol::P2os { metres_per_tick: Some(metres_per_tick) } => metres_per_tick,
            _ => 0.001,
        };
        Self { baud: base.baud, metres_per_tick }
    }
}

/// One odometry report.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct OdometryReading {
    /// Index of the packet's first byte in the stream.
    pub offset: u64,
    /// Bytes of the packet.
    pub length: usize,
    /// Where the base believes to be; unwrapped, and continued over restarts of the base.
    pub odom_from_base: Pose2,
    /// Battery, volts.
    pub battery_v: f32,
}

/// What a base says of itself.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct BaseInfo {
    /// Name, class and subclass, as it answers SYNC2.
    pub name: ShortText,
    /// Class, usually `Pioneer`.
    pub class: ShortText,
    /// Subclass, for example `p3dx-sh`: picks the parameters.
    pub subclass: ShortText,
}

/// A session with one base.
#[derive(Debug)]
pub struct BaseSession {
    deframer: p2os::Deframer,
    machine: Machine,
}

impl BaseSession {
    /// A session that opens the base and keeps it reporting.
    #[must_use]
    pub fn streaming(settings: BaseSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, false, now_ns);
        session.machine.outputs.push(Output::SetBaud(settings.baud));
        session.machine.enter_sync(0);
        session
    }

    /// A session that asks the base who it is, closes, and is done.
    #[must_use]
    pub fn probing(settings: BaseSettings, now_ns: i64) -> Self {
        let mut session = Self::streaming(settings, now_ns);
        session.machine.probe = true;
        session
    }

    /// A session that only listens to what once came from a base.
    #[must_use]
    pub fn listening(settings: BaseSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, false, now_ns);
        session.machine.state = State::Listening;
        session
    }

    fn new(settings: BaseSettings, probe: bool, now_ns: i64) -> Self {
        let machine = Machine::new(settings, probe, now_ns);
        Self { deframer: p2os::Deframer::new(), machine }
    }

    /// What is known of the base.
    #[must_use]
    pub fn info(&self) -> &BaseInfo {
        &self.machine.info
    }

    /// Intact odometry packets that could not be read.
    #[must_use]
    pub fn not_kept(&self) -> u64 {
        self.machine.not_kept
    }

    /// Whether odometry flows.
    #[must_use]
    pub fn is_streaming(&self) -> bool {
        matches!(self.machine.state, State::Running { .. } | State::Listening)
    }

    /// The input ends: what the deframer still holds is let go. Drain [`Session::poll`] afterwards.
    pub fn finish(&mut self) {
        self.deframer.finish();
        self.drain();
    }

    fn drain(&mut self) {
        while let Some(item) = self.deframer.next() {
            if let Item::Frame { offset, bytes } = item {
                self.machine.frame(offset, bytes);
            }
        }
    }

    fn take_bytes(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let taken = self.deframer.push(bytes);
            bytes = bytes.get(taken..).unwrap_or_default();
            self.drain();
            if taken == 0 {
                break;
            }
        }
    }
}

impl Session for BaseSession {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.machine.now_ns = now_ns;
        match input {
            Input::Bytes(bytes) => self.take_bytes(bytes),
            Input::Time => {}
            Input::Stop => self.machine.stop(),
        }
        self.machine.time();
    }

    fn poll(&mut self) -> Output {
        self.machine.outputs.pop().unwrap_or_else(|| Output::WaitUntil(self.machine.deadline_ns()))
    }

    fn is_done(&self) -> bool {
        self.machine.state == State::Done && self.machine.outputs.is_empty()
    }

    fn baud(&self) -> u32 {
        self.machine.settings.baud
    }

    fn counts(&self) -> Counts {
        self.deframer.counts()
    }
}

#[cfg(test)]
mod tests;
