//! What is asked behind an answer, and what becomes of a question without one.

use biplane_wire::scip::{Block, Command, Parameters, Status};

use crate::session::device_session::Output;
use crate::session::event::Event;
use crate::session::machine_session::Goal;
use crate::session::scip::event::ScipEvent;
use crate::session::scip::machine::{Machine, State};
use crate::session::scip::query::Query;
use crate::types::device_name::{ShortText, of_bytes};

/// So much time passes between a device's answer at the old rate and the new rate.
const SETTLE_NS: i64 = 100_000_000;
/// So often a device may be led out of another mode before it is looked for anew.
const MAX_DETOURS: u8 = 4;
/// The reply of a device that has the rate already.
const HAS_RATE: Status = Status::Code(*b"03");

impl Machine {
    /// A line or a connection is there: everything begins.
    pub(super) fn begin_anew(&mut self) {
        self.tries.detours = 0;
        match &mut self.rates {
            Some(rates) => {
                rates.restart();
                self.look_at_next_rate();
            }
            None => self.ask(Query::Quit),
        }
    }

    /// The device is gone, or does not do what it is asked.
    pub(super) fn look_again(&mut self) {
        if self.rates.is_some() {
            return self.begin_anew();
        }
        self.state = State::Reconnecting;
        self.outputs.push(Output::Reconnect);
    }

    pub(super) fn look_at_next_rate(&mut self) {
        let Some(rates) = &mut self.rates else { return };
        let baud = rates.next();
        self.settle(baud, 0, Query::Quit);
    }

    pub(super) fn given_up(&mut self, query: Query) {
        match query {
            // It speaks, and has not heard: a request can get lost while it streams.
            Query::Quit if self.question.is_acknowledged() && self.tries.detours < MAX_DETOURS => {
                self.tries.detours += 1;
                self.ask(Query::Quit);
            }
            Query::Quit => self.not_found(),
            Query::Version => self.ask(Query::Parameters),
            Query::Stop => {
                self.outputs.say(Event::GivenUp { step: query.step() });
                self.state = State::Done;
            }
            Query::Confirm => {
                self.tries.rate_kept = true;
                self.look_again();
            }
            _ => {
                self.outputs.say(Event::GivenUp { step: query.step() });
                self.look_again();
            }
        }
    }

    fn not_found(&mut self) {
        self.tries.unanswered += 1;
        self.tries.detours = 0;
        match &self.rates {
            Some(rates) => {
                let rounds = rates.rounds();
                if rounds > 0 && (!self.tries.not_found || self.goal == Goal::Probe) {
                    self.tries.not_found = true;
                    self.outputs.say(Event::NotFound { rounds });
                }
                self.look_at_next_rate();
            }
            None => {
                if self.tries.unanswered == 8 {
                    self.outputs.say(Event::Scip(ScipEvent::NoAnswer));
                }
                if self.tries.unanswered.is_multiple_of(8) && self.goal == Goal::Probe {
                    self.outputs.say(Event::NotFound { rounds: self.tries.unanswered });
                }
                self.look_again();
            }
        }
    }

    /// A reply to the question that is open.
    pub(super) fn answer(&mut self, query: Query, block: &Block<'_>) {
        self.tries.unanswered = 0;
        self.tries.not_found = false;
        let is_ok = block.status == Status::OK;
        match query {
            Query::Quit | Query::Confirm => self.quit(query, block.status),
            Query::Scip2 => {
                self.outputs.say(Event::Scip(ScipEvent::LeftScip1));
                self.ask(Query::Quit);
            }
            Query::LeaveTime => self.ask(Query::Quit),
            Query::Version => {
                self.learn(block);
                self.ask(Query::Parameters);
            }
            Query::Parameters if !self.has_parameters(block) => self.ask_later(),
            Query::Parameters => {
                let next = if self.goal == Goal::Probe { Query::Information } else { self.next() };
                self.ask(next);
            }
            Query::Information => {
                self.learn(block);
                self.state = State::Done;
            }
            Query::Baud(baud) => self.baud_answered(baud, block.status),
            Query::Start(_) if is_ok => self.stream(),
            Query::Start(_) => self.start_refused(block.status),
            Query::Stop => {
                self.outputs.say(Event::Stopped);
                self.state = State::Done;
            }
        }
    }

