//! From a line to scans: at which rate does it answer, in which mode is it, who is it, stream; and back to
//! the start when nothing comes any more. Times are nanoseconds.

use biplane_wire::Item;
use biplane_wire::scip::{Block, Parameters, Scan, ScanRequest, Status};

use crate::session::device_session::Output;
use crate::session::event::Event;
use crate::session::lms::health::LaserHealth;
use crate::session::machine_session::{Goal, LaserMachine, Phase};
use crate::session::queues::Outputs;
use crate::session::scip::clock::ScanClock;
use crate::session::scip::event::ScipEvent;
use crate::session::scip::geometry;
use crate::session::scip::info::ScipInfo;
use crate::session::scip::query::Query;
use crate::session::scip::rates::Rates;
use crate::session::scip::scan::{ScipScan, turns};
use crate::session::scip::settings::{ScipSettings, everything};
use crate::session::timing::line_watch::LineWatch;
use crate::session::timing::retry::{Due, Question};
use crate::types::byte_time::byte_time_ns;

/// A stream is over when it brings no scan for so long, or for some scans' time on a slow line. Larger: a
/// half open connection is noticed later.
const SILENCE_NS: i64 = 1_000_000_000;
const SILENT_SCANS: f64 = 2.5;
/// On a serial line a stream is also over when not even a byte comes for so long, or for some turns' time. An
/// adapter that holds bytes back does so for less. Larger: a device that was set otherwise is found later.
const QUIET_NS: i64 = 500_000_000;
const QUIET_TURNS: f64 = 2.5;
/// A reply that has begun is waited for, if it may be whole within so many times of a scan.
const LATE_SCAN: f64 = 1.2;
/// A device that was just asked may have to start its motor.
const FIRST_SCAN_NS: i64 = 3_000_000_000;
/// A device that refuses is asked again after so long.
const REFUSED_NS: i64 = 250_000_000;

/// Where a session is.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(super) enum State {
    /// It only listens to what once came.
    Listening,
    /// A question is open.
    Asking(Query),
    /// The line gets another rate; then this is asked.
    Settling(Query),
    /// Scans are awaited until then, or flow.
    Streaming,
    /// The connection shall be made anew.
    Reconnecting,
    /// Nothing more is to be done.
    Done,
}

/// What is said once a run, and how often something was tried.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Tries {
    pub(super) not_offered: bool,
    pub(super) no_ranges: bool,
    pub(super) assumed: bool,
    pub(super) is_verifying: bool,
    /// The device keeps a rate that is not the rig's.
    pub(super) rate_kept: bool,
    pub(super) detours: u8,
    pub(super) unanswered: u32,
    pub(super) not_found: bool,
}

/// The state machine.
#[derive(Debug)]
pub(crate) struct Machine {
    pub(super) state: State,
    pub(super) outputs: Outputs,
    pub(super) info: ScipInfo,
    pub(super) health: LaserHealth,
    now_ns: i64,
    pub(super) settings: ScipSettings,
    pub(super) goal: Goal,
    pub(super) question: Question,
    /// Rates of a serial line; `None` on a network.
    pub(super) rates: Option<Rates>,
    /// The rate of the line.
    pub(super) baud: u32,
    clock: ScanClock,
    /// Until when a scan must come, or the line has its new rate.
    pub(super) due_ns: i64,
    /// What the line brings while scans flow.
    line: LineWatch,
    has_scan: bool,
    pub(super) tries: Tries,
}

impl LaserMachine for Machine {
    type Settings = ScipSettings;
    type Info = ScipInfo;
    type Scan = ScipScan;

    fn new(settings: ScipSettings, goal: Goal, now_ns: i64) -> Self {
        Self {
            state: State::Listening,
            outputs: Outputs::default(),
            info: ScipInfo::default(),
            health: LaserHealth::default(),
            now_ns,
            settings,
            goal,
            question: Question::new(Query::Quit.patience(), now_ns),
            rates: settings.baud.map(Rates::new),
            baud: settings.baud.unwrap_or_default(),
            clock: ScanClock::default(),
            due_ns: i64::MAX,
            line: LineWatch::default(),
            has_scan: false,
            tries: Tries::default(),
        }
    }

    fn begin(&mut self) {
        self.begin_anew();
    }

    fn set_now(&mut self, now_ns: i64) {
        self.now_ns = now_ns;
    }

    fn time(&mut self) {
        match self.state {
            State::Asking(query) => self.poll_question(query),
            State::Settling(query) if self.now_ns >= self.due_ns => self.ask(query),
            State::Streaming if self.now_ns >= self.stream_due_ns() => self.silent(),
            _ => {}
        }
    }

