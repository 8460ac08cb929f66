//! The session of a SICK LMS 2xx: find its rate, set it up, let it stream, notice when it stops, start again.
//!
//! ```text
//! find rate -> confirm -> switch rate -> configuration -> status -> (installation -> write -> leave)? -> (variant)? -> stream
//!      ^                                                                                                           |
//!      +---------------------------- silence, garbage, switched on anew, a step given up -------------------------+
//! ```
//! One small function a state: `search.rs` up to the rate, `configure.rs` up to the variant, `stream.rs` for the rest.
//! Sources: SICK telegram listing 8007954 chapters 6 and 7; what other drivers get wrong is in the fact sheet, section 11.

mod configure;
mod reading;
mod search;
mod settings;
mod stream;

use biplane_wire::lms::{BROADCAST, DeviceDeframer, NAK, Reply, Request, Telegram};
use biplane_wire::{Counts, Item};

pub use reading::{Fan, MAX_LMS_BEAMS, ScanReading};
pub use settings::{LaserInfo, LaserSettings};

use super::retry::{Due, Patience, Question};
use super::{Event, Input, Output, Outputs, RequestBytes, Session, Step};
use crate::stamping::byte_time_ns;

/// After a refusal the device wants at least 30 ms of peace.
const PAUSE_NS: i64 = 60_000_000;
/// While an answer is awaited, a pause of this length on the line ends a telegram (the listing allows 14 ms).
const ANSWER_GAP_NS: i64 = 40_000_000;
/// While scans stream, the same; longer, because an adapter may hold bytes back, and a capture may be in any chunking. A telegram
/// that was really cut is found out by the next one anyway.
const STREAM_GAP_NS: i64 = 1_000_000_000;

/// What the session is for.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum Goal {
    Stream,
    Probe,
}

/// Where the session stands.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum State {
    FindRate { candidate: usize, rounds: u32 },
    ConfirmRate { candidate: usize, rounds: u32 },
    SwitchRate,
    Settle { until_ns: i64 },
    ConfirmSwitch,
    ReadConfiguration,
    ReadStatus,
    EnterInstallation,
    WriteConfiguration,
    LeaveInstallation,
    SetVariant,
    StartStream,
    Streaming { since_ns: i64 },
    Stopping,
    Listening,
    Done,
}

/// A session with one laser.
#[derive(Debug)]
pub struct LaserSession {
    deframer: DeviceDeframer,
    machine: Machine,
}

/// Everything but the deframer, so that a telegram can be lent to it.
#[derive(Debug)]
struct Machine {
    settings: LaserSettings,
    goal: Goal,
    state: State,
    question: Option<(Question, Request, Step)>,
    baud: u32,
    info: LaserInfo,
    outputs: Outputs,
    now_ns: i64,
    last_byte_ns: i64,
    last_frame_ns: i64,
    mode_said: bool,
    variant_said: bool,
    refused_rate: bool,
    has_streamed: bool,
    not_kept: u64,
}

