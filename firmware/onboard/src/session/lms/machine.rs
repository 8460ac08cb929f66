//! What leads a laser's session from one state to the next.
//!
//! Each state asks one question; the answer, or its absence, goes to the small machine of its concern
//! (`BaudSearch`, `configure`, `Writing`, `Stream`, `Stop`), which says what is [`Next`]. Times are
//! nanoseconds.

use biplane_wire::Item;
use biplane_wire::lms::{ACK, NAK, Reply, Telegram};

use crate::session::event::{Event, Step};
use crate::session::lms::device::{Device, Goal, News};
use crate::session::lms::dialogue::{Dialogue, Next, State};
use crate::session::lms::scan::ranges::{Measured, Unpublished};
use crate::session::lms::setup::baud_search::{self, BaudSearch};
use crate::session::lms::setup::configure;
use crate::session::lms::setup::settings::LaserSettings;
use crate::session::lms::setup::write::{self, Writing};
use crate::session::lms::streaming::line_times::LineTimes;
use crate::session::lms::streaming::stop::{self, Stop};
use crate::session::lms::streaming::stream::{self, Source, Stream};

/// A clock that is set moves by this at least, nanoseconds; less is a pause of the line.
const CLOCK_STEP_NS: i64 = 1_000_000_000;
/// While an answer is awaited, a pause of this length on the line ends a telegram (the listing allows 14 ms).
const ANSWER_GAP_NS: i64 = 40_000_000;
/// While scans stream none does: an adapter may hold bytes back, the host may have stood still, and a capture
/// may be in any chunking. A telegram that was really cut is found out by the next one.
const STREAM_GAP_NS: i64 = i64::MAX;

/// Everything but the deframer, so that a telegram can be lent to it.
#[derive(Debug)]
pub(crate) struct Machine {
    pub(crate) talk: Dialogue,
    pub(crate) times: LineTimes,
    pub(crate) device: Device,
    search: BaudSearch,
    writing: Writing,
    pub(crate) stream: Stream,
    stop: Stop,
}

impl Machine {
    pub(crate) fn new(settings: LaserSettings, goal: Goal, now_ns: i64) -> Self {
        Self {
            talk: Dialogue::new(settings.baud, now_ns),
            times: LineTimes::new(now_ns),
            device: Device::new(settings, goal),
            search: BaudSearch::new(settings.baud),
            writing: Writing::default(),
            stream: Stream::default(),
            stop: Stop::default(),
        }
    }

    /// Does what follows, and what follows from that.
    pub(crate) fn go(&mut self, mut next: Next) {
        let Self { talk, device, search, writing, stream, .. } = self;
        loop {
            next = match next {
                Next::Stay => return,
                Next::Asked => return self.time(),
                Next::Refused => return self.refused(),
                Next::Streaming => return self.enter_streaming(),
                Next::Done => return talk.finish(),
                Next::Search { poll } => search.enter(talk, device, poll),
                Next::SearchAgain => search.restart(talk, device, self.stop.is_asked()),
                Next::ReadConfiguration => {
                    stream.is_interrupted();
                    configure::read_configuration(talk, device)
                }
                Next::Write => writing.enter(talk, device),
                Next::SetVariant if self.stop.is_asked() => Next::Stop,
                Next::SetVariant => configure::set_variant(talk, device),
                Next::StartStream => stream.start(talk, device),
                Next::Stop => stop::enter(talk),
            };
        }
    }

    /// Looks for the device at all rates.
    pub(crate) fn begin(&mut self) {
        self.go(Next::Search { poll: 0 });
    }

    /// Only listens.
    pub(crate) fn listen(&mut self) {
        self.talk.state = State::Listening;
    }

    /// The device shall be left idle.
    pub(crate) fn stop(&mut self) {
        let next = self.stop.ask(&self.talk);
        self.go(next);
    }

    /// The port does not run at this rate.
    pub(crate) fn rate_refused(&mut self, baud: u32) {
        let next = self.search.rate_refused(&mut self.talk, baud);
        self.go(next);
    }

    /// The port is there again. A laser that streamed is listened to first; one that was looked for is asked
    /// where it likely is.
    pub(crate) fn port_back(&mut self) {
        self.search.port_back(&mut self.talk, self.device.settings.baud);
        self.times.port_back(self.talk.now_ns, self.talk.state == State::Streaming);
        if self.talk.state.is_searching() {
            self.go(Next::SearchAgain);
        }
    }

    /// Bytes have come: a line on which nothing came for long may be that of a device that is being switched
    /// on.
    pub(crate) fn received_bytes(&mut self) {
        let now_ns = self.talk.now_ns;
        let silence_ns = now_ns.saturating_sub(self.times.last_byte_ns);
        self.times.received_after(now_ns, silence_ns, self.talk.state == State::Streaming);
        self.search.received_after(&self.talk, self.times.listened_ns(now_ns, silence_ns));
        self.times.last_byte_ns = now_ns;
    }

