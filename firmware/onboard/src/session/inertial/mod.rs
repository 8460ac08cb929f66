//! The session of an inertial unit of Xsens (MTi) on a serial line: out of whatever state it was left in,
//! tell it what to send, let it measure, notice when it stops, begin again.
//!
//! ```text
//! line -> config state -> who is it -> outputs -> measuring state
//! measuring state -> line: silence, a wake-up
//! ```
//! A measurement that arrives whole is taken in every state: a unit measures by itself when it is switched
//! on. Its axes are its own, its times those of its clock; what they are on the host's follows in the engine.
//! Sources: as those of [`biplane_wire::xsens`]. Never tried on hardware.

pub(crate) mod clock;
pub(crate) mod event;
pub(crate) mod health;
pub(crate) mod machine;
mod query;
pub(crate) mod reading;
mod samples;
#[cfg(test)]
mod tests;

use biplane_recording::rig::InertialUnit;
use biplane_wire::Counts;

use crate::session::base::driver::{BaseDriver, Purpose};
use crate::session::base::packets::PacketSession;
use crate::session::base::reading::BaseInfo;
use crate::session::device_session::{Input, Output, Session};
use crate::session::inertial::health::InertialHealth;
use crate::session::inertial::machine::Machine;

/// A session with one unit: it speaks in packets, as bases do.
#[derive(Debug)]
pub(crate) struct InertialSession(PacketSession<Machine>);

impl InertialSession {
    /// A session that brings the unit to measure.
    #[must_use]
    pub(crate) fn streaming(unit: &InertialUnit, now_ns: i64) -> Self {
        Self::new(unit, Purpose::Stream, now_ns)
    }

    /// A session that asks the unit who it is, and is done. Its measuring is stopped.
    #[must_use]
    pub(crate) fn probing(unit: &InertialUnit, now_ns: i64) -> Self {
        Self::new(unit, Purpose::Probe, now_ns)
    }

    /// A session that only listens to what once came from a unit.
    #[must_use]
    pub(crate) fn listening(unit: &InertialUnit, now_ns: i64) -> Self {
        Self::new(unit, Purpose::Listen, now_ns)
    }

    fn new(unit: &InertialUnit, purpose: Purpose, now_ns: i64) -> Self {
        Self(PacketSession::new(Machine::new(unit.baud, unit.rate_hz, purpose, now_ns), purpose))
    }

    /// What is known of the unit.
    #[must_use]
    pub(crate) fn info(&self) -> &BaseInfo {
        self.0.info()
    }

    /// What the session has seen of it.
    #[must_use]
    pub(crate) fn health(&self) -> &InertialHealth {
        self.0.machine().health()
    }

    /// Intact messages that could not be read, or lacked what a sample needs.
    #[must_use]
    pub(crate) fn not_kept(&self) -> u64 {
        self.0.not_kept() + self.health().not_kept
    }

    /// Whether samples flow.
    #[must_use]
    pub(crate) fn is_streaming(&self) -> bool {
        self.0.is_streaming()
    }

    /// The input ends: what is held of an unfinished message is let go. Drain [`Session::poll`] afterwards.
    pub(crate) fn finish(&mut self) {
        self.0.finish();
    }
}

impl Session for InertialSession {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.0.handle(now_ns, input);
    }

    fn poll(&mut self) -> Output {
        self.0.poll()
    }

    fn is_done(&self) -> bool {
        self.0.is_done()
    }

    fn baud(&self) -> u32 {
        self.0.baud()
    }

    fn counts(&self) -> Counts {
        self.0.counts()
    }

    fn overflowed(&self) -> u64 {
        self.0.overflowed()
    }
}
