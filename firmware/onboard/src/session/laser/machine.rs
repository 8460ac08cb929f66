//! The state of a laser's session and what leads from one state to the next.
//!
//! Each state asks one question; the answer, or its absence, goes to that state's own small function in `search.rs`,
//! `configure.rs`, `write.rs` or `stream.rs`. Times are nanoseconds.

use biplane_wire::Item;
use biplane_wire::lms::{ACK, BROADCAST, NAK, Reply, Request, Telegram};

use super::condition::Condition;
use super::health::LaserHealth;
use super::index_watch::IndexWatch;
use super::plausible::Plausibility;
use super::reading::{Measured, Unpublished};
use super::said::Said;
use super::settings::{LaserInfo, LaserSettings};
use super::stream::Source;
use super::write::Writing;
use crate::session::retry::{Due, Patience, Question};
use crate::session::{Event, Outputs, Step};
use crate::stamping::byte_time_ns;

/// After a refusal the device wants at least 30 ms of peace.
const PAUSE_NS: i64 = 60_000_000;
/// A clock that is set moves by this at least, nanoseconds; less is a pause of the line.
const CLOCK_STEP_NS: i64 = 1_000_000_000;
/// While an answer is awaited, a pause of this length on the line ends a telegram (the listing allows 14 ms).
const ANSWER_GAP_NS: i64 = 40_000_000;
/// While scans stream none does: an adapter may hold bytes back, the host may have stood still, and a capture may be in any chunking.
/// A telegram that was really cut is found out by the next one.
const STREAM_GAP_NS: i64 = i64::MAX;

/// Rates that a session may ask its port for: all of a laser's, and one of the rig's own.
const MOST_RATES: usize = 8;

/// What the session is for.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(super) enum Goal {
    Stream,
    Probe,
}

/// Where the session stands.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(super) enum State {
    FindRate { poll: u32 },
    ConfirmRate { poll: u32 },
    SwitchRate,
    Settle { until_ns: i64 },
    ConfirmSwitch,
    ReadConfiguration,
    ReadStatus,
    ReadFaults,
    ReadAgain,
    EnterInstallation,
    WriteConfiguration,
    LeaveInstallation,
    ReadBack,
    SetVariant,
    StartStream,
    Streaming,
    Stopping,
    Listening,
    Done,
}

/// Everything but the deframer, so that a telegram can be lent to it.
#[derive(Debug)]
pub(super) struct Machine {
    pub(super) settings: LaserSettings,
    pub(super) goal: Goal,
    pub(super) state: State,
    pub(super) question: Option<(Question, Request, Step)>,
    pub(super) baud: u32,
    /// Where the laser most likely is: the configured rate, then the one at which it was last heard for sure.
    pub(super) likely_baud: u32,
    /// The round of a search.
    pub(super) round: Option<u32>,
    pub(super) info: LaserInfo,
    pub(super) health: LaserHealth,
    pub(super) outputs: Outputs,
    pub(super) now_ns: i64,
    pub(super) last_byte_ns: i64,
    /// When the last scan came.
    pub(super) scan_ns: i64,
    /// When the last intact telegram came.
    pub(super) last_frame_ns: i64,
    /// When the last telegram came that was one, intact or not.
    pub(super) last_sign_ns: i64,
    /// When bytes came after a pause.
    pub(super) resumed_ns: i64,
    /// Since when the line is listened to: not while its port was gone.
    pub(super) heard_since_ns: i64,
    /// Rates that the port does not have.
    pub(super) port_lacks: heapless::Vec<u32, MOST_RATES>,
    /// Telegrams with a wrong checksum so far.
    pub(super) bad_checksums: u64,
    /// Bytes since the last question that belong to no telegram.
    pub(super) noise_bytes: usize,
    /// When a line that was silent and now is noisy is listened to at the rate of power-on.
    pub(super) wake_ns: Option<i64>,
    pub(super) plausibility: Plausibility,
    pub(super) condition: Condition,
    pub(super) index_watch: IndexWatch,
    /// Bytes of the last scan's telegram.
    pub(super) telegram_bytes: Option<usize>,
    pub(super) said: Said,
    pub(super) refused_rate: bool,
    pub(super) failed_switches: u8,
    pub(super) writing: Writing,
    pub(super) refused_remission: bool,
    pub(super) has_streamed: bool,
    /// It shall stop as soon as what it does now is done, and of a search not later than this.
    pub(super) stop_until_ns: Option<i64>,
}