    /// Text at the rate at which a question is open is a device that speaks there.
    fn received(&mut self, bytes: &[u8]) {
        self.line.take(self.now_ns, bytes);
        let is_text = |byte: &u8| matches!(byte, b'\n' | b' '..=b'~');
        let waits = matches!(self.state, State::Asking(Query::Quit | Query::Confirm | Query::Stop));
        if waits && bytes.len() >= 4 && bytes.iter().all(is_text) {
            self.question.acknowledge();
        }
    }

    fn rate_refused(&mut self, baud: u32) {
        let Some(rates) = &mut self.rates else { return };
        rates.lacks(baud);
        self.outputs.say(Event::RateRefused { baud });
        if !matches!(self.state, State::Listening | State::Done) {
            self.tries.rate_kept = true;
            self.look_at_next_rate();
        }
    }

    fn item(&mut self, item: Item<'_>, scan: &mut ScipScan) {
        let Item::Frame { offset, bytes } = item else { return };
        // Checked by the deframer: it cannot fail.
        let Ok(block) = Block::parse(bytes) else { return };
        match Scan::parse(&block) {
            Some(Ok(parsed)) => {
                (scan.offset, scan.length) = (offset, bytes.len());
                self.scan(&parsed, scan);
            }
            // Its lines have right sums and are not those of a scan: one was lost whole.
            Some(Err(_)) => self.health.rejected += 1,
            None => self.reply(&block),
        }
    }

    fn stop(&mut self) {
        match self.state {
            State::Streaming | State::Asking(Query::Start(_)) => self.ask(Query::Stop),
            State::Asking(Query::Stop) => {}
            _ => self.state = State::Done,
        }
    }

    fn phase(&self) -> Phase {
        match self.state {
            State::Listening => Phase::Listening,
            State::Asking(_) | State::Settling(_) | State::Reconnecting => Phase::Asking,
            State::Streaming => Phase::Streaming,
            State::Done => Phase::Done,
        }
    }

    fn deadline_ns(&self) -> i64 {
        match self.state {
            State::Asking(_) => self.question.deadline_ns(),
            State::Streaming => self.stream_due_ns(),
            State::Settling(_) => self.due_ns,
            State::Listening | State::Reconnecting | State::Done => i64::MAX,
        }
    }

    fn baud(&self) -> u32 {
        self.baud
    }

    fn info(&self) -> &ScipInfo {
        &self.info
    }

    fn health(&self) -> &LaserHealth {
        &self.health
    }

    fn outputs(&self) -> &Outputs {
        &self.outputs
    }

    fn outputs_mut(&mut self) -> &mut Outputs {
        &mut self.outputs
    }
}

impl Machine {
    pub(super) fn ask(&mut self, query: Query) {
        self.state = State::Asking(query);
        self.question = Question::new(query.patience(), self.now_ns);
        self.poll_question(query);
    }

    /// Changes the rate of the line, and asks then.
    pub(super) fn settle(&mut self, baud: u32, wait_ns: i64, query: Query) {
        if self.baud != baud {
            self.baud = baud;
            self.outputs.push(Output::SetBaud(baud));
        }
        self.state = State::Settling(query);
        self.due_ns = self.now_ns.saturating_add(wait_ns);
    }

    fn poll_question(&mut self, query: Query) {
        match self.question.poll(self.now_ns) {
            Due::Nothing => {}
            Due::Ask(attempt) => {
                if attempt > 1 {
                    self.outputs.say(Event::Retried { step: query.step(), attempt });
                }
                self.outputs.write(|out| query.emit(out));
            }
            Due::GivenUp => self.given_up(query),
        }
    }

    fn silent(&mut self) {
        let for_ns = match (self.has_scan, self.now_ns < self.due_ns) {
            (true, true) => self.now_ns.saturating_sub(self.line.last_byte_ns()),
            (true, false) => self.silence_ns(),
            (false, _) => FIRST_SCAN_NS,
        };
        self.outputs.say(Event::Silent { for_ms: (for_ns / 1_000_000) as u32 });
        self.look_again();
    }

    /// Until when a stream goes on as it is. A serial line that brings no byte is noticed sooner, and a stop
    /// request does not cut a reply that may be the scan that is awaited.
    fn stream_due_ns(&self) -> i64 {
        if self.rates.is_none() || !self.has_scan {
            return self.due_ns;
        }
        let late_ns = (LATE_SCAN * self.scan_ns()) as i64;
        let reply_due_ns = self.line.reply_since_ns().saturating_add(late_ns);
        let scan_due_ns = self.due_ns.max(reply_due_ns.min(self.due_ns.saturating_add(late_ns)));
        scan_due_ns.min(self.line.last_byte_ns().saturating_add(self.quiet_ns()))
    }

