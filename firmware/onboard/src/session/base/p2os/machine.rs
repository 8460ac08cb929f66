//! The state of a base's session and what leads from one state to the next. Times are nanoseconds.

use biplane_wire::WireError;
use biplane_wire::p2os::{Command, Identity, P2osFraming, Packet, Report, Sip};

use crate::session::base::contact::Contact;
use crate::session::base::driver::Purpose;
use crate::session::base::p2os::odometer::Odometer;
use crate::session::base::p2os::parameters::Parameters;
use crate::session::base::packets::PacketMachine;
use crate::session::base::reading::{BaseInfo, OdometryReading};
use crate::session::event::Event;
use crate::session::event::Step;
use crate::session::timing::retry::{Due, Patience, Question};
use crate::types::device_name::printable;

const SYNC: Patience = Patience::new(500, 4);
/// A base that has answered once answers the next question at once, unless it was reset between.
const SYNC_ON: Patience = Patience::new(300, 3);
const OPEN: Patience = Patience::new(1000, 3);
/// The line is listened to for so long before anything is sent: a base in an open session reports every
/// 100 ms, and each report takes 39 ms at 9600 Bd.
const LISTEN_FIRST_NS: i64 = 250_000_000;
/// A report so short a time before packets that were under way have run out is none of those.
const STILL_OPEN_NS: i64 = 150_000_000;
/// The base stands still 2 s after the last command.
const PULSE_NS: i64 = 800_000_000;
/// Standard packets come every 100 ms: nine of them missing are said within the second.
const SILENCE_NS: i64 = 900_000_000;
/// After a CLOSE, packets that are under way are let pass.
const CLOSE_NS: i64 = 250_000_000;
/// A base that was silent is told so often more, at that distance.
const CLOSES: u8 = 3;
/// Between two rounds of synchronizing.
const ROUND_NS: i64 = 500_000_000;

/// Where the session stands.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum State {
    /// Whether a session is open is not known yet; nothing was sent.
    ListeningFirst {
        until_ns: i64,
    },
    Sync(u8),
    /// A session was open and was told to close; its packets run out.
    Draining {
        until_ns: i64,
        reported_ns: i64,
    },
    /// Nobody answered; the next round comes.
    Resting {
        until_ns: i64,
    },
    Opening,
    Running {
        pulse_ns: i64,
    },
    /// It was silent when it was told to close its session: it is told again.
    Closing {
        left: u8,
        at_ns: i64,
    },
    Listening,
    Done,
}

/// The session with a Pioneer base, but for the deframer.
#[derive(Debug)]
pub struct Machine {
    contact: Contact,
    /// Of the rig, if it says it.
    metres_per_tick: Option<f64>,
    /// What the subclass says; `None` before it is known, or when it says nothing.
    parameters: Option<Parameters>,
    is_assumption_reported: bool,
    purpose: Purpose,
    state: State,
    question: Option<Question>,
    odometer: Odometer,
    is_close_reported: bool,
    has_run: bool,
    /// The next command may find the base stopped by its watchdog, and would wake it.
    watchdog_missed: bool,
}

impl Machine {
    pub(crate) fn new(baud: u32, metres_per_tick: Option<f64>, purpose: Purpose, now_ns: i64) -> Self {
        Self {
            contact: Contact::new(baud, SILENCE_NS, now_ns),
            metres_per_tick,
            parameters: None,
            is_assumption_reported: false,
            purpose,
            state: if purpose == Purpose::Listen { State::Listening } else { State::Done },
            question: None,
            odometer: Odometer::default(),
            is_close_reported: false,
            has_run: false,
            watchdog_missed: false,
        }
    }

    fn send(&mut self, command: &Command) {
        self.contact.send(|out| command.emit(out));
    }

    fn ask(&mut self, state: State, patience: Patience) {
        self.state = state;
        self.question = Some(Question::new(patience, self.contact.now_ns));
        self.time();
    }

    fn enter_sync(&mut self, number: u8) {
        self.ask(State::Sync(number), if number == 0 { SYNC } else { SYNC_ON });
    }

    fn asked(&mut self, attempt: u8) {
        match self.state {
            // Nothing goes before it: some bases take any packet before it for a SYNC out of turn.
            State::Sync(0) => {
                if attempt == 1 && self.contact.has_failed() {
                    self.contact.flush();
                }
                self.send(&Command::Sync(0));
            }
            State::Sync(number) => self.send(&Command::Sync(number)),
            State::Opening => {
                self.send(&Command::Open);
                self.send(&Command::Pulse);
                if attempt > 1 {
                    self.contact.say(Event::Retried { step: Step::Open, attempt });
                }
            }
            _ => {}
        }
    }

