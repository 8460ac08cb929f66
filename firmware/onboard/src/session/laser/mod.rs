//! The session of a SICK LMS 2xx: find its rate, set it up, let it stream, notice when it stops, start again.
//!
//! ```text
//! find rate -> confirm -> switch rate -> configuration -> status -> faults -> (read again -> installation -> write -> leave -> read back)? -> (variant)? -> stream
//!      ^                                                                                                                                            |
//!      +------------------------------------------- silence, garbage, switched on anew, a step given up -------------------------------------------+
//! ```
//! One small function a state: `search.rs` up to the rate, `configure.rs` and `write.rs` up to the variant, `stream.rs` for the scans, `stop.rs` for the end.
//! Sources: SICK telegram listing 8007954 chapters 6 and 7; what other drivers get wrong is in the fact sheet, section 11.

mod condition;
mod configure;
mod difference;
mod fan;
mod health;
mod index_watch;
mod machine;
mod own_cuts;
mod plausible;
mod reading;
mod said;
mod search;
mod settings;
mod stop;
mod stream;
mod wanted;
mod write;

use biplane_wire::Counts;
use biplane_wire::lms::DeviceDeframer;

pub use condition::{Trouble, Troubles};
pub use difference::BlockDifference;
pub use fan::Fan;
pub use health::{FaultList, LaserHealth, MAX_FAULTS};
pub use index_watch::IndexWatch;
pub use own_cuts::Cuts;
pub use reading::{MAX_LMS_BEAMS, ScanIndex, ScanReading, Unpublished};
pub use settings::{LaserInfo, LaserSettings};
pub use wanted::ConfigChange;

use super::{Input, Intake, Output, Session};
use machine::{Goal, Machine, State};
use own_cuts::OwnCuts;

/// A session with one laser.
#[derive(Debug)]
pub struct LaserSession {
    intake: Intake,
    deframer: DeviceDeframer,
    machine: Machine,
    own_cuts: OwnCuts,
}

impl LaserSession {
    /// A session that brings the laser to stream.
    #[must_use]
    pub fn streaming(settings: LaserSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Stream, now_ns);
        session.own_cuts.asked(now_ns, Counts::default());
        session.machine.enter_search(0);
        session
    }

    /// A session that asks the laser what it is, changes nothing, and is done.
    #[must_use]
    pub fn probing(settings: LaserSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Probe, now_ns);
        session.machine.enter_search(0);
        session
    }

    /// A session that only listens to what once came from a laser: it asks nothing, and takes configuration and variant
    /// from replies when there are any. The bytes may begin anywhere.
    #[must_use]
    pub fn listening(settings: LaserSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Stream, now_ns);
        session.machine.state = State::Listening;
        session
    }

    fn new(settings: LaserSettings, goal: Goal, now_ns: i64) -> Self {
        let machine = Machine::new(settings, goal, now_ns);
        Self {
            intake: Intake::default(),
            deframer: DeviceDeframer::new(),
            machine,
            own_cuts: OwnCuts::default(),
        }
    }

    /// What is known of the laser.
    #[must_use]
    pub fn info(&self) -> &LaserInfo {
        &self.machine.info
    }

    /// Intact scan telegrams that could not be read as a scan of this laser.
    #[must_use]
    pub fn not_kept(&self) -> u64 {
        self.machine.health.not_kept
    }

    /// What it has seen of its device.
    #[must_use]
    pub fn health(&self) -> &LaserHealth {
        &self.machine.health
    }

    /// Telegrams that were cut because we stopped the laser.
    #[must_use]
    pub fn cuts(&self) -> Cuts {
        self.own_cuts.cuts(self.deframer.counts())
    }

    /// In a recording: something was sent to the laser at this time.
    pub fn host_sent(&mut self, now_ns: i64) {
        self.own_cuts.asked(now_ns, self.deframer.counts());
    }

    fn note_flow(&mut self) {
        let Machine { state, scan_ns, .. } = self.machine;
        match state {
            State::Streaming => self.own_cuts.measured(self.deframer.counts()),
            State::Listening if scan_ns > i64::MIN => {
                self.own_cuts.recorded(scan_ns, self.deframer.counts());
            }
            _ => {}
        }
    }

    /// Whether scans flow.
    #[must_use]
    pub fn is_streaming(&self) -> bool {
        matches!(self.machine.state, State::Streaming | State::Listening)
    }

    /// Whether the device may be at work on its EEPROM: a run that ends waits for it.
    #[must_use]
    pub fn is_writing(&self) -> bool {
        self.machine.is_writing()
    }

    /// The input ends: what the deframer still holds is let go. Drain [`Session::poll`] afterwards.
    pub fn finish(&mut self) {
        self.deframer.finish();
        self.drain();
    }

    /// Reads on in what has come, while there is room for what it leads to.
    fn drain(&mut self) {
        while self.machine.outputs.has_room() {
            if let Some(item) = self.deframer.next() {
                let rejected = self.machine.health.rejected;
                self.machine.item(item);
                if self.machine.health.rejected > rejected {
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
        let silence_ns = self.machine.now_ns.saturating_sub(self.machine.last_byte_ns);
        self.machine.heard_after(silence_ns);
        self.machine.last_byte_ns = self.machine.now_ns;
        self.intake.take(bytes);
        self.drain();
    }

    /// The telegram that was under way when the port went has no rest.
    fn port_back(&mut self) {
        self.deframer.abandon();
        self.drain();
        self.machine.port_back();
    }

    /// A stop request cuts the telegram that it meets; the answer sits behind the stump, which would wait for bytes
    /// that never come. So while an answer is awaited, a pause ends the telegram.
    fn give_up_stump(&mut self) {
        if self.deframer.buffered() > 0 && self.machine.stump_deadline_ns() <= self.machine.now_ns {
            self.deframer.abandon();
            self.drain();
        }
    }
}

impl Session for LaserSession {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.machine.now_ns = now_ns;
        match input {
            Input::Bytes(bytes) => self.take_bytes(bytes),
            Input::Time => self.give_up_stump(),
            Input::RateRefused(baud) => self.machine.rate_refused(baud),
            Input::PortBack => self.port_back(),
            Input::Stop => {
                self.own_cuts.asked(now_ns, self.deframer.counts());
                self.machine.stop();
            }
        }
        self.machine.time();
        self.note_flow();
    }

    fn poll(&mut self) -> Output {
        if self.machine.outputs.is_empty() {
            self.drain();
        }
        match self.machine.outputs.pop() {
            Some(output) => output,
            None => {
                let stump_ns = match self.deframer.buffered() {
                    0 => i64::MAX,
                    _ => self.machine.stump_deadline_ns(),
                };
                Output::WaitUntil(self.machine.deadline_ns().min(stump_ns))
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

#[cfg(test)]
mod tests;