impl Machine {
    pub(super) fn new(settings: LaserSettings, goal: Goal, now_ns: i64) -> Self {
        Self {
            settings,
            goal,
            state: State::Done,
            question: None,
            baud: settings.baud,
            likely_baud: settings.baud,
            round: None,
            info: LaserInfo::default(),
            health: LaserHealth::default(),
            outputs: Outputs::default(),
            now_ns,
            last_byte_ns: now_ns,
            scan_ns: i64::MIN,
            last_frame_ns: now_ns,
            last_sign_ns: now_ns,
            resumed_ns: now_ns,
            heard_since_ns: now_ns,
            port_lacks: heapless::Vec::new(),
            bad_checksums: 0,
            noise_bytes: 0,
            wake_ns: None,
            plausibility: Plausibility::default(),
            condition: Condition::default(),
            index_watch: IndexWatch::default(),
            telegram_bytes: None,
            said: Said::default(),
            refused_rate: false,
            failed_switches: 0,
            writing: Writing::default(),
            refused_remission: false,
            has_streamed: false,
            stop_until_ns: None,
        }
    }

    /// Opens a question and sends it at once.
    pub(super) fn ask(&mut self, state: State, step: Step, request: Request, patience: Patience) {
        if let Some((.., answered)) = self.question.take()
            && answered != step
        {
            self.said.succeeded(answered);
        }
        self.state = state;
        self.noise_bytes = 0;
        self.question = Some((Question::new(patience, self.now_ns), request, step));
        self.time();
    }

    /// How long bytes take on the line at its rate.
    pub(super) fn transfer_ns(&self, bytes: usize) -> i64 {
        byte_time_ns(self.baud).saturating_mul(i64::try_from(bytes).unwrap_or(i64::MAX))
    }

