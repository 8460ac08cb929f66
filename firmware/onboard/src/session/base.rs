//! The session of a Pioneer base (PSOS, P2OS, AROS, ARCOS): synchronise, open, keep it alive, read its odometry.
//!
//! ```text
//! SYNC0 -> SYNC1 -> SYNC2 -> OPEN -> running (PULSE every 0.8 s) -> CLOSE
//!   ^  CLOSE first, when packets come instead of an echo     |
//!   +------------------------------ silence -----------------+
//! ```
//! The motors are never enabled: the operator drives. Frame of the odometry: the base's own (`odom`). Units: metres, radians.
//! Source: Pioneer 3 operations manual, and the fact sheet `p2os.md`.

use biplane_matcher::{Pose2, wrap_angle};
use biplane_recording::rig;
use biplane_wire::p2os::{self, Command, Packet, Sip};
use biplane_wire::{Counts, Item};

use super::retry::{Due, Patience, Question};
use super::{Event, Input, Output, Outputs, RequestBytes, Session, Step};

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
/// Position is 15 bits wide.
const ANGLE_UNITS_PER_TURN: f64 = 4096.0;
/// Faster than any of these bases, metres per second: a larger jump is a restart, not motion.
const MAX_SPEED_M_S: f64 = 3.0;
/// A jump of this size is motion at any speed, metres: stamps jitter.
const MAX_STEP_M: f64 = 0.3;

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
    pub name: heapless::String<32>,
    /// Class, usually `Pioneer`.
    pub class: heapless::String<32>,
    /// Subclass, for example `p3dx-sh`: picks the parameters.
    pub subclass: heapless::String<32>,
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
        let Ok(packet) = Packet::parse(bytes) else { return };
        let is_report = packet.is_sip();
        match self.state {
            State::Sync(number) if is_report => self.session_is_open(number),
            State::Sync(number) => self.sync_answered(number, &packet),
            State::Opening if is_report => {
                self.question = None;
                self.rounds = 0;
                self.state = State::Running { pulse_ns: self.now_ns + PULSE_NS };
                self.say(Event::Streaming);
                self.report(offset, bytes.len(), &packet);
            }
            State::Running { .. } | State::Listening if is_report => self.report(offset, bytes.len(), &packet),
            State::Listening => self.learn(&packet),
            _ => {}
        }
    }

    /// Reports instead of an echo: somebody left a session open, or a pulled cable was put back.
    fn session_is_open(&mut self, number: u8) {
        if number > 0 || self.question.is_none() {
            return;
        }
        if !self.close_said {
            self.close_said = true;
            self.say(Event::SessionLeftOpen);
        }
        self.question = None;
        self.send(&Command::Close);
        self.state = State::Draining { until_ns: self.now_ns + CLOSE_NS };
    }

    /// SYNC0 and SYNC1 are echoed; SYNC2 is answered with the base's names.
    fn sync_answered(&mut self, number: u8, packet: &Packet<'_>) {
        if packet.kind() != number {
            return;
        }
        match number {
            0 | 1 => self.enter_sync(number + 1),
            _ => {
                self.learn(packet);
                self.say(Event::Identified(self.info.subclass.clone()));
                self.identified();
            }
        }
    }

    fn identified(&mut self) {
        self.close_said = false;
        if self.probe {
            self.question = None;
            self.send(&Command::Close);
            self.state = State::Done;
        } else {
            self.ask(State::Opening, OPEN);
        }
    }

    fn learn(&mut self, packet: &Packet<'_>) {
        if let Ok(identity) = packet.identity() {
            self.info = BaseInfo {
                name: printable(identity.name),
                class: printable(identity.class),
                subclass: printable(identity.subclass),
            };
        }
    }

    fn report(&mut self, offset: u64, length: usize, packet: &Packet<'_>) {
        self.last_packet_ns = self.now_ns;
        let Ok(sip) = packet.sip() else {
            self.not_kept += 1;
            return;
        };
        let (odom_from_base, restarted) = self.odometer.pose(self.now_ns, &sip, self.settings.metres_per_tick);
        if restarted {
            self.say(Event::OdometryRestarted);
        }
        let battery_v = f32::from(sip.battery_decivolt) / 10.0;
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

fn printable(text: &[u8]) -> heapless::String<32> {
    let mut kept = heapless::String::new();
    for &byte in text.iter().take(kept.capacity()) {
        let letter = if byte.is_ascii_graphic() || byte == b' ' { char::from(byte) } else { '?' };
        if kept.push(letter).is_err() {
            break;
        }
    }
    kept
}

/// Unwraps the base's 15-bit position and continues it when the base starts to count anew.
#[derive(Clone, Debug, Default)]
struct Odometer {
    last: Option<Reported>,
    /// Position that the wrapped counts stand for, in the base's own frame, metres.
    raw_from_base: Pose2,
    odom_from_raw: Pose2,
    session_restarted: bool,
}

#[derive(Copy, Clone, Debug)]
struct Reported {
    x_raw: u16,
    y_raw: u16,
    time_ns: i64,
}

impl Odometer {
    /// The base was opened anew: it may have kept its position, or count from zero.
    fn session_restarts(&mut self) {
        self.session_restarted = true;
    }

    /// The pose that a report stands for, and whether the base had started to count anew.
    fn pose(&mut self, now_ns: i64, sip: &Sip, metres_per_tick: f64) -> (Pose2, bool) {
        let heading_rad = wrap_angle(f64::from(sip.theta_raw) * std::f64::consts::TAU / ANGLE_UNITS_PER_TURN);
        let reported = Reported { x_raw: sip.x_raw, y_raw: sip.y_raw, time_ns: now_ns };
        let metres = |from: u16, to: u16| f64::from(p2os::wrap15(from, to)) * metres_per_tick;
        let previous = self.odom_from_raw * self.raw_from_base;
        let mut restarted = false;
        match self.last {
            None => {
                self.raw_from_base =
                    Pose2::new(metres(0, sip.x_raw), metres(0, sip.y_raw), heading_rad);
            }
            Some(last) => {
                let step_m = [metres(last.x_raw, sip.x_raw), metres(last.y_raw, sip.y_raw)];
                let gap_s = (now_ns - last.time_ns).max(0) as f64 * 1e-9;
                let counts_from_zero = self.session_restarted && (sip.x_raw, sip.y_raw, sip.theta_raw) == (0, 0, 0);
                restarted = counts_from_zero || step_m[0].hypot(step_m[1]) > MAX_STEP_M + MAX_SPEED_M_S * gap_s;
                self.raw_from_base = if restarted {
                    Pose2::new(metres(0, sip.x_raw), metres(0, sip.y_raw), heading_rad)
                } else {
                    let now = &self.raw_from_base;
                    Pose2::new(now.x_m + step_m[0], now.y_m + step_m[1], heading_rad)
                };
            }
        }
        if restarted {
            self.odom_from_raw = previous * self.raw_from_base.inverse();
        }
        self.session_restarted = false;
        self.last = Some(reported);
        (self.odom_from_raw * self.raw_from_base, restarted)
    }
}

#[cfg(test)]
mod tests;
