//! From a connection to scans: who is it, how is it set, what must be written, stream; and back to the start
//! when nothing comes any more. Times are nanoseconds.

use biplane_wire::Item;
use biplane_wire::cola::{
    Dialect, Family, Kind, OutputRange, Scan, ScanConfig, ScanDataConfig, Telegram, parse_byte, parse_texts,
};

use crate::session::cola::event::ColaEvent;
use crate::session::cola::info::ColaInfo;
use crate::session::cola::query::Query;
use crate::session::cola::scan::ColaScan;
use crate::session::cola::settings::{ColaChange, ColaSettings};
use crate::session::device_session::Output;
use crate::session::event::Event;
use crate::session::lms::health::LaserHealth;
use crate::session::machine_session::{Goal, LaserMachine, Phase};
use crate::session::queues::Outputs;
use crate::session::timing::retry::{Due, Question};
use crate::types::device_name::of_bytes;

/// A stream is over when it brings no scan for so long: the slowest device sends 15 a second. Larger: a half
/// open connection is noticed later.
const SILENCE_NS: i64 = 1_000_000_000;
/// A device sends its first scan within a quarter of a second; one whose mirror was told another speed may
/// take this long.
const FIRST_SCAN_NS: i64 = 5_000_000_000;
/// The same after its rate was set.
const SPIN_UP_NS: i64 = 45_000_000_000;
/// A busy device is asked again after so long.
const BUSY_NS: i64 = 200_000_000;
/// A telegram counter that runs ahead by more was started anew.
const MAX_LOST: u16 = 10_000;
/// Code of a refusal: the device is busy.
const BUSY: u16 = 0xD;
/// Status bits of a scan: polluted window.
const POLLUTED: u8 = 2 | 4;

/// Where a session is.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum State {
    /// It only listens to what once came.
    Listening,
    /// A question is open.
    Asking(Query),
    /// Scans are awaited until then, or flow.
    Streaming,
    /// The connection shall be made anew.
    Reconnecting,
    /// Nothing more is to be done.
    Done,
}

/// What is said once a run, and what of it holds.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Reported {
    /// That the device stays as it is set.
    pub(super) kept: bool,
    /// Whether it stays so on this connection.
    pub(super) is_kept: bool,
    /// That scans come without ranges.
    no_ranges: bool,
}

/// The state machine.
#[derive(Debug)]
pub(crate) struct Machine {
    state: State,
    pub(super) outputs: Outputs,
    pub(super) info: ColaInfo,
    pub(super) health: LaserHealth,
    now_ns: i64,
    pub(super) settings: ColaSettings,
    pub(super) goal: Goal,
    question: Question,
    pub(super) change: ColaChange,
    /// The dialect in which the next question is asked.
    dialect: Dialect,
    /// Until when a scan must come.
    scan_by_ns: i64,
    /// A laser that does not measure is started.
    pub(super) start_measuring: bool,
    /// Counter and time of the last scan of this connection.
    last_scan: Option<(u16, u32)>,
    unanswered: u32,
    pub(super) reported: Reported,
}

impl LaserMachine for Machine {
    type Settings = ColaSettings;
    type Info = ColaInfo;
    type Scan = ColaScan;

    fn new(settings: ColaSettings, goal: Goal, now_ns: i64) -> Self {
        Self {
            state: State::Listening,
            outputs: Outputs::default(),
            info: ColaInfo::default(),
            health: LaserHealth::default(),
            now_ns,
            settings,
            goal,
            question: Question::new(Query::Ident.patience(), now_ns),
            change: ColaChange::default(),
            dialect: Dialect::B,
            scan_by_ns: i64::MAX,
            start_measuring: false,
            last_scan: None,
            unanswered: 0,
            reported: Reported::default(),
        }
    }

    fn begin(&mut self) {
        self.last_scan = None;
        self.ask(Query::Ident);
    }

    fn set_now(&mut self, now_ns: i64) {
        self.now_ns = now_ns;
    }

    fn time(&mut self) {
        match self.state {
            State::Asking(query) => self.poll_question(query),
            State::Streaming if self.now_ns >= self.scan_by_ns => self.silent(),
            _ => {}
        }
    }

