//! The state of a session with an inertial unit and what leads from one state to the next. Times are
//! nanoseconds.

use biplane_wire::WireError;
use biplane_wire::xsens::{Command, DeviceId, ErrorCode, Message, Outputs, Report, Sample, XsensFraming};

use crate::session::base::contact::Contact;
use crate::session::base::driver::Purpose;
use crate::session::base::packets::PacketMachine;
use crate::session::device_session::Output;
use crate::session::event::Event;
use crate::session::inertial::event::InertialEvent;
use crate::session::inertial::health::InertialHealth;
use crate::session::inertial::query::{Query, sample_rate_hz};
use crate::session::inertial::reading::InertialReading;
use crate::session::inertial::samples::{Arrived, Samples};
use crate::session::timing::retry::{Due, Question};
use crate::types::device_name::ShortText;

/// A unit that measures sends 25 times a second at least. Larger: a pulled plug is noticed later.
const SILENCE_NS: i64 = 500_000_000;
/// Between two rounds of asking.
const ROUND_NS: i64 = 500_000_000;
/// The first measurement comes when the unit's filters have settled.
const FIRST_SAMPLE_NS: i64 = 2_000_000_000;

/// Where the session stands.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum State {
    /// A question is open.
    Asking(Query),
    /// Nobody answered, or not as it should be; the next round comes.
    Resting { until_ns: i64 },
    /// Measurements are awaited, from this time on, or flow.
    Measuring { since_ns: i64 },
    /// A recording is read.
    Listening,
    /// Nothing left to do.
    Done,
}

/// The session with an inertial unit, but for the deframer.
#[derive(Debug)]
pub(crate) struct Machine {
    contact: Contact,
    rate_hz: u16,
    purpose: Purpose,
    state: State,
    question: Option<Question>,
    samples: Samples,
    /// The error that it reported last.
    error: Option<ErrorCode>,
    has_measured: bool,
    /// The last message is none that the unit has sent.
    is_false: bool,
}

impl Machine {
    pub(crate) fn new(baud: u32, rate_hz: u16, purpose: Purpose, now_ns: i64) -> Self {
        let state = match purpose {
            Purpose::Listen => State::Listening,
            Purpose::Stream | Purpose::Probe => State::Asking(Query::Configure),
        };
        Self {
            contact: Contact::new(baud, SILENCE_NS, now_ns),
            rate_hz,
            purpose,
            state,
            question: None,
            samples: Samples::default(),
            error: None,
            has_measured: false,
            is_false: false,
        }
    }

    pub(crate) fn health(&self) -> &InertialHealth {
        self.samples.health()
    }

    fn ask(&mut self, query: Query) {
        self.state = State::Asking(query);
        self.question = Some(Question::new(query.patience(), self.contact.now_ns));
        self.asking(query);
    }

    fn asking(&mut self, query: Query) {
        match self.question.as_mut().map(|question| question.poll(self.contact.now_ns)) {
            Some(Due::Ask(attempt)) => {
                if attempt > 1 && query != Query::Configure {
                    self.contact.say(Event::Retried { step: query.step(), attempt });
                }
                let rate_hz = self.rate_hz;
                self.contact.send(|out| query.command(rate_hz).emit(out));
            }
            Some(Due::GivenUp) => self.given_up(query),
            _ => {}
        }
    }

    fn given_up(&mut self, query: Query) {
        match query {
            Query::Configure => {
                self.contact.round_failed(Event::NotFound { rounds: 1 });
                // A unit that got a command with a damaged length waits for its rest.
                self.contact.flush();
                self.rest();
            }
            // Who it is, is not needed.
            Query::Identify => self.answered(Query::Identify),
            Query::Idle => {
                self.contact.say(Event::GivenUp { step: query.step() });
                self.finish();
            }
            Query::SetOutputs | Query::Measure => {
                self.contact.round_failed(Event::GivenUp { step: query.step() });
                self.rest();
            }
        }
    }

    fn rest(&mut self) {
        self.question = None;
        self.state = State::Resting { until_ns: self.contact.now_ns + ROUND_NS };
    }

