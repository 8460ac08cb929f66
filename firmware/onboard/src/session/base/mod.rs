//! The session of a Pioneer base (PSOS, P2OS, AROS, ARCOS): synchronise, open, keep it alive, read its odometry.
//!
//! ```text
//! SYNC0 -> SYNC1 -> SYNC2 -> OPEN -> running (PULSE every 0.8 s) -> CLOSE
//!   ^  CLOSE first, when packets come instead of an echo     |
//!   +------------------------------ silence -----------------+
//! ```
//! The motors are never enabled: the operator drives. Frame of the odometry: the base's own (`odom`). Units: metres, radians.
//! Source: Pioneer 3 operations manual, and the fact sheet `p2os.md`.

mod odometer;

use biplane_matcher::Pose2;
use biplane_recording::rig;
use biplane_wire::p2os::{self, Command, Identity, Packet, Report, Sip};
use biplane_wire::{Counts, Item};

use super::retry::{Due, Patience, Question};
use super::{Event, Input, Output, Outputs, RequestBytes, Session, ShortText, Step, printable};
use odometer::Odometer;

const SYNC: Patience = Patience::new(500, 4);
const OPEN: Patience = Patience::new(1000, 3);
/// The base stops answering 2 s after the last command.
const PULSE_NS: i64 = 800_000_000;
/// Standard packets come every 100 ms.
const SILENCE_NS: i64 = 1_000_000_000;
/// After a CLOSE, packets that are under way are let pass.
const CLOSE_NS: i64 = 250_000_000;
/// Between two rounds of synchronising.
const ROUND_NS: i64 = 500_000_000;
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
        Self { baud: base.baud, metres_per_tick: base.metres_per_tick }
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

#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum State {
    Sync(u8),
    /// A session was open; its packets run out.
    Draining {
        until_ns: i64,
    },
    /// Nobody answered; the next round comes.
    Resting {
        until_ns: i64,
    },
    Opening,
    Running {
        pulse_ns: i64,
    },
    Listening,
    Done,
}

/// A session with one base.
#[derive(Debug)]
pub struct BaseSession {
    deframer: p2os::Deframer,
    machine: Machine,
}

#[derive(Debug)]
struct Machine {
    settings: BaseSettings,
    probe: bool,
    state: State,
    question: Option<Question>,
    info: BaseInfo,
    odometer: Odometer,
    outputs: Outputs,
    now_ns: i64,
    last_packet_ns: i64,
    rounds: u32,
    close_said: bool,
    has_run: bool,
    not_kept: u64,
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
        let machine = Machine {
            settings,
            probe,
            state: State::Done,
            question: None,
            info: BaseInfo::default(),
            odometer: Odometer::default(),
            outputs: Outputs::default(),
            now_ns,
            last_packet_ns: now_ns,
            rounds: 0,
            close_said: false,
            has_run: false,
            not_kept: 0,
        };
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

impl Machine {
    fn say(&mut self, event: Event) {
        self.outputs.push(Output::Event(event));
    }

    fn send(&mut self, command: &Command) {
        let mut bytes = [0; 64];
        if let Ok(length) = command.emit(&mut bytes)
            && let Ok(bytes) = RequestBytes::from_slice(&bytes[..length])
        {
            self.outputs.push(Output::Write(bytes));
        }
    }

    fn ask(&mut self, state: State, patience: Patience) {
        self.state = state;
        self.question = Some(Question::new(patience, self.now_ns));
        self.time();
    }

    fn enter_sync(&mut self, number: u8) {
        self.ask(State::Sync(number), SYNC);
    }

    fn time(&mut self) {
        if let Some(question) = &mut self.question {
            match question.poll(self.now_ns) {
                Due::Nothing => {}
                Due::Ask(attempt) => self.asked(attempt),
                Due::GivenUp => self.given_up(),
            }
        }
        match self.state {
            State::Draining { until_ns } | State::Resting { until_ns } if self.now_ns >= until_ns => {
                self.enter_sync(0);
            }
            State::Running { pulse_ns } => self.running(pulse_ns),
            _ => {}
        }
    }

    fn asked(&mut self, attempt: u8) {
        match self.state {
            State::Sync(number) => self.send(&Command::Sync(number)),
            State::Opening => {
                self.send(&Command::Open);
                self.send(&Command::Pulse);
                if attempt > 1 {
                    self.say(Event::Retried { step: Step::Open, attempt });
                }
            }
            _ => {}
        }
    }