    fn item(&mut self, item: Item<'_>, scan: &mut ColaScan) {
        let Item::Frame { offset, bytes } = item else { return };
        // Checked by the deframer: it cannot fail.
        let Ok(telegram) = Telegram::parse(bytes) else { return };
        if telegram.name == Scan::NAME && matches!(telegram.kind, Kind::Event | Kind::ReadAnswer) {
            (scan.offset, scan.length) = (offset, bytes.len());
            self.scan(&telegram, scan);
        } else if self.state == State::Listening {
            self.learn_of_recording(&telegram);
        } else if let State::Asking(query) = self.state {
            self.answer(query, &telegram);
        }
    }

    fn stop(&mut self) {
        match self.state {
            State::Streaming => self.ask(Query::Unsubscribe),
            State::Asking(Query::Unsubscribe) => {}
            _ => self.state = State::Done,
        }
    }

    fn phase(&self) -> Phase {
        match self.state {
            State::Listening => Phase::Listening,
            State::Asking(_) | State::Reconnecting => Phase::Asking,
            State::Streaming => Phase::Streaming,
            State::Done => Phase::Done,
        }
    }

    fn deadline_ns(&self) -> i64 {
        match self.state {
            State::Asking(_) => self.question.deadline_ns(),
            State::Streaming => self.scan_by_ns,
            State::Listening | State::Reconnecting | State::Done => i64::MAX,
        }
    }