    /// No answer: from the start again, after a rest, for as long as nobody stops it.
    fn given_up(&mut self) {
        self.question = None;
        self.contact.round_failed(match self.state {
            State::Sync(0) => Event::NotFound { rounds: 1 },
            State::Sync(_) => Event::GivenUp { step: Step::Synchronize },
            _ => Event::GivenUp { step: Step::Open },
        });
        self.state = State::Resting { until_ns: self.contact.now_ns + ROUND_NS };
    }

    fn sip(&mut self, offset: u64, length: usize, sip: &Sip) {
        match self.state {
            State::ListeningFirst { .. } | State::Sync(0) | State::Resting { .. } if !self.has_run => {
                self.report(offset, length, sip);
                self.session_is_open();
            }
            // After a silence the session may still be open: then it was the line that was silent.
            State::Sync(0) | State::Resting { .. } | State::Opening if self.has_run || self.is_opening() => {
                self.question = None;
                self.contact.found();
                self.has_run = true;
                self.state = State::Running { pulse_ns: self.contact.now_ns + PULSE_NS };
                self.contact.say(Event::Streaming);
                self.report(offset, length, sip);
            }
            State::Running { .. } | State::Listening => self.report(offset, length, sip),
            // It is there again, and hears the next word.
            State::Closing { .. } => {
                self.report(offset, length, sip);
                self.send(&Command::Close);
                self.contact.say(Event::Stopped);
                self.state = State::Done;
            }
            State::Draining { until_ns, .. } => {
                self.state = State::Draining { until_ns, reported_ns: self.contact.now_ns };
                self.report(offset, length, sip);
            }
            // Under way when the session was closed, or when the base began to answer.
            _ => self.report(offset, length, sip),
        }
    }

    fn is_opening(&self) -> bool {
        self.state == State::Opening
    }

    /// Reports before or instead of an echo: somebody left a session open, or a pulled cable was put back. At
    /// any command a base that its watchdog stopped resumes the speed that it was told last, but not at STOP.
    fn session_is_open(&mut self) {
        if !self.is_close_reported {
            self.is_close_reported = true;
            self.contact.say(Event::SessionLeftOpen);
        }
        self.question = None;
        self.send(&Command::Stop);
        self.send(&Command::Close);
        let now_ns = self.contact.now_ns;
        self.state = State::Draining { until_ns: now_ns + CLOSE_NS, reported_ns: now_ns };
    }

    /// SYNC0 and SYNC1 are echoed.
    fn sync_answered(&mut self, number: u8) {
        if self.state == State::Sync(number) && number < 2 {
            self.enter_sync(number + 1);
        }
    }

    /// SYNC2 is answered with the base's names.
    fn identified(&mut self, identity: &Identity<'_>) {
        self.odometer.opened();
        let info = BaseInfo {
            name: printable(identity.name),
            class: printable(identity.class),
            subclass: printable(identity.subclass),
            has_fault: None,
        };
        if info != self.contact.info {
            self.parameters = Parameters::of_subclass(&info.subclass);
            self.contact.info = info;
            self.contact.say(Event::Identified(self.contact.info.subclass.clone()));
        }
        if self.state != State::Sync(2) {
            return;
        }
        self.is_close_reported = false;
        if self.purpose == Purpose::Probe {
            self.question = None;
            self.send(&Command::Close);
            self.state = State::Done;
        } else {
            self.contact.last_report_ns = self.contact.now_ns;
            self.ask(State::Opening, OPEN);
        }
    }

    fn report(&mut self, offset: u64, length: usize, sip: &Sip) {
        self.contact.last_report_ns = self.contact.now_ns;
        let units = self.units();
        self.contact.metres_per_tick = Some(units.metres_per_tick);
        let (odom_from_base, restarted) = self.odometer.pose(self.contact.now_ns, sip, units);
        let battery_v = f32::from(sip.battery_dv) / 10.0;
        self.contact.report(OdometryReading { offset, length, odom_from_base, battery_v }, restarted);
    }

    /// The rig's length of a unit goes before the subclass's; where both are missing that is said, once.
    fn units(&mut self) -> Parameters {
        let known = self.parameters.unwrap_or_default();
        match self.metres_per_tick {
            Some(metres_per_tick) => Parameters { metres_per_tick, ..known },
            None => {
                // Before the base has said its names the session is somebody else's.
                let is_own = matches!(self.state, State::Running { .. } | State::Listening);
                if is_own && self.parameters.is_none() && !self.is_assumption_reported {
                    self.is_assumption_reported = true;
                    self.contact.say(Event::UnitsAssumed);
                }
                known
            }
        }
    }

