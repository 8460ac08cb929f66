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
mod parameters;

use biplane_wire::p2os::Deframer;
use biplane_wire::{Counts, Item};

use super::driver::{BaseDriver, Purpose};
use super::{BaseInfo, Input, Output, Session};
use machine::{Machine, State};
pub use parameters::{Parameters, UNKNOWN_METRES_PER_TICK};

/// A session with a Pioneer base.
#[derive(Debug)]
pub struct P2os {
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
        Self { deframer: Deframer::new(), machine }
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
                if self.machine.gap_before() {
                    self.deframer.abandon();
                    self.drain();
                }
                self.machine.last_byte_ns = now_ns;
                self.take_bytes(bytes);
            }
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
        self.machine.baud
    }

    fn counts(&self) -> Counts {
        self.deframer.counts()
    }
}

#[cfg(test)]
mod tests;