    /// No answer: from the start again, after a rest, for as long as nobody stops it.
    fn given_up(&mut self) {
        self.question = None;
        self.rounds += 1;
        match self.state {
            State::Sync(0) => self.say(Event::NotFound { rounds: self.rounds }),
            State::Sync(_) => self.say(Event::GivenUp { step: Step::Synchronise }),
            _ => self.say(Event::GivenUp { step: Step::Open }),
        }
        self.state = State::Resting { until_ns: self.now_ns + ROUND_NS };
    }

    fn frame(&mut self, offset: u64, bytes: &[u8]) {
        match Packet::parse(bytes).and_then(|packet| packet.report()) {
            Ok(Report::Sip(sip)) => self.sip(offset, bytes.len(), &sip),
            Ok(Report::Sync(number)) => self.sync_answered(number),
            Ok(Report::Identity(identity)) => self.identified(&identity),
            Ok(_) => {}
            Err(_) => self.not_kept += 1,
        }
    }

    fn sip(&mut self, offset: u64, length: usize, sip: &Sip) {
        match self.state {
            State::Sync(0) if !self.has_run => self.session_is_open(),
            // After a silence the session may still be open: then it was the line that was silent.
            State::Sync(0) | State::Opening => {
                self.question = None;
                self.rounds = 0;
                self.has_run = true;
                self.state = State::Running { pulse_ns: self.now_ns + PULSE_NS };
                self.say(Event::Streaming);
                self.report(offset, length, sip);
            }
            State::Running { .. } | State::Listening => self.report(offset, length, sip),
            // Under way when the session was closed.
            State::Done if self.has_run => self.report(offset, length, sip),
            _ => {}
        }
    }

    /// Reports instead of an echo: somebody left a session open, or a pulled cable was put back.
    fn session_is_open(&mut self) {
        if !self.close_said {
            self.close_said = true;
            self.say(Event::SessionLeftOpen);
        }
        self.question = None;
        self.send(&Command::Close);
        self.state = State::Draining { until_ns: self.now_ns + CLOSE_NS };
    }

    /// SYNC0 and SYNC1 are echoed.
    fn sync_answered(&mut self, number: u8) {
        if self.state == State::Sync(number) && number < 2 {
            self.enter_sync(number + 1);
        }
    }

    /// SYNC2 is answered with the base's names.
    fn identified(&mut self, identity: &Identity<'_>) {
        let info = BaseInfo {
            name: printable(identity.name),
            class: printable(identity.class),
            subclass: printable(identity.subclass),
        };
        if info != self.info {
            self.info = info;
            self.say(Event::Identified(self.info.subclass.clone()));
        }
        if self.state != State::Sync(2) {
            return;
        }
        self.close_said = false;
        if self.probe {
            self.question = None;
            self.send(&Command::Close);
            self.state = State::Done;
        } else {
            self.last_packet_ns = self.now_ns;
            self.ask(State::Opening, OPEN);
        }
    }

    fn report(&mut self, offset: u64, length: usize, sip: &Sip) {
        self.last_packet_ns = self.now_ns;
        let (odom_from_base, restarted) = self.odometer.pose(self.now_ns, sip, self.settings.metres_per_tick);
        if restarted {
            self.say(Event::OdometryRestarted);
        }
        let battery_v = f32::from(sip.battery_dv) / 10.0;
        self.outputs.push(Output::Odometry(OdometryReading { offset, length, odom_from_base, battery_v }));
    }

    fn running(&mut self, pulse_ns: i64) {
        if self.now_ns - self.last_packet_ns >= SILENCE_NS {
            let for_ms = u32::try_from((self.now_ns - self.last_packet_ns) / 1_000_000).unwrap_or(u32::MAX);
            self.say(Event::Silent { for_ms });
            self.odometer.session_restarts();
            self.enter_sync(0);
        } else if self.now_ns >= pulse_ns {
            self.send(&Command::Pulse);
            self.state = State::Running { pulse_ns: self.now_ns + PULSE_NS };
        }
    }

    fn stop(&mut self) {
        if matches!(self.state, State::Done | State::Listening) {
            self.state = State::Done;
            return;
        }
        // Also before it has answered: a base that was opened a moment ago must not be left open.
        self.send(&Command::Close);
        if matches!(self.state, State::Running { .. }) {
            self.say(Event::Stopped);
        }
        self.question = None;
        self.state = State::Done;
    }

    fn deadline_ns(&self) -> i64 {
        let question_ns = self.question.as_ref().map_or(i64::MAX, Question::deadline_ns);
        let state_ns = match self.state {
            State::Draining { until_ns } | State::Resting { until_ns } => until_ns,
            State::Running { pulse_ns } => pulse_ns.min(self.last_packet_ns.saturating_add(SILENCE_NS)),
            _ => i64::MAX,
        };
        question_ns.min(state_ns)
    }
}

#[cfg(test)]
mod tests;