    /// Sends what is due, gives up what was asked too often, looks for silence.
    pub(crate) fn time(&mut self) {
        if let State::Settle { until_ns } = self.talk.state
            && self.talk.now_ns >= until_ns
        {
            let next = baud_search::settled(&mut self.talk);
            self.go(next);
        }
        self.stop.end_search(&mut self.talk);
        let next = self.search.look_for_another_rate(&mut self.talk, self.times.last_byte_ns);
        self.go(next);
        if let Some(step) = self.talk.send_due() {
            let next = self.given_up(step);
            self.go(next);
        }
        self.look_for_silence();
    }

    fn look_for_silence(&mut self) {
        if self.talk.state != State::Streaming || self.talk.now_ns < self.silence_deadline_ns() {
            return;
        }
        self.talk.say(self.times.outage(self.talk.now_ns));
        self.search.forget_refusal();
        self.go(Next::SearchAgain);
    }

    pub(crate) fn item(&mut self, item: Item<'_>) {
        match item {
            Item::Frame { offset, bytes } => self.frame(offset, bytes),
            Item::Control { byte: NAK, .. } => self.talk.ask_again(),
            Item::Control { byte: ACK, .. } => self.talk.acknowledged(),
            Item::Control { .. } => {}
            Item::Skipped { count, .. } => self.talk.skipped(count),
        }
    }

    /// The deframer's account.
    pub(crate) fn note_bad_checksums(&mut self, bad_checksums: u64) {
        self.times.note_bad_checksums(self.talk.now_ns, bad_checksums);
    }

    fn frame(&mut self, offset: u64, bytes: &[u8]) {
        self.times.frame(self.talk.now_ns);
        let Ok(telegram) = Telegram::parse(bytes) else { return };
        let Ok(reply) = telegram.reply() else {
            self.device.health.not_kept += 1;
            return;
        };
        let status = telegram.status().unwrap_or_default();
        let measured = match reply {
            Reply::Scan(scan) => Measured::Scan(scan),
            Reply::Pairs(pairs) => Measured::Pairs(pairs),
            Reply::S14(scan) => Measured::S14(scan),
            Reply::FieldValues { .. } | Reply::Cartesian { .. } => {
                return stream::unpublished(
                    &mut self.talk,
                    &mut self.device,
                    Unpublished::Form(telegram.code()),
                );
            }
            Reply::Refused => return self.refused(),
            Reply::PowerOn { .. } => return self.powered_on(),
            other => {
                self.device.info.status = Some(status);
                self.learn(&other);
                let next = self.answered(&other);
                return self.go(next);
            }
        };
        let (address, code) = (telegram.address(), telegram.code());
        self.measured(&Source { offset, length: bytes.len(), address, code, status }, &measured);
    }

    /// Keeps what replies tell of the laser, whoever asked for them.
    fn learn(&mut self, reply: &Reply<'_>) {
        match self.device.learn(reply) {
            News::None => {}
            News::Settings => self.stream.settings_reported(&self.device),
            // Another type is another device: what the one before refused says nothing of it.
            News::Type(name) => {
                self.writing = Writing::default();
                self.stream.forget_refusal();
                self.talk.event_dedup.forget_device();
                self.talk.say(Event::Identified(name));
            }
        }
    }

    /// An answer to whatever the state has asked; answers to other questions change nothing.
    fn answered(&mut self, reply: &Reply<'_>) -> Next {
        let Self { talk, device, search, writing, .. } = self;
        let configured_baud = device.settings.baud;
        match (talk.state, reply) {
            (State::FindRate { .. }, Reply::Mode(_)) if self.stop.is_asked() => stop::answered(talk, reply),
            (State::FindRate { poll }, Reply::Mode(_)) => baud_search::confirm(talk, poll),
            (State::ConfirmRate { .. }, Reply::Type { .. }) => search.confirmed(talk, device),
            (State::SwitchRate, Reply::Mode(result)) => {
                baud_search::switch_answered(talk, *result, configured_baud)
            }
            (State::ConfirmSwitch, Reply::Type { .. }) => search.switched(talk),
            (State::ReadConfiguration, Reply::Config(_)) => configure::read_status(talk, device),
            (State::ReadStatus, Reply::Status(_)) => configure::read_faults(talk, device),
            (State::ReadFaults, Reply::Errors(_)) => configure::all_read(talk, device),
            (State::ReadAgain, Reply::Config(config)) => writing.read_again_answered(talk, device, config),
            (State::EnterInstallation, Reply::Mode(result)) => {
                writing.installation_answered(talk, device, *result)
            }
            (State::WriteConfiguration, Reply::ConfigWritten { accepted, .. }) => {
                writing.write_answered(talk, *accepted)
            }
            (State::LeaveInstallation, Reply::Mode(_)) => write::read_back(talk),
            (State::ReadBack, Reply::Config(held)) => {
                writing.read_back_answered(talk, device, held, self.stop.is_asked())
            }
            (State::SetVariant, Reply::Variant { accepted, angle_deg, resolution_cdeg }) => {
                let taken = accepted.then_some((*angle_deg, *resolution_cdeg));
                configure::variant_answered(talk, device, taken)
            }
            (State::StartStream, Reply::Mode(result)) => stream::start_answered(*result),
            (State::Stopping, Reply::Mode(_)) => stop::answered(talk, reply),
            _ => Next::Stay,
        }
    }

