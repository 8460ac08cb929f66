//! The session of a Pioneer base (PSOS, P2OS, AROS, ARCOS): synchronise, open, keep it alive, read its odometry.
//!
//! ```text
//! STOP, SYNC0 -> SYNC1 -> SYNC2 -> OPEN -> running (PULSE every 0.8 s) -> CLOSE
//!   ^  CLOSE first, when packets come instead of an echo           |
//!   +------------------------------ silence -----------------------+
//! ```
//! The motors are never enabled: the operator drives. A base that its watchdog stopped would resume its last speed at any command, so STOP
//! goes before whatever may wake it. Frame of the odometry: the base's own (`odom`). Units: metres, radians.
//! Source: Pioneer 3 operations manual, and the fact sheet `p2os.md`.

mod foreign;
mod machine;
mod odometer;
mod parameters;

use biplane_wire::p2os::Deframer;
use biplane_wire::{Counts, Item};

use super::driver::{BaseDriver, Purpose};
use super::{BaseInfo, Event, Input, Intake, Output, Session};
use machine::{Machine, State};
pub use parameters::{Parameters, UNKNOWN_METRES_PER_TICK};

/// A session with a Pioneer base.
#[derive(Debug)]
pub struct P2os {
    intake: Intake,
    deframer: Deframer,
    machine: Machine,
}

impl P2os {
    pub(super) fn new(baud: u32, metres_per_tick: Option<f64>, purpose: Purpose, now_ns: i64) -> Self {
        let mut machine = Machine::new(baud, metres_per_tick, purpose, now_ns);
        if purpose != Purpose::Listen {
            machine.outputs.push(Output::SetBaud(baud));
            machine.enter_sync(0);
        }
        Self { intake: Intake::default(), deframer: Deframer::new(), machine }
    }

    /// Reads on in what has come, while there is room for what it leads to.
    fn drain(&mut self) {
        while self.machine.outputs.has_room() {
            if let Some(item) = self.deframer.next() {
                if let Item::Frame { offset, bytes } = item {
                    self.machine.frame(offset, bytes);
                }
            } else if !self.intake.hand_on(&mut self.deframer) {
                break;
            }
        }
    }

    /// The packet that was under way when the port went has no rest.
    fn port_back(&mut self) {
        self.deframer.abandon();
        self.drain();
        self.machine.port_back();
    }
}

impl BaseDriver for P2os {
    fn info(&self) -> &BaseInfo {
        &self.machine.info
    }

    fn not_kept(&self) -> u64 {
        self.machine.not_kept
    }

    fn is_streaming(&self) -> bool {
        matches!(self.machine.state, State::Running { .. } | State::Listening)
    }

    fn overslept(&mut self) {
        self.machine.overslept = true;
    }

    fn host_sent(&mut self, _now_ns: i64, bytes: &[u8]) {
        self.machine.foreign.host_sent(bytes);
    }

    fn finish(&mut self) {
        self.deframer.finish();
        self.drain();
    }
}

impl Session for P2os {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.machine.now_ns = now_ns;
        match input {
            Input::Bytes(bytes) => {
                if self.machine.gap_before(bytes) {
                    self.deframer.abandon();
                    self.drain();
                }
                self.machine.last_byte_ns = now_ns;
                self.intake.take(bytes);
                self.drain();
            }
            Input::Time => {}
            Input::RateRefused(baud) => self.machine.say(Event::RateRefused { baud }),
            Input::PortBack => self.port_back(),
            Input::Stop => self.machine.stop(),
        }
        self.machine.time();
    }

    fn poll(&mut self) -> Output {
        if self.machine.outputs.is_empty() {
            self.drain();
        }
        self.machine.outputs.pop().unwrap_or_else(|| Output::WaitUntil(self.machine.deadline_ns()))
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
