//! The session of an rFLEX base (B21r, ATRV, Magellan): ask for its state, ask for reports, read way and bearing.
//!
//! ```text
//! status -> motion reports on, input reports on, defaults, brake off, both axes at speed 0 -> running -> reports off, brake on
//!   ^                                     silence                                                |
//!   +--------------------------------------------------------------------------------------------+
//! ```
//! Written after the drivers of Player and CARMEN; never tried on hardware, and the log says so. No axis is ever given a speed
//! other than 0: the operator drives. The base reports path length and bearing in packets of their own; two that belong together
//! make one pose. Frame of the odometry: the base's own, its pose at the first pair is zero. Units: metres, radians.
//! Source: the fact sheet `rflex.md`.

mod axes;
mod machine;

use biplane_wire::rflex::Deframer;
use biplane_wire::{Counts, Item};

use super::driver::{BaseDriver, Purpose};
use super::motion::Motion;
use super::{BaseInfo, Event, Input, Intake, Output, Session};
use machine::{Machine, State};

/// What the counts of a base are worth.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Scale {
    /// Counts of a metre of way; negative when it counts backwards.
    pub counts_per_m: f64,
    /// Counts of a radian of bearing; negative when it counts clockwise.
    pub counts_per_rad: f64,
}

impl Scale {
    /// What these counts of way and bearing are as a motion.
    fn motion(&self, [way, bearing]: [i32; 2]) -> Motion {
        Motion {
            way_m: f64::from(way) / self.counts_per_m,
            turn_rad: f64::from(bearing) / self.counts_per_rad,
        }
    }
}

/// A session with an rFLEX base.
#[derive(Debug)]
pub struct Rflex {
    intake: Intake,
    deframer: Deframer,
    machine: Machine,
}

impl Rflex {
    pub(super) fn new(baud: u32, scale: Scale, purpose: Purpose, now_ns: i64) -> Self {
        let mut machine = Machine::new(baud, scale, purpose, now_ns);
        if purpose != Purpose::Listen {
            machine.outputs.push(Output::SetBaud(baud));
            machine.begin();
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

impl BaseDriver for Rflex {
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

impl Session for Rflex {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.machine.now_ns = now_ns;
        match input {
            Input::Bytes(bytes) => {
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
