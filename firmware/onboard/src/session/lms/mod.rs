//! The session of a SICK LMS 2xx: find its rate, set it up, let it stream, notice when it stops, start again.
//!
//! ```text
//! find rate -> confirm -> switch rate -> configuration -> status -> faults
//!     -> (read again -> installation -> write -> leave -> read back)? -> (variant)? -> stream
//! stream -> find rate: silence, garbage, switched on anew, a step given up
//! ```
//! `machine.rs` leads from state to state; each concern is a small machine of its own: `setup/baud_search.rs`
//! up to the rate, `setup/configure.rs` and `setup/write.rs` up to the variant, `streaming/stream.rs` for the
//! scans, `streaming/stop.rs` for the end. Sources: SICK telegram listing 8007954, chapters 6 and 7; what
//! drivers of others get wrong.

pub(crate) mod device;
pub(crate) mod dialogue;
pub(crate) mod event_dedup;
pub(crate) mod health;
pub(crate) mod machine;
pub(crate) mod scan;
pub(crate) mod setup;
pub(crate) mod streaming;
#[cfg(test)]
mod tests;

use biplane_wire::Counts;
use biplane_wire::lms::DeviceDeframer;

use crate::session::device_session::{Input, Output, Session};
use crate::session::lms::device::Goal;
use crate::session::lms::dialogue::State;
use crate::session::lms::health::LaserHealth;
use crate::session::lms::machine::Machine;
use crate::session::lms::setup::info::LaserInfo;
use crate::session::lms::setup::settings::LaserSettings;
use crate::session::lms::streaming::self_truncated::SelfTruncation;
use crate::session::lms::streaming::self_truncated::TruncationCounts;
use crate::session::queues::Intake;

/// A session with one laser.
#[derive(Debug)]
pub struct LaserSession {
    intake: Intake,
    deframer: DeviceDeframer,
    machine: Machine,
    self_truncation: SelfTruncation,
}

impl LaserSession {
    /// A session that brings the laser to stream.
    #[must_use]
    pub fn streaming(settings: LaserSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Stream, now_ns);
        session.self_truncation.asked(now_ns, Counts::default());
        session.machine.begin();
        session
    }

    /// A session that asks the laser what it is, changes nothing, and is done.
    #[must_use]
    pub fn probing(settings: LaserSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Probe, now_ns);
        session.machine.begin();
        session
    }

    /// A session that only listens to what once came from a laser: it asks nothing, and takes configuration
    /// and variant from replies when there are any. The bytes may begin anywhere.
    #[must_use]
    pub fn listening(settings: LaserSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Stream, now_ns);
        session.machine.listen();
        session
    }

    fn new(settings: LaserSettings, goal: Goal, now_ns: i64) -> Self {
        let machine = Machine::new(settings, goal, now_ns);
        Self {
            intake: Intake::default(),
            deframer: DeviceDeframer::new(),
            machine,
            self_truncation: SelfTruncation::default(),
        }
    }

    /// What is known of the laser.
    #[must_use]
    pub fn info(&self) -> &LaserInfo {
        &self.machine.device.info
    }

    /// Intact scan telegrams that could not be read as a scan of this laser.
    #[must_use]
    pub fn not_kept(&self) -> u64 {
        self.machine.device.health.not_kept
    }

    /// What it has seen of its device.
    #[must_use]
    pub fn health(&self) -> &LaserHealth {
        &self.machine.device.health
    }

    /// Telegrams that were cut because we stopped the laser.
    #[must_use]
    pub fn truncated(&self) -> TruncationCounts {
        self.self_truncation.truncated(self.deframer.counts())
    }

    /// In a recording: something was sent to the laser at this time.
    pub fn host_sent(&mut self, now_ns: i64) {
        self.self_truncation.asked(now_ns, self.deframer.counts());
    }

    fn note_flow(&mut self) {
        match (self.machine.talk.state, self.machine.stream.scan_ns()) {
            (State::Streaming, _) => self.self_truncation.measured(self.deframer.counts()),
            (State::Listening, Some(scan_ns)) => {
                self.self_truncation.recorded(scan_ns, self.deframer.counts());
            }
            _ => {}
        }
    }

    /// Whether scans flow.
    #[must_use]
    pub fn is_streaming(&self) -> bool {
        matches!(self.machine.talk.state, State::Streaming | State::Listening)
    }

    /// Whether the device may be at work on its EEPROM: a run that ends waits for it.
    #[must_use]
    pub fn is_writing(&self) -> bool {
        self.machine.talk.state.is_writing()
    }

    /// The input ends: what the deframer still holds is let go. Drain [`Session::poll`] afterwards.
    pub fn finish(&mut self) {
        self.deframer.finish();
        self.drain();
    }

    /// Reads on in what has come, while there is room for what it leads to.
    fn drain(&mut self) {
        while self.machine.talk.outputs.has_room() {
            if let Some(item) = self.deframer.next() {
                let rejected = self.machine.device.health.rejected;
                self.machine.item(item);
                if self.machine.device.health.rejected > rejected {
                    // A damaged telegram that lost a byte has taken the first one of the telegram behind it.
                    self.deframer.reject();
                }
            } else if !self.intake.hand_on(&mut self.deframer) {
                break;
            }
        }
        self.machine.note_bad_checksums(self.deframer.counts().bad_checksums);
    }

    fn take_bytes(&mut self, bytes: &[u8]) {
        if self.machine.gap_before(bytes.len()) {
            self.deframer.abandon();
            self.drain();
        }
        self.machine.received_bytes();
        self.intake.take(bytes);
        self.drain();
    }

    /// The telegram that was under way when the port went has no rest.
    fn port_back(&mut self) {
        self.deframer.abandon();
        self.drain();
        self.machine.port_back();
    }

    /// A stop request cuts the telegram that it meets; the answer sits behind the partial frame, which would
    /// wait for bytes that never come. So while an answer is awaited, a pause ends the telegram.
    fn give_up_partial_frame(&mut self) {
        if self.deframer.buffered() > 0
            && self.machine.partial_frame_deadline_ns() <= self.machine.talk.now_ns
        {
            self.deframer.abandon();
            self.drain();
        }
    }
}

impl Session for LaserSession {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.machine.talk.now_ns = now_ns;
        match input {
            Input::Bytes(bytes) => self.take_bytes(bytes),
            Input::Time => self.give_up_partial_frame(),
            Input::RateRefused(baud) => self.machine.rate_refused(baud),
            Input::PortBack => self.port_back(),
            Input::Stop => {
                self.self_truncation.asked(now_ns, self.deframer.counts());
                self.machine.stop();
            }
        }
        self.machine.time();
        self.note_flow();
    }

    fn poll(&mut self) -> Output {
        if self.machine.talk.outputs.is_empty() {
            self.drain();
        }
        match self.machine.talk.outputs.pop() {
            Some(output) => output,
            None => {
                let partial_frame_ns = match self.deframer.buffered() {
                    0 => i64::MAX,
                    _ => self.machine.partial_frame_deadline_ns(),
                };
                Output::WaitUntil(self.machine.deadline_ns().min(partial_frame_ns))
            }
        }
    }

    fn is_done(&self) -> bool {
        self.machine.talk.state == State::Done && self.machine.talk.outputs.is_empty()
    }

    fn baud(&self) -> u32 {
        self.machine.talk.baud
    }

    fn counts(&self) -> Counts {
        self.deframer.counts()
    }

    fn overflowed(&self) -> u64 {
        self.machine.talk.outputs.overflowed()
    }
}