    fn running(&mut self, pulse_ns: i64) {
        if self.contact.is_lost() {
            self.contact.say_lost();
            self.enter_sync(0);
        } else if self.contact.now_ns >= pulse_ns {
            if std::mem::take(&mut self.watchdog_missed) {
                self.send(&Command::Stop);
            }
            self.send(&Command::Pulse);
            self.state = State::Running { pulse_ns: self.contact.now_ns + PULSE_NS };
        }
    }

    fn close_again(&mut self, left: u8) {
        if left == 0 {
            self.contact.say(Event::GivenUp { step: Step::StopStream });
            self.state = State::Done;
        } else {
            self.send(&Command::Close);
            self.state = State::Closing { left: left - 1, at_ns: self.contact.now_ns + CLOSE_NS };
        }
    }
}

impl PacketMachine for Machine {
    type Framing = P2osFraming;
    const HEADER: u8 = 0xFA;

    fn contact(&self) -> &Contact {
        &self.contact
    }

    fn contact_mut(&mut self) -> &mut Contact {
        &mut self.contact
    }

    fn begin(&mut self) {
        self.state = State::ListeningFirst { until_ns: self.contact.now_ns + LISTEN_FIRST_NS };
    }

    fn packet(&mut self, offset: u64, bytes: &[u8]) -> Result<(), WireError> {
        match Packet::parse(bytes)?.report()? {
            Report::Sip(sip) => self.sip(offset, bytes.len(), &sip),
            Report::Sync(number) => self.sync_answered(number),
            Report::Identity(identity) => self.identified(&identity),
            _ => {}
        }
        Ok(())
    }

    fn time(&mut self) {
        if let Some(question) = &mut self.question {
            match question.poll(self.contact.now_ns) {
                Due::Nothing => {}
                Due::Ask(attempt) => self.asked(attempt),
                Due::GivenUp => self.given_up(),
            }
        }
        match self.state {
            State::Draining { until_ns, reported_ns }
                if self.contact.now_ns >= until_ns && until_ns - reported_ns < STILL_OPEN_NS =>
            {
                self.session_is_open();
            }
            State::ListeningFirst { until_ns }
            | State::Draining { until_ns, .. }
            | State::Resting { until_ns }
                if self.contact.now_ns >= until_ns =>
            {
                self.enter_sync(0);
            }
            State::Running { pulse_ns } => self.running(pulse_ns),
            State::Closing { left, at_ns } if self.contact.now_ns >= at_ns => self.close_again(left),
            _ => {}
        }
    }

    /// The base may still report: it is told at once that its host lives, and listened to.
    fn port_back(&mut self) {
        if matches!(self.state, State::Running { .. }) {
            // It may have been gone for longer than the base's watchdog waits.
            self.watchdog_missed = true;
            self.state = State::Running { pulse_ns: self.contact.now_ns };
        } else if matches!(self.state, State::ListeningFirst { .. }) {
            self.begin();
        }
    }

    fn stop(&mut self) {
        match self.state {
            State::Closing { .. } => return,
            State::Done | State::Listening => return self.state = State::Done,
            _ => {}
        }
        // Also before it has answered: a base that was opened a moment ago must not be left open.
        self.send(&Command::Close);
        self.question = None;
        if self.has_run && !matches!(self.state, State::Running { .. } | State::Draining { .. }) {
            self.state = State::Closing { left: CLOSES, at_ns: self.contact.now_ns + CLOSE_NS };
            return;
        }
        if matches!(self.state, State::Running { .. }) {
            self.contact.say(Event::Stopped);
        }
        self.state = State::Done;
    }

    fn deadline_ns(&self) -> i64 {
        let question_ns = self.question.as_ref().map_or(i64::MAX, Question::deadline_ns);
        let state_ns = match self.state {
            State::ListeningFirst { until_ns }
            | State::Draining { until_ns, .. }
            | State::Resting { until_ns } => until_ns,
            State::Closing { at_ns, .. } => at_ns,
            State::Running { pulse_ns } => pulse_ns.min(self.contact.silence_deadline_ns()),
            _ => i64::MAX,
        };
        question_ns.min(state_ns)
    }

    fn is_streaming(&self) -> bool {
        matches!(self.state, State::Running { .. } | State::Listening)
    }

    fn is_done(&self) -> bool {
        self.state == State::Done
    }

    fn watchdog_missed(&mut self) {
        self.watchdog_missed = true;
    }
}