    fn info(&self) -> &ColaInfo {
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
    fn ask(&mut self, query: Query) {
        self.state = State::Asking(query);
        self.question = Question::new(query.patience(), self.now_ns);
        self.poll_question(query);
    }

    fn poll_question(&mut self, query: Query) {
        match self.question.poll(self.now_ns) {
            Due::Nothing => {}
            Due::Ask(attempt) => {
                if attempt > 1 && query != Query::Ident {
                    self.outputs.say(Event::Retried { step: query.step(), attempt });
                }
                let (dialect, change) = (self.dialect, self.change);
                self.outputs.write(|out| query.emit(dialect, &change, out));
            }
            Due::GivenUp => self.given_up(query),
        }
    }

    fn given_up(&mut self, query: Query) {
        match query {
            Query::Unsubscribe => {
                self.outputs.say(Event::GivenUp { step: query.step() });
                self.state = State::Done;
                return;
            }
            Query::Ident => {
                self.unanswered += 1;
                if self.unanswered == 2 {
                    self.outputs.say(Event::Cola(ColaEvent::NoAnswer));
                }
                if self.unanswered.is_multiple_of(2) && self.goal == Goal::Probe {
                    self.outputs.say(Event::NotFound { rounds: self.unanswered });
                }
                // Real devices are silent in the wrong dialect; one that has answered keeps its own.
                if self.info.dialect.is_none() {
                    self.dialect = if self.dialect == Dialect::B { Dialect::A } else { Dialect::B };
                }
            }
            _ => self.outputs.say(Event::GivenUp { step: query.step() }),
        }
        self.reconnect();
    }

    fn reconnect(&mut self) {
        self.state = State::Reconnecting;
        self.outputs.push(Output::Reconnect);
    }

    fn silent(&mut self) {
        let is_first = self.last_scan.is_none();
        if is_first && self.settings.login && !self.start_measuring {
            self.start_measuring = true;
            self.ask(Query::Login);
            return;
        }
        let for_ns = if is_first { FIRST_SCAN_NS } else { SILENCE_NS };
        self.outputs.say(Event::Silent { for_ms: (for_ns / 1_000_000) as u32 });
        self.reconnect();
    }

    fn scan(&mut self, telegram: &Telegram<'_>, scan: &mut ColaScan) {
        let parsed = Scan::parse(telegram);
        let is_taken = parsed.as_ref().is_ok_and(|parsed| scan.take(parsed, self.info.family));
        let (true, Ok(parsed)) = (is_taken, parsed) else {
            self.health.not_kept += 1;
            if !std::mem::replace(&mut self.reported.no_ranges, true) {
                self.outputs.say(Event::Cola(ColaEvent::NoRanges));
            }
            return;
        };
        let stamp = (scan.telegram_counter, scan.scan_us);
        let before = self.last_scan.replace(stamp);
        if before == Some(stamp) {
            return;
        }
        let lost = before.map_or(0, |(counter, _)| stamp.0.wrapping_sub(counter).wrapping_sub(1));
        self.health.lost_telegrams += u64::from(if lost < MAX_LOST { lost } else { 0 });
        self.health.polluted_scans += u64::from(parsed.head.status[0] & POLLUTED != 0);
        self.health.dazzled_values += u64::from(scan.dazzled);
        if self.state == State::Streaming {
            self.scan_by_ns = self.now_ns.saturating_add(SILENCE_NS);
            self.start_measuring = false;
            self.check_scan(parsed.head.scan_frequency_chz, (scan.step_deg * 1e4).round() as u32);
            if before.is_none() {
                self.outputs.say(Event::Streaming);
            }
        }
        self.outputs.push(Output::TimedScan);
    }

    /// In a recording: what the device once answered.
    fn learn_of_recording(&mut self, telegram: &Telegram<'_>) {
        if Query::Ident.is_answered_by(telegram) {
            self.learn(Query::Ident, telegram);
        }
    }

    fn answer(&mut self, query: Query, telegram: &Telegram<'_>) {
        if telegram.kind == Kind::Error {
            return self.refused(query, telegram);
        }
        if !query.is_answered_by(telegram) {
            return;
        }
        self.answered(telegram.dialect);
        self.learn(query, telegram);
        let result = parse_byte(telegram).unwrap_or(u8::MAX);
        let next = match query {
            Query::Login if result != 1 => Some(Query::SafetyLogin),
            Query::SafetyLogin if result != 1 => {
                self.refuses(ColaEvent::LoginRefused);
                Some(Query::Subscribe)
            }
            Query::WriteScan => {
                self.check_scan_config(telegram);
                self.next(query)
            }
            _ => self.next(query),
        };
        self.go_on(query, next);
    }

    fn go_on(&mut self, query: Query, next: Option<Query>) {
        match next {
            Some(next) => self.ask(next),
            None if query == Query::Subscribe => self.stream(),
            None => self.state = State::Done,
        }
    }

    fn stream(&mut self) {
        self.state = State::Streaming;
        let is_slow = self.change.scan.is_some() || self.start_measuring;
        let wait_ns = if is_slow { SPIN_UP_NS } else { FIRST_SCAN_NS };
        self.scan_by_ns = self.now_ns.saturating_add(wait_ns);
    }

    /// The device has answered, in its own dialect.
    fn answered(&mut self, dialect: Dialect) {
        self.unanswered = 0;
        self.dialect = dialect;
        if self.info.dialect.replace(dialect) != Some(dialect) {
            self.outputs.say(Event::Cola(ColaEvent::Answers(dialect)));
        }
    }

    fn refused(&mut self, query: Query, telegram: &Telegram<'_>) {
        let code = telegram.error_code().unwrap_or_default();
        if query == Query::Ident && telegram.dialect != self.dialect {
            // It does not understand the dialect, and says so in its own.
            self.answered(telegram.dialect);
            return self.ask(Query::Ident);
        }
        self.answered(telegram.dialect);
        if code == BUSY {
            return self.question.refused(self.now_ns, BUSY_NS);
        }
        match query {
            Query::Login | Query::SafetyLogin => {
                self.refuses(ColaEvent::LoginRefused);
                self.ask(Query::Subscribe);
            }
            Query::Subscribe => self.question.refused(self.now_ns, BUSY_NS),
            Query::WriteScan | Query::WriteData | Query::WriteRange | Query::Save => {
                self.refuses(ColaEvent::SettingRefused { code });
                let next = self.next(query);
                self.go_on(query, next);
            }
            // The device does not know it: it is done without.
            _ => {
                let next = self.next(query);
                self.go_on(query, next);
            }
        }
    }

    fn learn(&mut self, query: Query, telegram: &Telegram<'_>) {
        let config = &mut self.info.config;
        match query {
            Query::Ident => {
                let [name, version] = parse_texts(telegram);
                self.info.family = Family::of_name(name);
                self.info.name = of_bytes(name.trim_ascii());
                self.info.firmware = of_bytes(version.trim_ascii());
                self.outputs.say(Event::Identified(self.info.name.clone()));
            }
            Query::Firmware => self.info.firmware = of_bytes(parse_texts(telegram)[0].trim_ascii()),
            Query::Serial => self.info.serial = of_bytes(parse_texts(telegram)[0].trim_ascii()),
            Query::State => self.info.state = parse_byte(telegram).ok(),
            Query::ReadScan => config.scan = ScanConfig::parse(telegram).ok(),
            Query::ReadData => config.data = ScanDataConfig::parse(telegram).ok(),
            Query::ReadRange => config.range = OutputRange::parse(telegram).ok(),
            Query::Save => self.outputs.say(Event::Cola(ColaEvent::Saved)),
            _ => {}
        }
    }
}
