//! The conversation with one laser: where it stands, the question that is open, what is sent and what is
//! said. Times are nanoseconds.

use biplane_wire::lms::{BROADCAST, Request};

use crate::session::device_session::Output;
use crate::session::event::{Event, Step};
use crate::session::lms::event_dedup::EventDedup;
use crate::session::queues::Outputs;
use crate::session::timing::retry::{Due, Patience, Question};
use crate::types::byte_time::byte_time_ns;

/// After a refusal the device wants at least 30 ms of peace.
const PAUSE_NS: i64 = 60_000_000;

/// Where the session stands.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum State {
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

impl State {
    /// Whether the rate of the device is not known for sure.
    pub(crate) fn is_searching(self) -> bool {
        matches!(self, Self::FindRate { .. } | Self::ConfirmRate { .. })
    }

    /// Whether the device may be at work on its EEPROM, or what it did there is not read back yet.
    pub(crate) fn is_writing(self) -> bool {
        matches!(self, Self::WriteConfiguration | Self::LeaveInstallation | Self::ReadBack)
    }
}

/// What follows from an answer, or from its absence.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Next {
    /// Nothing.
    Stay,
    /// A question was opened: it is sent.
    Asked,
    /// The device says no to what it was asked.
    Refused,
    /// The rate of this poll is tried.
    Search { poll: u32 },
    /// The device is looked for anew.
    SearchAgain,
    /// What it is and how it is set is read.
    ReadConfiguration,
    /// What differs from the rig is written.
    Write,
    /// Its field of view is set.
    SetVariant,
    /// It is asked to stream.
    StartStream,
    /// It streams.
    Streaming,
    /// It is asked to stop.
    Stop,
    /// Nothing is left to do.
    Done,
}

/// A question to the device that has no answer yet.
#[derive(Debug)]
pub(crate) struct OpenQuestion {
    /// How long it is waited for, how often it is asked.
    pub(crate) question: Question,
    /// What is sent.
    pub(crate) request: Request,
    /// What it is for.
    pub(crate) step: Step,
    /// The device has refused it, and said so.
    pub(crate) is_refused: bool,
}

/// The conversation with a laser.
#[derive(Debug)]
pub(crate) struct Dialogue {
    pub(crate) state: State,
    pub(crate) open: Option<OpenQuestion>,
    /// The rate of the line, bits per second.
    pub(crate) baud: u32,
    pub(crate) now_ns: i64,
    pub(crate) outputs: Outputs,
    pub(crate) event_dedup: EventDedup,
    /// Bytes since the last question that belong to no telegram.
    pub(crate) noise_bytes: usize,
}

impl Dialogue {
    pub(crate) fn new(baud: u32, now_ns: i64) -> Self {
        Self {
            state: State::Done,
            open: None,
            baud,
            now_ns,
            outputs: Outputs::default(),
            event_dedup: EventDedup::default(),
            noise_bytes: 0,
        }
    }

    /// Opens a question, to be sent at once.
    pub(crate) fn ask(&mut self, state: State, step: Step, request: Request, patience: Patience) -> Next {
        if let Some(answered) = self.open.take()
            && answered.step != step
        {
            self.event_dedup.succeeded(answered.step);
        }
        self.state = state;
        self.noise_bytes = 0;
        let question = Question::new(patience, self.now_ns);
        self.open = Some(OpenQuestion { question, request, step, is_refused: false });
        Next::Asked
    }

    /// Sends the open question if it is due. Its step, when it was asked too often.
    pub(crate) fn send_due(&mut self) -> Option<Step> {
        let OpenQuestion { question, request, step, is_refused } = self.open.as_mut()?;
        let step = *step;
        match question.poll(self.now_ns) {
            Due::Nothing => None,
            Due::Ask(attempt) => {
                self.noise_bytes = 0;
                self.outputs.write(|out| request.emit(BROADCAST, out));
                // A refusal is an answer.
                let is_answered = std::mem::take(is_refused);
                if attempt > 1 && !is_answered && !matches!(self.state, State::FindRate { .. }) {
                    self.say(Event::Retried { step, attempt });
                }
                None
            }
            Due::GivenUp => {
                self.open = None;
                Some(step)
            }
        }
    }

    /// Says it, unless it only repeats what was said.
    pub(crate) fn say(&mut self, event: Event) {
        if !self.event_dedup.repeats(&event) {
            self.outputs.say(event);
        }
    }

    pub(crate) fn set_baud(&mut self, baud: u32) {
        self.baud = baud;
        self.outputs.push(Output::SetBaud(baud));
    }

    /// How long bytes take on the line at its rate.
    pub(crate) fn transfer_ns(&self, bytes: usize) -> i64 {
        byte_time_ns(self.baud).saturating_mul(i64::try_from(bytes).unwrap_or(i64::MAX))
    }

    /// An acknowledge is followed by nothing but a telegram: with anything else behind it, it was a byte of
    /// noise, at a rate that is not the device's.
    pub(crate) fn skipped(&mut self, count: usize) {
        self.noise_bytes = self.noise_bytes.saturating_add(count);
        if let (State::FindRate { .. }, Some(open)) = (self.state, &mut self.open) {
            open.question.question_again(self.now_ns);
        }
    }

    pub(crate) fn acknowledged(&mut self) {
        if let Some(open) = &mut self.open {
            open.question.acknowledge();
        }
    }

    pub(crate) fn ask_again(&mut self) {
        if let Some(open) = &mut self.open {
            open.question.refused(self.now_ns, PAUSE_NS);
        }
    }

    /// The device has refused what it was asked: it is asked again.
    pub(crate) fn refused(&mut self, step: Step) {
        self.say(Event::Refused { step });
        if let Some(open) = &mut self.open {
            open.is_refused = true;
        }
        self.ask_again();
    }

    /// How often the open question was asked.
    pub(crate) fn asked(&self) -> u8 {
        self.open.as_ref().map_or(0, |open| open.question.asked())
    }

    /// When the open question wants to be looked at.
    pub(crate) fn deadline_ns(&self) -> i64 {
        self.open.as_ref().map_or(i64::MAX, |open| open.question.deadline_ns())
    }

    /// Ends: nothing is asked any more.
    pub(crate) fn finish(&mut self) {
        self.open = None;
        self.state = State::Done;
    }
}