    fn finish(&mut self) {
        self.question = None;
        self.state = State::Done;
    }

    /// A question has its answer, or is not needed: the next one follows.
    fn answered(&mut self, query: Query) {
        match (query, self.purpose) {
            (Query::Configure, _) => self.ask(Query::Identify),
            (Query::Identify, Purpose::Probe) => self.finish(),
            (Query::Identify, _) => self.ask(Query::SetOutputs),
            (Query::SetOutputs, _) => self.ask(Query::Measure),
            (Query::Measure, _) => {
                self.question = None;
                self.contact.found();
                self.has_measured = false;
                self.contact.last_report_ns = self.contact.now_ns;
                self.samples.expect_anew();
                self.state = State::Measuring { since_ns: self.contact.now_ns };
            }
            (Query::Idle, _) => {
                self.contact.say(Event::Stopped);
                self.finish();
            }
        }
    }

    fn take(&mut self, offset: u64, length: usize, report: &Report<'_>) -> Result<(), WireError> {
        match report {
            Report::Data(items) => {
                let sample = Sample::of(items)?;
                self.measured(offset, length, &sample);
            }
            Report::WakeUp => self.woke_up(),
            Report::Error { code, .. } => {
                if self.error.replace(*code) != Some(*code) {
                    self.contact.say(Event::Inertial(InertialEvent::Error(*code)));
                }
                self.refused();
            }
            report => {
                if let State::Asking(query) = self.state
                    && query.is_answered_by(report)
                {
                    self.judge(query, report);
                }
            }
        }
        Ok(())
    }

    /// An answer of the kind that is awaited.
    fn judge(&mut self, query: Query, report: &Report<'_>) {
        match report {
            Report::DeviceId(id) => self.identified(*id),
            Report::Outputs(outputs) if !self.takes(outputs) => return self.rest(),
            _ => {}
        }
        self.answered(query);
    }

    fn identified(&mut self, id: DeviceId) {
        if !self.contact.info.class.is_empty() {
            return;
        }
        let mut name = ShortText::new();
        // There is room.
        let _ = match id {
            DeviceId::Short(number) => std::fmt::write(&mut name, format_args!("Xsens MTi {number:08X}")),
            DeviceId::Long(number) => {
                let number = u64::from_be_bytes(number);
                std::fmt::write(&mut name, format_args!("Xsens MTi {number:016X}"))
            }
        };
        self.contact.info.class.clone_from(&name);
        self.contact.say(Event::Identified(name));
    }

    /// Whether what the unit says it will send is enough.
    fn takes(&mut self, outputs: &Outputs) -> bool {
        match sample_rate_hz(outputs) {
            None => {
                self.contact.round_failed(Event::Inertial(InertialEvent::NotOffered));
                false
            }
            Some(rate_hz) => {
                if rate_hz != self.rate_hz && !self.contact.has_failed() {
                    self.contact.say(Event::Inertial(InertialEvent::RateKept { rate_hz }));
                }
                true
            }
        }
    }

    /// An error is the answer to what was asked last.
    fn refused(&mut self) {
        match self.state {
            State::Asking(Query::Identify) => self.answered(Query::Identify),
            State::Asking(query @ (Query::SetOutputs | Query::Measure)) => {
                self.contact.round_failed(Event::Refused { step: query.step() });
                self.rest();
            }
            _ => {}
        }
    }

    /// It was switched on: without an answer within half a second it measures as it was set before.
    fn woke_up(&mut self) {
        match self.state {
            State::Listening | State::Done => {}
            State::Asking(Query::Idle) => self.ask(Query::Idle),
            _ => {
                if self.has_measured {
                    self.contact.say(Event::PoweredOn);
                    self.has_measured = false;
                }
                self.contact.send(|out| Command::WakeUpAcknowledge.emit(out));
                self.ask(Query::Configure);
            }
        }
    }

