//! The state of a laser's session and what leads from one state to the next.
//!
//! Each state asks one question; the answer, or its absence, goes to that state's own small function in `search.rs`,
//! `configure.rs` or `stream.rs`. Times are nanoseconds.

use biplane_wire::Item;
use biplane_wire::lms::{BROADCAST, NAK, Reply, Request, Telegram};

use super::settings::{LaserInfo, LaserSettings};
use crate::session::retry::{Due, Patience, Question};
use crate::session::{Event, Output, Outputs, RequestBytes, Step};
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
pub(super) enum Goal {
    Stream,
    Probe,
}

/// Where the session stands.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(super) enum State {
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

/// Everything but the deframer, so that a telegram can be lent to it.
#[derive(Debug)]
pub(super) struct Machine {
    pub(super) settings: LaserSettings,
    pub(super) goal: Goal,
    pub(super) state: State,
    pub(super) question: Option<(Question, Request, Step)>,
    pub(super) baud: u32,
    pub(super) info: LaserInfo,
    pub(super) outputs: Outputs,
    pub(super) now_ns: i64,
    pub(super) last_byte_ns: i64,
    pub(super) last_frame_ns: i64,
    pub(super) mode_said: bool,
    pub(super) variant_said: bool,
    pub(super) refused_rate: bool,
    pub(super) has_streamed: bool,
    /// The rate at which the laser most likely is: the configured one, then the one at which it was last heard for sure.
    pub(super) likely_baud: u32,
    /// Round of the first search, from 0, that found the laser.
    pub(super) found_in_round: Option<u32>,
    pub(super) not_kept: u64,
}

impl Machine {
    pub(super) fn new(settings: LaserSettings, goal: Goal, now_ns: i64) -> Self {
        Self {
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
            likely_baud: settings.baud,
            found_in_round: None,
            not_kept: 0,
        }
    }

    pub(super) fn say(&mut self, event: Event) {
        self.outputs.push(Output::Event(event));
    }

    /// Opens a question and sends it at once.
    pub(super) fn ask(&mut self, state: State, step: Step, request: Request, patience: Patience) {
        self.state = state;
        self.question = Some((Question::new(patience, self.now_ns), request, step));
        self.time();
    }

    /// Sends what is due, gives up what was asked too often, looks for silence.
    pub(super) fn time(&mut self) {
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

    pub(super) fn send(&mut self, request: &Request) {
        let mut bytes = [0; 64];
        if let Ok(length) = request.emit(BROADCAST, &mut bytes)
            && let Ok(bytes) = RequestBytes::from_slice(&bytes[..length])
        {
            self.outputs.push(Output::Write(bytes));
        }
    }

    pub(super) fn item(&mut self, item: Item<'_>) {
        match item {
            Item::Frame { offset, bytes } => self.frame(offset, bytes),
            Item::Control { byte: NAK, .. } => self.ask_again(),
            Item::Control { .. } | Item::Skipped { .. } => {}
        }
    }

    pub(super) fn frame(&mut self, offset: u64, bytes: &[u8]) {
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
    pub(super) fn answered(&mut self, reply: &Reply<'_>) {
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
    pub(super) fn given_up(&mut self, step: Step) {
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

    pub(super) fn go_on_without(&mut self, step: Step) {
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

    pub(super) fn ask_again(&mut self) {
        let now_ns = self.now_ns;
        if let Some((question, ..)) = &mut self.question {
            question.refused(now_ns, PAUSE_NS);
        }
    }

    pub(super) fn refused(&mut self) {
        if let Some((_, _, step)) = &self.question {
            let step = *step;
            if step != Step::FindRate {
                self.say(Event::Refused { step });
            }
            self.ask_again();
        }
    }

    /// Keeps what replies tell of the laser, whoever asked for them.
    pub(super) fn learn(&mut self, reply: &Reply<'_>) {
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

    pub(super) fn gap_before(&self, bytes: usize) -> bool {
        let on_the_line_ns = byte_time_ns(self.baud).saturating_mul(i64::try_from(bytes).unwrap_or(i64::MAX));
        let pause_ns = self.now_ns.saturating_sub(on_the_line_ns).saturating_sub(self.last_byte_ns);
        pause_ns > self.gap_ns()
    }

    pub(super) fn gap_ns(&self) -> i64 {
        match self.state {
            State::Listening | State::Streaming { .. } => STREAM_GAP_NS,
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
            State::Streaming { .. } => self.silence_deadline_ns(),
            _ => i64::MAX,
        };
        question_ns.min(state_ns)
    }
}