impl LaserSession {
    /// A session that brings the laser to stream.
    #[must_use]
    pub fn streaming(settings: LaserSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Stream, now_ns);
        session.machine.enter_search(0, 0);
        session
    }

    /// A session that asks the laser what it is, changes nothing, and is done.
    #[must_use]
    pub fn probing(settings: LaserSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Probe, now_ns);
        session.machine.enter_search(0, 0);
        session
    }

    /// A session that only listens to what once came from a laser: it asks nothing, and takes configuration and variant
    /// from replies when there are any. The bytes may begin anywhere.
    #[must_use]
    pub fn listening(settings: LaserSettings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Stream, now_ns);
        session.machine.state = State::Listening;
        session
    }

    fn new(settings: LaserSettings, goal: Goal, now_ns: i64) -> Self {
        let machine = Machine {
            settings,
            goal,
            state: State::Done,
            question: None,
            baud: settings.baud,
            info: LaserInfo::default(),
            outputs: Outputs::default(),
            now_ns,
            last_byte_ns: now_ns,
            last_frame_ns: now_ns,
            mode_said: false,
            variant_said: false,
            refused_rate: false,
            has_streamed: false,
            not_kept: 0,
        };
        Self { deframer: DeviceDeframer::new(), machine }
    }

    /// What is known of the laser.
    #[must_use]
    pub fn info(&self) -> &LaserInfo {
        &self.machine.info
    }

    /// Intact scan telegrams that could not be read as a scan of this laser.
    #[must_use]
    pub fn not_kept(&self) -> u64 {
        self.machine.not_kept
    }

    /// Whether scans flow.
    #[must_use]
    pub fn is_streaming(&self) -> bool {
        matches!(self.machine.state, State::Streaming { .. } | State::Listening)
    }

    /// The input ends: what the deframer still holds is let go. Drain [`Session::poll`] afterwards.
    pub fn finish(&mut self) {
        self.deframer.finish();
        self.drain();
    }

    fn drain(&mut self) {
        while let Some(item) = self.deframer.next() {
            self.machine.item(item);
        }
    }

    fn take_bytes(&mut self, mut bytes: &[u8]) {
        if self.machine.gap_before(bytes.len()) {
            self.deframer.abandon();
            self.drain();
        }
        self.machine.last_byte_ns = self.machine.now_ns;
        while !bytes.is_empty() {
            let taken = self.deframer.push(bytes);
            bytes = bytes.get(taken..).unwrap_or_default();
            self.drain();
            if taken == 0 {
                break;
            }
        }
    }

    /// A stop request cuts the telegram that it meets; the answer sits behind the stump, which would wait for bytes
    /// that never come. So while an answer is awaited, a pause ends the telegram.
    fn give_up_stump(&mut self) {
        if self.deframer.buffered() > 0 && self.machine.stump_deadline_ns() <= self.machine.now_ns {
            self.deframer.abandon();
            self.drain();
        }
    }
}

impl Session for LaserSession {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.machine.now_ns = now_ns;
        match input {
            Input::Bytes(bytes) => self.take_bytes(bytes),
            Input::Time => self.give_up_stump(),
            Input::Stop => self.machine.stop(),
        }
        self.machine.time();
    }

    fn poll(&mut self) -> Output {
        match self.machine.outputs.pop() {
            Some(output) => output,
            None => {
                let stump_ns = match self.deframer.buffered() {
                    0 => i64::MAX,
                    _ => self.machine.stump_deadline_ns(),
                };
                Output::WaitUntil(self.machine.deadline_ns().min(stump_ns))
            }
        }
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
}

impl Machine {
    fn say(&mut self, event: Event) {
        self.outputs.push(Output::Event(event));
    }

    /// Opens a question and sends it at once.
    fn ask(&mut self, state: State, step: Step, request: Request, patience: Patience) {
        self.state = state;
        self.question = Some((Question::new(patience, self.now_ns), request, step));
        self.time();
    }

    /// Sends what is due, gives up what was asked too often, looks for silence.
    fn time(&mut self) {
        if let State::Settle { until_ns } = self.state
            && self.now_ns >= until_ns
        {
            self.settled();
        }
        if let Some((question, request, step)) = &mut self.question {
            match question.poll(self.now_ns) {
                Due::Nothing => {}
                Due::Ask(attempt) => {
                    let (request, step) = (request.clone(), *step);
                    self.send(&request);
                    if attempt > 1 && !matches!(self.state, State::FindRate { .. }) {
                        self.say(Event::Retried { step, attempt });
                    }
                }
                Due::GivenUp => {
                    let step = *step;
                    self.question = None;
                    self.given_up(step);
                }
            }
        }
        self.look_for_silence();
    }

    fn send(&mut self, request: &Request) {
        let mut bytes = [0; 64];
        if let Ok(length) = request.emit(BROADCAST, &mut bytes)
            && let Ok(bytes) = RequestBytes::from_slice(&bytes[..length])
        {
            self.outputs.push(Output::Write(bytes));
        }
    }

    fn item(&mut self, item: Item<'_>) {
        match item {
            Item::Frame { offset, bytes } => self.frame(offset, bytes),
            Item::Control { byte: NAK, .. } => self.ask_again(),
            Item::Control { .. } | Item::Skipped { .. } => {}
        }
    }

    fn frame(&mut self, offset: u64, bytes: &[u8]) {
        self.last_frame_ns = self.now_ns;
        let Ok(reply) = Telegram::parse(bytes).and_then(|telegram| telegram.reply()) else {
            self.not_kept += 1;
            return;
        };
        match reply {
            Reply::Scan(scan) => self.scan(offset, bytes.len(), &scan),
            Reply::Refused => self.refused(),
            Reply::PowerOn { .. } => self.powered_on(),
            other => {
                self.learn(&other);
                self.answered(&other);
            }
        }
    }