    /// How long a stream may bring no scan: a slow line lets only some of them through.
    fn silence_ns(&self) -> i64 {
        SILENCE_NS.max((SILENT_SCANS * self.scan_ns()) as i64)
    }

    /// How long a stream may bring no byte.
    fn quiet_ns(&self) -> i64 {
        QUIET_NS.max((QUIET_TURNS * self.turns_ns()) as i64)
    }

    /// The turns of a scan, and its time on a serial line behind them, nanoseconds.
    fn scan_ns(&self) -> f64 {
        let Some(parameters) = &self.info.parameters else { return 0.0 };
        let request = self.request(parameters);
        let characters = 3 * request.values() * (1 + usize::from(request.with_intensity));
        let line_ns = self.rates.as_ref().map_or(0, |_| byte_time_ns(self.baud) * characters as i64);
        self.turns_ns() + line_ns as f64
    }

    fn turns_ns(&self) -> f64 {
        let Some(parameters) = &self.info.parameters else { return 0.0 };
        parameters.turn_ns() * turns(&self.request(parameters))
    }

    /// What is asked of this device.
    pub(super) fn request(&self, parameters: &Parameters) -> ScanRequest {
        self.settings.request(parameters).unwrap_or_else(|_| everything(parameters))
    }

    fn reply(&mut self, block: &Block<'_>) {
        match self.state {
            State::Listening => self.learn(block),
            State::Asking(query) if query.is_answered_by(block) => self.answer(query, block),
            State::Streaming => self.status(block.status),
            _ => {}
        }
    }

    /// A stream says how the device is.
    fn status(&mut self, status: Status) {
        let Status::Code(code) = status else { return };
        if status.is_defect() {
            self.outputs.say(Event::Scip(ScipEvent::Defect { code }));
        } else if status.is_verifying() && !std::mem::replace(&mut self.tries.is_verifying, true) {
            self.outputs.say(Event::Scip(ScipEvent::Verifying));
        }
        if status.is_verifying() {
            self.due_ns = self.now_ns.saturating_add(FIRST_SCAN_NS);
        }
    }

    fn scan(&mut self, parsed: &Scan<'_>, scan: &mut ScipScan) {
        let parameters = match (self.info.parameters, self.state) {
            (Some(parameters), _) => parameters,
            (None, State::Listening) => self.assume(&parsed.request),
            // Left over from before the device was asked what it is.
            (None, _) => return,
        };
        if !scan.take(parsed, &parameters) {
            self.health.not_kept += 1;
            if !std::mem::replace(&mut self.tries.no_ranges, true) {
                self.outputs.say(Event::Scip(ScipEvent::NoRanges));
            }
            return;
        }
        let nominal_us = turns(&parsed.request) * parameters.turn_ns() * 1e-3;
        scan.time = self.clock.take(parsed.clock_ms, self.now_ns, nominal_us);
        scan.counter = scan.counter.wrapping_add(1);
        if self.rates.is_none() {
            self.health.lost_telegrams += u64::from(scan.time.missing);
        } else {
            self.health.left_out_scans += u64::from(scan.time.missing);
        }
        if self.state == State::Streaming {
            self.due_ns = self.now_ns.saturating_add(self.silence_ns());
            self.tries.is_verifying = false;
            if !std::mem::replace(&mut self.has_scan, true) {
                self.outputs.say(Event::Streaming);
            }
        }
        self.outputs.push(Output::TimedScan);
    }

    /// Geometry of a device whose answers are not in the recording.
    fn assume(&mut self, request: &ScanRequest) -> Parameters {
        if !std::mem::replace(&mut self.tries.assumed, true) {
            self.outputs.say(Event::Scip(ScipEvent::GeometryAssumed));
        }
        geometry::of_request(request)
    }

    /// Scans were asked for.
    pub(super) fn stream(&mut self) {
        self.state = State::Streaming;
        self.line.begin(self.now_ns);
        self.has_scan = false;
        self.due_ns = self.now_ns.saturating_add(FIRST_SCAN_NS);
    }

    /// The device is asked again after a pause, if any attempt is left.
    pub(super) fn ask_later(&mut self) {
        self.question.refused(self.now_ns, REFUSED_NS);
    }
}