    /// No good answer in all attempts: what the state does without it.
    fn given_up(&mut self, step: Step) -> Next {
        if let State::FindRate { poll } | State::ConfirmRate { poll } = self.talk.state {
            return Next::Search { poll: poll + 1 };
        }
        self.talk.say(Event::GivenUp { step });
        let Self { talk, device, search, writing, stream, .. } = self;
        match talk.state {
            State::SwitchRate => search.keep_rate(talk, device.settings.baud),
            State::ConfirmSwitch => search.switch_failed(),
            State::ReadConfiguration => configure::read_status(talk, device),
            State::ReadStatus => configure::read_faults(talk, device),
            State::ReadFaults => configure::all_read(talk, device),
            State::ReadAgain => write::keep_configuration(talk, device),
            State::EnterInstallation => writing.installation_failed(talk),
            State::WriteConfiguration => write::leave_installation(talk),
            State::ReadBack => writing.read_back_failed(self.stop.is_asked()),
            State::SetVariant => configure::keep_variant(talk, device),
            State::StartStream => stream.start_failed(talk, device),
            State::Stopping => Next::Done,
            _ => Next::SearchAgain,
        }
    }

    /// The device says no to what it was asked.
    fn refused(&mut self) {
        let Some(step) = self.talk.open.as_ref().map(|open| open.step) else { return };
        let next = match self.talk.state {
            State::WriteConfiguration => self.writing.write_refused(&mut self.talk),
            // It would refuse it again; that it keeps its rate is all that there is to say.
            State::SwitchRate => self.search.keep_rate(&mut self.talk, self.device.settings.baud),
            State::StartStream => {
                self.talk.say(Event::Refused { step });
                self.stream.start_refused(&mut self.talk, &self.device)
            }
            State::FindRate { .. } => {
                self.talk.ask_again();
                Next::Stay
            }
            _ => {
                self.talk.refused(step);
                Next::Stay
            }
        };
        self.go(next);
    }

    fn enter_streaming(&mut self) {
        self.search.is_at(self.talk.baud);
        self.times.stream_begins(self.talk.now_ns);
        self.stream.begin(&mut self.talk, &mut self.device);
    }

    fn measured(&mut self, source: &Source, measured: &Measured<'_>) {
        if self.talk.state == State::StartStream {
            self.enter_streaming();
        }
        self.stream.measured(&mut self.talk, &mut self.device, source, measured);
        baud_search::received_while_searching(&mut self.talk);
    }

    /// The device has lost everything but its EEPROM, its rate first of all: it is at the rate at which it
    /// says so.
    fn powered_on(&mut self) {
        self.talk.say(Event::PoweredOn);
        self.search.powered_on();
        self.talk.event_dedup.forget_failures();
        self.stream.powered_on();
        match self.talk.state {
            State::Listening => self.stream.settings_reported(&self.device),
            State::Stopping | State::Done => {}
            State::FindRate { .. } | State::ConfirmRate { .. } => {
                baud_search::received_while_searching(&mut self.talk);
                self.talk.ask_again();
            }
            _ => {
                self.search.is_at(self.talk.baud);
                self.go(Next::SearchAgain);
            }
        }
    }

    /// Whether a pause before these bytes has ended the telegram before.
    pub(crate) fn gap_before(&self, bytes: usize) -> bool {
        let Dialogue { state, now_ns, .. } = self.talk;
        let begun_ns = now_ns.saturating_sub(self.talk.transfer_ns(bytes));
        let pause_ns = begun_ns.saturating_sub(self.times.last_byte_ns);
        // In a capture, a pause of seconds within a telegram is more likely a clock that was set ahead: if
        // nothing is missing, the telegram is whole, and if something is, the deframer finds the next one
        // inside.
        let is_step = state == State::Listening && pause_ns >= CLOCK_STEP_NS;
        let gap_ns = match state {
            State::Listening | State::Streaming => STREAM_GAP_NS,
            _ => ANSWER_GAP_NS,
        };
        pause_ns > gap_ns && !is_step
    }

    /// When an unfinished telegram is given up without further bytes; only while an answer is awaited.
    pub(crate) fn partial_frame_deadline_ns(&self) -> i64 {
        match self.talk.open {
            Some(_) => self.times.last_byte_ns.saturating_add(ANSWER_GAP_NS),
            None => i64::MAX,
        }
    }

    fn silence_deadline_ns(&self) -> i64 {
        self.times.silence_deadline_ns(self.stream.period_ns(&self.talk, &self.device))
    }

    pub(crate) fn deadline_ns(&self) -> i64 {
        let state_ns = match self.talk.state {
            State::Settle { until_ns } => until_ns,
            State::Streaming => self.silence_deadline_ns(),
            State::FindRate { .. } => self.search.wake_ns().min(self.stop.deadline_ns()),
            _ => i64::MAX,
        };
        self.talk.deadline_ns().min(state_ns)
    }
}