    /// An answer to whatever the state has asked; answers to other questions change nothing.
    fn answered(&mut self, reply: &Reply<'_>) {
        match self.state {
            State::FindRate { candidate, rounds } => self.find_rate_answered(candidate, rounds, reply),
            State::ConfirmRate { .. } => self.confirm_rate_answered(reply),
            State::SwitchRate => self.switch_rate_answered(reply),
            State::ConfirmSwitch => self.confirm_switch_answered(reply),
            State::ReadConfiguration => self.read_configuration_answered(reply),
            State::ReadStatus => self.read_status_answered(reply),
            State::EnterInstallation => self.enter_installation_answered(reply),
            State::WriteConfiguration => self.write_configuration_answered(reply),
            State::LeaveInstallation => self.leave_installation_answered(reply),
            State::SetVariant => self.set_variant_answered(reply),
            State::StartStream => self.start_stream_answered(reply),
            State::Stopping => self.stopping_answered(reply),
            State::Settle { .. } | State::Streaming { .. } | State::Listening | State::Done => {}
        }
    }

    /// No good answer in all attempts: what the state does without it.
    fn given_up(&mut self, step: Step) {
        match self.state {
            State::FindRate { candidate, rounds } | State::ConfirmRate { candidate, rounds } => {
                self.next_candidate(candidate, rounds);
            }
            _ => {
                self.say(Event::GivenUp { step });
                self.go_on_without(step);
            }
        }
    }

    fn go_on_without(&mut self, step: Step) {
        match self.state {
            State::SwitchRate => self.keep_rate(),
            State::ReadConfiguration => self.configuration_unknown(),
            State::ReadStatus => self.status_unknown(),
            State::EnterInstallation | State::WriteConfiguration => self.keep_units(),
            State::SetVariant => self.keep_variant(),
            State::Stopping => self.finish_stop(),
            _ => {
                let _ = step;
                self.enter_search(0, 0);
            }
        }
    }

    fn ask_again(&mut self) {
        let now_ns = self.now_ns;
        if let Some((question, ..)) = &mut self.question {
            question.refused(now_ns, PAUSE_NS);
        }
    }

    fn refused(&mut self) {
        if let Some((_, _, step)) = &self.question {
            let step = *step;
            if step != Step::FindRate {
                self.say(Event::Refused { step });
            }
            self.ask_again();
        }
    }

    /// Keeps what replies tell of the laser, whoever asked for them.
    fn learn(&mut self, reply: &Reply<'_>) {
        match reply {
            Reply::Type { text } => self.learn_type(*text),
            Reply::Config(config) => self.info.config = Some(config.clone()),
            Reply::ConfigWritten { config, .. } => self.info.config = Some(config.clone()),
            Reply::Variant { angle_deg, resolution_cdeg, .. } => {
                self.info.variant = Some((*angle_deg, *resolution_cdeg));
            }
            Reply::Status(status) => self.learn_status(status),
            _ => {}
        }
    }

    fn gap_before(&self, bytes: usize) -> bool {
        let on_the_line_ns = byte_time_ns(self.baud).saturating_mul(i64::try_from(bytes).unwrap_or(i64::MAX));
        let pause_ns = self.now_ns.saturating_sub(on_the_line_ns).saturating_sub(self.last_byte_ns);
        pause_ns > self.gap_ns()
    }

    fn gap_ns(&self) -> i64 {
        match self.state {
            State::Listening | State::Streaming { .. } => STREAM_GAP_NS,
            _ => ANSWER_GAP_NS,
        }
    }

    /// When an unfinished telegram is given up without further bytes; only while an answer is awaited.
    fn stump_deadline_ns(&self) -> i64 {
        match self.question {
            Some(_) => self.last_byte_ns.saturating_add(ANSWER_GAP_NS),
            None => i64::MAX,
        }
    }

    fn deadline_ns(&self) -> i64 {
        let question_ns = self.question.as_ref().map_or(i64::MAX, |(question, ..)| question.deadline_ns());
        let state_ns = match self.state {
            State::Settle { until_ns } => until_ns,
            State::Streaming { .. } => self.silence_deadline_ns(),
            _ => i64::MAX,
        };
        question_ns.min(state_ns)
    }
}

#[cfg(test)]
mod tests;