    fn measured(&mut self, offset: u64, length: usize, sample: &Sample) {
        if self.state == State::Done {
            return;
        }
        let arrived = Arrived { offset, length, now_ns: self.contact.now_ns };
        let is_configured = self.is_configured();
        let readings = self.samples.take(arrived, sample, is_configured);
        self.is_false = is_configured && readings.is_none() && self.samples.takes_back();
        self.say_news();
        self.contact.info.has_fault = self.samples.has_fault();
        for reading in readings.into_iter().flatten().flatten() {
            self.hand_on(reading);
        }
    }

    /// A message with a good checksum that cannot be read.
    fn unreadable(&mut self) {
        self.samples.unreadable(self.is_configured());
        self.is_false = self.samples.takes_back();
        self.say_news();
    }

    /// A unit that was not told yet what to send need not send it.
    fn is_configured(&self) -> bool {
        matches!(self.state, State::Measuring { .. } | State::Listening)
    }

    fn say_news(&mut self) {
        while let Some(event) = self.samples.news() {
            self.contact.say(event);
        }
    }

    fn hand_on(&mut self, reading: InertialReading) {
        self.contact.measured();
        if matches!(self.state, State::Measuring { .. }) && !std::mem::replace(&mut self.has_measured, true) {
            self.contact.say(Event::Streaming);
        }
        self.contact.outputs.push(Output::Inertial(reading));
    }

    /// Whether nobody has ever answered.
    fn is_unknown(&self) -> bool {
        self.contact.has_failed() && self.contact.info.class.is_empty()
    }

    /// Until when a measurement must come.
    fn silence_deadline_ns(&self, since_ns: i64) -> i64 {
        if self.has_measured {
            self.contact.silence_deadline_ns()
        } else {
            since_ns.saturating_add(FIRST_SAMPLE_NS)
        }
    }

    fn measuring(&mut self, since_ns: i64) {
        if self.contact.now_ns >= self.silence_deadline_ns(since_ns) {
            self.contact.say_lost();
            self.has_measured = false;
            self.ask(Query::Configure);
        }
    }
}

impl PacketMachine for Machine {
    type Framing = XsensFraming;
    const HEADER: u8 = 0xFA;

    fn contact(&self) -> &Contact {
        &self.contact
    }

    fn contact_mut(&mut self) -> &mut Contact {
        &mut self.contact
    }

    fn begin(&mut self) {
        self.contact.say(Event::Untried);
        self.ask(Query::Configure);
    }

    fn packet(&mut self, offset: u64, bytes: &[u8]) -> Result<(), WireError> {
        self.is_false = false;
        let report = Message::parse(bytes).and_then(|message| message.report());
        if report.and_then(|report| self.take(offset, bytes.len(), &report)).is_err() {
            self.unreadable();
        }
        Ok(())
    }

    fn takes_back(&self) -> bool {
        self.is_false
    }

    fn time(&mut self) {
        match self.state {
            State::Asking(query) => self.asking(query),
            State::Resting { until_ns } if self.contact.now_ns >= until_ns => self.ask(Query::Configure),
            State::Measuring { since_ns } => self.measuring(since_ns),
            _ => {}
        }
    }

    fn stop(&mut self) {
        match self.state {
            State::Done | State::Listening => self.finish(),
            State::Asking(Query::Idle) => {}
            // Nobody has answered, so nothing was begun.
            State::Asking(Query::Configure) | State::Resting { .. } if self.is_unknown() => self.finish(),
            _ => self.ask(Query::Idle),
        }
    }

    fn deadline_ns(&self) -> i64 {
        match self.state {
            State::Asking(_) => self.question.as_ref().map_or(i64::MAX, Question::deadline_ns),
            State::Resting { until_ns } => until_ns,
            State::Measuring { since_ns } => self.silence_deadline_ns(since_ns),
            State::Listening | State::Done => i64::MAX,
        }
    }

    /// An answer alone is no stream.
    fn is_streaming(&self) -> bool {
        match self.state {
            State::Measuring { .. } => self.has_measured,
            state => state == State::Listening,
        }
    }

    fn is_done(&self) -> bool {
        self.state == State::Done
    }
}
