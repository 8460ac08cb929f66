//! The session of a RoboClaw motor controller: the base of a home-made robot with two driven wheels, motor 1
//! on the left.
//!
//! ```text
//! firmware version -> running: both encoders at up to 50 Hz, once a second battery or status
//!   ^    bad or missing answer: drop input until the line is quiet, ask again |
//!   +------------------------------ no counts for 0.8 s ----------------------+
//! ```
//! Nothing is ever commanded but answers; the operator drives. An answer is taken only for the question that
//! was asked; a recording is therefore read together with what was sent ([`super::BaseDriver::host_sent`]).
//! Frame of the odometry: the base's own, its pose at the first answer is zero. Units: meters, radians.
//! Source: Basicmicro RoboClaw user manual, "packet serial".

pub(crate) mod machine;
#[cfg(test)]
mod tests;
pub(crate) mod wheels;

use biplane_wire::Counts;
use biplane_wire::roboclaw::{Collector, Question, Request};

use crate::session::base::driver::{BaseDriver, Purpose};
use crate::session::base::reading::BaseInfo;
use crate::session::base::roboclaw::machine::{Machine, Stage};
use crate::session::base::roboclaw::wheels::Wheels;
use crate::session::device_session::{Input, Output, Session};
use crate::session::event::Event;

/// A session with a RoboClaw.
#[derive(Debug)]
pub struct RoboClaw {
    collector: Collector,
    machine: Machine,
}

impl RoboClaw {
    pub(crate) fn new(baud: u32, address: u8, wheels: Wheels, purpose: Purpose, now_ns: i64) -> Self {
        let mut session = Self {
            collector: Collector::new(),
            machine: Machine::new(baud, address, wheels, purpose, now_ns),
        };
        if purpose != Purpose::Listen {
            session.machine.contact.set_rate();
            session.step();
        }
        session
    }

    /// An answer that is late is given up: what comes of it now is none.
    fn give_up_late(&mut self) {
        if self.machine.answer_is_late() {
            let held = self.collector.buffered();
            self.collector.abandon();
            self.machine.unanswered(held);
        }
    }

    /// Lets time pass: asks what is due.
    fn step(&mut self) {
        self.machine.watch();
        if let Some(question) = self.machine.due_question() {
            let request = Request { address: self.machine.address, question };
            self.collector.ask(request);
            self.machine.asked(request);
        }
    }

    fn take_bytes(&mut self, bytes: &[u8]) {
        self.machine.received_bytes();
        match self.collector.take(bytes) {
            Some(Ok(received)) => self.machine.answered(received),
            Some(Err(_)) => self.machine.unanswered(0),
            None => {}
        }
    }
}

impl BaseDriver for RoboClaw {
    fn info(&self) -> &BaseInfo {
        &self.machine.contact.info
    }

    fn not_kept(&self) -> u64 {
        0
    }

    fn is_streaming(&self) -> bool {
        matches!(self.machine.stage, Stage::Running | Stage::Listening)
    }

    fn host_sent(&mut self, now_ns: i64, bytes: &[u8]) {
        self.machine.contact.now_ns = now_ns;
        match Request::parse(bytes) {
            // How wide the status was asked for, its question does not tell; and the odometry does not need
            // it.
            Ok(request)
                if request.address == self.machine.address
                    && !matches!(request.question, Question::Status(_)) =>
            {
                self.collector.ask(request);
                self.machine.was_asked(request.question);
            }
            _ => self.collector.abandon(),
        }
    }

    fn finish(&mut self) {
        self.collector.abandon();
    }
}

impl Session for RoboClaw {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.machine.contact.now_ns = now_ns;
        self.give_up_late();
        match input {
            // No bytes are silence.
            Input::Bytes([]) | Input::Time => {}
            Input::Bytes(bytes) => self.take_bytes(bytes),
            Input::RateRefused(baud) => self.machine.contact.say(Event::RateRefused { baud }),
            Input::PortBack => {
                self.collector.abandon();
                self.machine.port_back();
            }
            Input::Stop => {
                self.machine.stop();
                if self.machine.stage == Stage::Done {
                    self.collector.abandon();
                }
            }
        }
        self.step();
    }

    fn poll(&mut self) -> Output {
        self.machine.contact.outputs.pop().unwrap_or_else(|| Output::WaitUntil(self.machine.deadline_ns()))
    }

    fn is_done(&self) -> bool {
        self.machine.stage == Stage::Done && self.machine.contact.outputs.is_empty()
    }

    fn baud(&self) -> u32 {
        self.machine.contact.baud
    }

    fn counts(&self) -> Counts {
        self.collector.counts()
    }

    fn overflowed(&self) -> u64 {
        self.machine.contact.outputs.overflowed()
    }
}