    /// Sends what is due, gives up what was asked too often, looks for silence.
    pub(super) fn time(&mut self) {
        if let State::Settle { until_ns } = self.state
            && self.now_ns >= until_ns
        {
            self.settled();
        }
        self.end_search_for_stop();
        self.look_for_another_rate();
        if let Some((question, request, step)) = &mut self.question {
            match question.poll(self.now_ns) {
                Due::Nothing => {}
                Due::Ask(attempt) => {
                    let (request, step) = (request.clone(), *step);
                    self.noise_bytes = 0;
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

    pub(super) fn send(&mut self, request: &Request) {
        self.outputs.write(|out| request.emit(BROADCAST, out));
    }

    /// An acknowledge is followed by nothing but a telegram: with anything else behind it, it was a byte of noise, at a rate that is not
    /// the device's.
    fn skipped(&mut self, count: usize) {
        self.noise_bytes = self.noise_bytes.saturating_add(count);
        if let (State::FindRate { .. }, Some((question, ..))) = (self.state, &mut self.question) {
            question.doubt(self.now_ns);
        }
    }

    pub(super) fn item(&mut self, item: Item<'_>) {
        match item {
            Item::Frame { offset, bytes } => self.frame(offset, bytes),
            Item::Control { byte: NAK, .. } => self.ask_again(),
            Item::Control { byte: ACK, .. } => {
                if let Some((question, ..)) = &mut self.question {
                    question.acknowledge();
                }
            }
            Item::Control { .. } => {}
            Item::Skipped { count, .. } => self.skipped(count),
        }
    }

    /// The deframer's account: a telegram that failed its checksum is a sign of a device at the right rate.
    pub(super) fn note_bad_checksums(&mut self, bad_checksums: u64) {
        if bad_checksums != self.bad_checksums {
            self.bad_checksums = bad_checksums;
            self.last_sign_ns = self.now_ns;
        }
    }

    pub(super) fn frame(&mut self, offset: u64, bytes: &[u8]) {
        self.last_frame_ns = self.now_ns;
        self.last_sign_ns = self.now_ns;
        let Ok(telegram) = Telegram::parse(bytes) else { return };
        let Ok(reply) = telegram.reply() else {
            self.health.not_kept += 1;
            return;
        };
        let status = telegram.status().unwrap_or_default();
        let measured = match reply {
            Reply::Scan(scan) => Measured::Scan(scan),
            Reply::Pairs(pairs) => Measured::Pairs(pairs),
            Reply::S14(scan) => Measured::S14(scan),
            Reply::FieldValues { .. } | Reply::Cartesian { .. } => {
                self.unpublished(Unpublished::Form(telegram.code()));
                return;
            }
            Reply::Refused => return self.refused(),
            Reply::PowerOn { .. } => return self.powered_on(),
            other => {
                self.info.status = Some(status);
                self.learn(&other);
                return self.answered(&other);
            }
        };
        let (address, code) = (telegram.address(), telegram.code());
        self.measured(&Source { offset, length: bytes.len(), address, code, status }, &measured);
    }

    /// An answer to whatever the state has asked; answers to other questions change nothing.
    pub(super) fn answered(&mut self, reply: &Reply<'_>) {
        match self.state {
            State::FindRate { poll } => self.find_rate_answered(poll, reply),
            State::ConfirmRate { .. } => self.confirm_rate_answered(reply),
            State::SwitchRate => self.switch_rate_answered(reply),
            State::ConfirmSwitch => self.confirm_switch_answered(reply),
            State::ReadConfiguration => self.read_configuration_answered(reply),
            State::ReadStatus => self.read_status_answered(reply),
            State::ReadFaults => self.read_faults_answered(reply),
            State::ReadAgain => self.read_again_answered(reply),
            State::EnterInstallation => self.enter_installation_answered(reply),
            State::WriteConfiguration => self.write_configuration_answered(reply),
            State::LeaveInstallation => self.leave_installation_answered(reply),
            State::ReadBack => self.read_back_answered(reply),
            State::SetVariant => self.set_variant_answered(reply),
            State::StartStream => self.start_stream_answered(reply),
            State::Stopping => self.stopping_answered(reply),
            State::Settle { .. } | State::Streaming | State::Listening | State::Done => {}
        }
    }

    /// No good answer in all attempts: what the state does without it.
    pub(super) fn given_up(&mut self, step: Step) {
        match self.state {
            State::FindRate { poll } | State::ConfirmRate { poll } => self.enter_search(poll + 1),
            _ => {
                self.say(Event::GivenUp { step });
                self.go_on_without();
            }
        }
    }

    fn go_on_without(&mut self) {
        match self.state {
            State::SwitchRate => self.keep_rate(),
            State::ConfirmSwitch => self.switch_failed(),
            State::ReadConfiguration => self.enter_read_status(),
            State::ReadStatus => self.enter_read_faults(),
            State::ReadFaults => self.compare_configuration(),
            State::ReadAgain => self.keep_configuration(),
            State::EnterInstallation => self.installation_failed(),
            State::WriteConfiguration => self.enter_leave_installation(),
            State::ReadBack => self.read_back_failed(),
            State::SetVariant => self.keep_variant(),
            State::StartStream => self.start_failed(),
            State::Stopping => self.finish_stop(),
            _ => self.restart_search(),
        }
    }

    pub(super) fn ask_again(&mut self) {
        let now_ns = self.now_ns;
        if let Some((question, ..)) = &mut self.question {
            question.refused(now_ns, PAUSE_NS);
        }
    }

    pub(super) fn refused(&mut self) {
        let Some((_, _, step)) = &self.question else { return };
        let step = *step;
        match self.state {
            State::FindRate { .. } => self.ask_again(),
            State::WriteConfiguration => self.write_refused(),
            State::StartStream => {
                self.say(Event::Refused { step });
                self.start_refused();
            }
            _ => {
                self.say(Event::Refused { step });
                self.ask_again();
            }
        }
    }

    pub(super) fn gap_before(&self, bytes: usize) -> bool {
        let pause_ns = self.now_ns.saturating_sub(self.transfer_ns(bytes)).saturating_sub(self.last_byte_ns);
        // In a capture, a pause of seconds within a telegram is more likely a clock that was set ahead: if nothing is
        // missing, the telegram is whole, and if something is, the deframer finds the next one inside.
        let is_step = self.state == State::Listening && pause_ns >= CLOCK_STEP_NS;
        pause_ns > self.gap_ns() && !is_step
    }

    pub(super) fn gap_ns(&self) -> i64 {
        match self.state {
            State::Listening | State::Streaming => STREAM_GAP_NS,
            _ => ANSWER_GAP_NS,
        }
    }

    /// When an unfinished telegram is given up without further bytes; only while an answer is awaited.
    pub(super) fn stump_deadline_ns(&self) -> i64 {
        match self.question {
            Some(_) => self.last_byte_ns.saturating_add(ANSWER_GAP_NS),
            None => i64::MAX,
        }
    }

    pub(super) fn deadline_ns(&self) -> i64 {
        let question_ns = self.question.as_ref().map_or(i64::MAX, |(question, ..)| question.deadline_ns());
        let state_ns = match self.state {
            State::Settle { until_ns } => until_ns,
            State::Streaming => self.silence_deadline_ns(),
            State::FindRate { .. } => {
                self.wake_ns.unwrap_or(i64::MAX).min(self.stop_until_ns.unwrap_or(i64::MAX))
            }
            _ => i64::MAX,
        };
        question_ns.min(state_ns)
    }
}