    /// In which mode it is shows in how it takes a stop request.
    fn quit(&mut self, query: Query, status: Status) {
        let detour = match status {
            Status::OK => None,
            Status::Scip1(_) => Some(Query::Scip2),
            Status::Code(_) => Some(Query::LeaveTime),
        };
        let Some(detour) = detour else { return self.found(query) };
        self.tries.detours += 1;
        if self.tries.detours > MAX_DETOURS {
            if detour == Query::Scip2 {
                self.outputs.say(Event::Scip(ScipEvent::Scip1Only));
            }
            return self.not_found();
        }
        if detour == Query::LeaveTime {
            self.outputs.say(Event::Scip(ScipEvent::LeftTimeMode));
        }
        self.ask(detour);
    }

    fn found(&mut self, query: Query) {
        self.tries.detours = 0;
        let Some(rates) = &mut self.rates else { return self.ask(Query::Version) };
        rates.is_at(self.baud);
        let (baud, wanted) = (self.baud, rates.wanted);
        let event = if query == Query::Confirm { Event::RateSet { baud } } else { Event::Found { baud } };
        self.outputs.say(event);
        self.info.found_baud.get_or_insert(baud);
        let changes = baud != wanted && !self.tries.rate_kept && self.goal == Goal::Stream;
        self.ask(if changes { Query::Baud(wanted) } else { Query::Version });
    }

    fn baud_answered(&mut self, baud: u32, status: Status) {
        if status == Status::OK || status == HAS_RATE {
            return self.settle(baud, SETTLE_NS, Query::Confirm);
        }
        self.tries.rate_kept = true;
        self.outputs.say(Event::RateKept { wanted: baud, kept: self.baud });
        self.ask(Query::Version);
    }

    fn start_refused(&mut self, status: Status) {
        if let Status::Code(code) = status {
            self.outputs.say(Event::Scip(ScipEvent::Refused { code }));
        }
        self.ask_later();
    }

    /// What is asked of a device that is known.
    fn next(&mut self) -> Query {
        let Some(parameters) = self.info.parameters else { return Query::Parameters };
        let refused = self.settings.request(&parameters).err();
        self.health.differs = refused.is_some();
        if let Some(offer) = refused
            && !std::mem::replace(&mut self.tries.not_offered, true)
        {
            self.outputs.say(Event::Scip(ScipEvent::NotOffered(offer)));
        }
        Query::Start(self.request(&parameters))
    }

    fn has_parameters(&mut self, block: &Block<'_>) -> bool {
        let is_whole = matches!(Parameters::parse(block), Some(Ok(_)));
        self.learn(block);
        is_whole
    }

    /// Keeps what a device says of itself.
    pub(super) fn learn(&mut self, block: &Block<'_>) {
        let value = |key: &[u8]| block.value(key).map(|value| of_bytes(value.trim_ascii()));
        let keep = |kept: &mut ShortText, key: &[u8]| {
            if let Some(text) = value(key) {
                *kept = text;
            }
        };
        match block.request.command {
            Command::Version => {
                keep(&mut self.info.firmware, b"FIRM");
                keep(&mut self.info.serial, b"SERI");
                if self.info.model.is_empty() {
                    keep(&mut self.info.model, b"PROD");
                }
            }
            Command::Parameters => {
                keep(&mut self.info.model, b"MODL");
                if let Some(Ok(parameters)) = Parameters::parse(block) {
                    self.info.parameters = Some(parameters);
                    let model = self.info.model.clone();
                    self.outputs.say(Event::Identified(model));
                }
            }
            Command::Information => {
                keep(&mut self.info.state, b"STAT");
                keep(&mut self.info.laser, b"LASR");
            }
            _ => {}
        }
    }
}
