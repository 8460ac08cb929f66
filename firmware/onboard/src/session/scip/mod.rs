//! The session of a Hokuyo laser (URG, UTM, UST), on a serial line or on a network: find it in whatever state
//! it was left, ask who it is, let it stream, notice when it stops, begin again.
//!
//! ```text
//! line -> (rate -> stop what runs -> SCIP 2.0, no clock mode) -> who is it -> (rig's rate)? -> stream
//! stream -> line: silence, the connection lost
//! ```
//! A connection is made outside: [`Output::Reconnect`] asks for a new one, [`Input::PortBack`] says that it
//! is there. While scans flow, nothing is asked. Sources: Hokuyo C-42-03320B, byte logs of three devices,
//! complaints of users of other drivers. Never tried on hardware.

pub(crate) mod clock;
mod dialogue;
pub(crate) mod event;
mod geometry;
pub(crate) mod info;
pub(crate) mod machine;
mod query;
mod rates;
pub(crate) mod scan;
pub(crate) mod settings;
#[cfg(test)]
mod tests;

use biplane_wire::Counts;
use biplane_wire::scip::Deframer;

use crate::session::device_session::{Input, Output, Session};
use crate::session::lms::health::LaserHealth;
use crate::session::queues::Intake;
use crate::session::scip::info::ScipInfo;
use crate::session::scip::machine::{Goal, Machine, State};
use crate::session::scip::scan::ScipScan;
use crate::session::scip::settings::ScipSettings;

/// A session with one laser.
#[derive(Debug)]
pub(crate) struct ScipSession {
    intake: Intake,
    deframer: Deframer,
    machine: Machine,
    scan: ScipScan,
}

impl ScipSession {
    /// A session that brings the laser to stream; the connection is there.
    #[must_use]
    pub(crate) fn streaming(settings: ScipSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Stream, now_ns);
        session.machine.begin();
        session
    }

    /// A session that asks the laser what it is, changes nothing, and is done.
    #[must_use]
    pub(crate) fn probing(settings: ScipSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Probe, now_ns);
        session.machine.begin();
        session
    }

    /// A session that only listens to what once came from a laser.
    #[must_use]
    pub(crate) fn listening(settings: ScipSettings, now_ns: i64) -> Self {
        Self::new(settings, Goal::Stream, now_ns)
    }

    fn new(settings: ScipSettings, goal: Goal, now_ns: i64) -> Self {
        Self {
            intake: Intake::default(),
            deframer: Deframer::new(),
            machine: Machine::new(settings, goal, now_ns),
            scan: ScipScan::default(),
        }
    }

    /// What is known of the laser.
    #[must_use]
    pub(crate) fn info(&self) -> &ScipInfo {
        &self.machine.info
    }

    /// What it has seen of its device.
    #[must_use]
    pub(crate) fn health(&self) -> &LaserHealth {
        &self.machine.health
    }

    /// The scan that [`Output::TimedScan`] tells of, until the next one.
    #[must_use]
    pub(crate) fn scan(&self) -> &ScipScan {
        &self.scan
    }

    /// Whether scans flow.
    #[must_use]
    pub(crate) fn is_streaming(&self) -> bool {
        matches!(self.machine.state, State::Streaming | State::Listening)
    }

    /// The input ends: what the deframer still holds is let go. Drain [`Session::poll`] afterwards.
    pub(crate) fn finish(&mut self) {
        self.deframer.finish();
    }

    /// Takes the next piece of the stream; false when there is none.
    fn read_on(&mut self) -> bool {
        if let Some(item) = self.deframer.next() {
            self.machine.item(item, &mut self.scan);
            return true;
        }
        self.intake.hand_on(&mut self.deframer)
    }
}

impl Session for ScipSession {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.machine.now_ns = now_ns;
        match input {
            Input::Bytes(bytes) => {
                self.machine.received(bytes);
                self.intake.take(bytes);
            }
            Input::Time => {}
            Input::RateRefused(baud) => self.machine.rate_refused(baud),
            Input::PortBack => {
                // What the old connection has cut off has no rest.
                self.deframer.abandon();
                self.machine.port_back();
            }
            Input::Stop => self.machine.stop(),
        }
        if !matches!(input, Input::Bytes(_)) {
            self.machine.time();
        }
    }

    /// One piece at a time, so that a scan is taken before the next one comes.
    fn poll(&mut self) -> Output {
        loop {
            if let Some(output) = self.machine.outputs.pop() {
                return output;
            }
            if self.read_on() {
                continue;
            }
            // Only now is it known what came until now.
            self.machine.time();
            if self.machine.outputs.is_empty() {
                return Output::WaitUntil(self.machine.deadline_ns());
            }
        }
    }

    fn is_done(&self) -> bool {
        self.machine.state == State::Done && self.machine.outputs.is_empty()
    }

    fn baud(&self) -> u32 {
        self.machine.baud
    }

    fn counts(&self) -> Counts {
        self.deframer.counts()
    }

    fn overflowed(&self) -> u64 {
        self.machine.outputs.overflowed()
    }
}
