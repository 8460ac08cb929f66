//! The state of a controller's session: what is asked when, and what answers mean. Times are nanoseconds.

use biplane_wire::Text;
use biplane_wire::roboclaw::{Answer, Collected, Question, Request, StatusBits, StatusWidth};

use crate::session::base::contact::Contact;
use crate::session::base::counted::{CountedPose, Reading};
use crate::session::base::driver::Purpose;
use crate::session::base::reading::{BaseInfo, OdometryReading};
use crate::session::base::roboclaw::wheels::Wheels;
use crate::session::event::Event;
use crate::types::byte_time::byte_time_ns;
use crate::types::device_name::{ShortText, printable};

/// A controller answers within some milliseconds, a USB adapter adds up to 16 (its latency timer) and now and
/// then 8 more.
const ANSWER_NS: i64 = 60_000_000;
/// A controller forgets half a request after 10 ms; a line is quiet after a little more.
const QUIET_NS: i64 = 15_000_000;
/// Noise without an end is not waited for any longer.
const LONGEST_QUIET_NS: i64 = 200_000_000;
/// Counts are asked for no more often than this, and as often as the line allows.
const SHORTEST_PERIOD_NS: i64 = 20_000_000;
/// Battery and status, in turn.
const STATE_PERIOD_NS: i64 = 1_000_000_000;
/// Without counts for so long, the controller is looked for anew.
const SILENCE_NS: i64 = 800_000_000;
/// Between two rounds of looking for it.
const ROUND_NS: i64 = 400_000_000;
/// Questions of a round.
const ATTEMPTS: u32 = 4;

/// Where the session stands.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Stage {
    /// Asking who is there.
    Identifying { attempts: u32 },
    /// Nobody answered; the next round comes.
    Resting { until_ns: i64 },
    /// A probe's last question.
    AskingStatus { attempts: u32 },
    /// Counts flow.
    Running,
    /// The last question's answer is under way: a recording keeps it, so its replay would count it.
    Stopping,
    /// A recording is read.
    Listening,
    /// Nothing left to do.
    Done,
}

/// Whether an answer that comes now can be that to the question asked last. It says nothing of when it was
/// asked for: behind an adapter that held everything back, old counts would be taken for new ones. So after
/// one that did not come in time counts are not asked for before another question was answered and nothing
/// came behind the answer.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
enum Pace {
    /// Every question was answered.
    InStep,
    /// One was not.
    Lost,
    /// Another one was; the line must be quiet now.
    Settling,
}

/// Everything but the collector, so that an answer can be lent to it.
#[derive(Debug)]
pub(crate) struct Machine {
    pub(crate) contact: Contact,
    pub(crate) address: u8,
    wheels: Wheels,
    purpose: Purpose,
    pub(crate) stage: Stage,
    pose: CountedPose,
    /// The open question, and until when its answer is awaited.
    open: Option<(Question, i64)>,
    /// No question before this time.
    ask_ns: i64,
    /// Until when at most a line that is not quiet is waited for.
    quiet_limit_ns: Option<i64>,
    pace: Pace,
    next_counts_ns: i64,
    upkeep: Upkeep,
}

/// Battery and status, which are asked for in turn beside the counts.
#[derive(Debug)]
struct Upkeep {
    /// When one of them is due.
    next_ns: i64,
    /// Whether it is the battery.
    battery_next: bool,
    /// How wide the controller's status is.
    width: StatusWidth,
    /// The status as last told.
    status: Option<StatusBits>,
    /// Battery, volts, as last told; 0 before.
    battery_v: f32,
}

impl Machine {
    pub(crate) fn new(baud: u32, address: u8, wheels: Wheels, purpose: Purpose, now_ns: i64) -> Self {
        let listens = purpose == Purpose::Listen;
        Self {
            contact: Contact::new(baud, SILENCE_NS, now_ns),
            address,
            wheels,
            purpose,
            stage: if listens { Stage::Listening } else { Stage::Identifying { attempts: 0 } },
            pose: CountedPose::default(),
            open: None,
            ask_ns: now_ns,
            quiet_limit_ns: None,
            pace: Pace::InStep,
            next_counts_ns: now_ns,
            upkeep: Upkeep {
                next_ns: now_ns,
                battery_next: true,
                width: StatusWidth::Wide,
                status: None,
                battery_v: 0.0,
            },
        }
    }

    /// How long a question and its answer are on the line at least.
    fn exchange_ns(&self, question: Question) -> i64 {
        let answer_bytes = match question {
            Question::Firmware => biplane_wire::roboclaw::MAX_ANSWER_BYTES,
            other => other.answer_len(&[]),
        };
        byte_time_ns(self.contact.baud).saturating_mul(2 + answer_bytes as i64)
    }

    /// From one question for counts to the next: half of the line's time at most.
    fn period_ns(&self) -> i64 {
        SHORTEST_PERIOD_NS.max(2 * self.exchange_ns(Question::Encoders))
    }

    pub(crate) fn answer_is_late(&self) -> bool {
        self.open.is_some_and(|(_, until_ns)| self.contact.now_ns >= until_ns)
    }

    /// What leads from one stage to the next without an answer.
    pub(crate) fn watch(&mut self) {
        match self.stage {
            Stage::Stopping if self.open.is_none() => {
                self.contact.say(Event::Stopped);
                self.stage = Stage::Done;
            }
            Stage::Resting { until_ns } if self.contact.now_ns >= until_ns => self.identify(),
            Stage::Running if self.contact.is_lost() => {
                self.contact.say_lost();
                self.identify();
            }
            _ => {}
        }
    }

    fn identify(&mut self) {
        self.stage = Stage::Identifying { attempts: 0 };
    }

    /// What to ask now, if anything.
    pub(crate) fn due_question(&self) -> Option<Question> {
        if self.open.is_some() || self.contact.now_ns < self.ask_ns {
            return None;
        }
        match self.stage {
            Stage::Identifying { .. } => Some(Question::Firmware),
            Stage::AskingStatus { .. } => Some(Question::Status(self.upkeep.width)),
            Stage::Running if self.pace == Pace::Lost => Some(Question::MainBattery),
            // Once a second, and first: behind a slow adapter counts are always due.
            Stage::Running if self.contact.now_ns >= self.upkeep.next_ns => {
                Some(match self.upkeep.battery_next {
                    true => Question::MainBattery,
                    false => Question::Status(self.upkeep.width),
                })
            }
            Stage::Running if self.contact.now_ns >= self.next_counts_ns => Some(Question::Encoders),
            _ => None,
        }
    }

    /// The question goes out.
    pub(crate) fn asked(&mut self, request: Request) {
        self.contact.send(|out| request.emit(out));
        self.was_asked(request.question);
        self.quiet_limit_ns = None;
        if self.pace == Pace::Settling {
            self.pace = Pace::InStep;
        }
        match request.question {
            Question::Encoders => {
                // What was missed is not caught up.
                let next_ns = self.next_counts_ns + self.period_ns();
                self.next_counts_ns = if next_ns > self.contact.now_ns {
                    next_ns
                } else {
                    self.contact.now_ns + self.period_ns()
                };
            }
            Question::MainBattery | Question::Status(_) => {
                self.upkeep.battery_next = !self.upkeep.battery_next;
                self.upkeep.next_ns = self.contact.now_ns + STATE_PERIOD_NS;
            }
            _ => {}
        }
    }

    /// The question is on its way, or was in a recording: its answer is awaited for as long in both.
    pub(crate) fn was_asked(&mut self, question: Question) {
        self.open = Some((question, self.contact.now_ns + self.exchange_ns(question) + ANSWER_NS));
    }

    /// Bytes have come; between questions they are the rest of something that failed.
    pub(crate) fn received_bytes(&mut self) {
        self.contact.last_byte_ns = self.contact.now_ns;
        if self.open.is_none() && self.pace == Pace::Settling {
            self.pace = Pace::Lost;
        }
        if let Some(limit_ns) = self.quiet_limit_ns {
            self.ask_ns = (self.contact.now_ns + QUIET_NS).min(limit_ns);
        }
    }

    /// The answer was damaged, or did not come; so many bytes of it did.
    pub(crate) fn unanswered(&mut self, held: usize) {
        let question = self.open.take().map(|(question, _)| question);
        self.ask_ns = self.contact.now_ns + QUIET_NS;
        self.quiet_limit_ns = Some(self.contact.now_ns + LONGEST_QUIET_NS);
        self.pace = Pace::Lost;
        if let Some(Question::Status(width)) = question {
            self.other_width(width, held);
        }
        match &mut self.stage {
            Stage::Identifying { attempts } => {
                *attempts += 1;
                if *attempts >= ATTEMPTS {
                    self.contact.round_failed(Event::NotFound { rounds: 1 });
                    self.stage = Stage::Resting { until_ns: self.contact.now_ns + ROUND_NS };
                }
            }
            Stage::AskingStatus { attempts } => {
                *attempts += 1;
                if *attempts >= ATTEMPTS {
                    self.stage = Stage::Done;
                }
            }
            _ => {}
        }
    }

    /// Older firmware answers a wide status with the bytes of a narrow one; newer firmware a narrow one with
    /// a sum that does not fit.
    fn other_width(&mut self, asked: StatusWidth, held: usize) {
        let narrow_len = Question::Status(StatusWidth::Narrow).answer_len(&[]);
        match asked {
            StatusWidth::Wide if held == narrow_len => self.upkeep.width = StatusWidth::Narrow,
            StatusWidth::Narrow => self.upkeep.width = StatusWidth::Wide,
            StatusWidth::Wide => {}
        }
    }

    /// A good answer to the open question.
    pub(crate) fn answered(&mut self, received: Collected<'_>) {
        if received.surplus > 0 {
            self.unanswered(0);
            return;
        }
        self.open = None;
        self.ask_ns = self.contact.now_ns;
        if self.pace == Pace::Lost {
            self.pace = Pace::Settling;
            self.ask_ns = self.contact.now_ns + QUIET_NS;
            self.quiet_limit_ns = Some(self.contact.now_ns + LONGEST_QUIET_NS);
        }
        match received.answer {
            Answer::Firmware(text) => self.identified(text),
            Answer::Encoders { m1_counts, m2_counts } => self.counted(received, [m1_counts, m2_counts]),
            Answer::MainBattery { decivolts } => self.upkeep.battery_v = f32::from(decivolts) / 10.0,
            Answer::Status(bits) => self.reported_status(bits),
            Answer::Encoder { .. } | Answer::Done => {}
        }
    }

    fn identified(&mut self, text: Text<'_>) {
        let line = text.0.strip_suffix(b"\n").unwrap_or(text.0);
        let version_at = line.windows(2).rposition(|pair| pair == b" v").unwrap_or(line.len());
        let (product, version) = line.split_at(version_at);
        let (class, name) = (printable(Text(product)), printable(Text(version)));
        if (&class, &name) != (&self.contact.info.class, &self.contact.info.name) {
            self.contact.info = BaseInfo { class, name, subclass: ShortText::new(), has_fault: None };
            self.contact.say(Event::Identified(printable(Text(line))));
        }
        match self.stage {
            Stage::Identifying { .. } if self.purpose == Purpose::Probe => {
                self.stage = Stage::AskingStatus { attempts: 0 };
            }
            Stage::Identifying { .. } => {
                self.stage = Stage::Running;
                self.contact.found();
                self.next_counts_ns = self.contact.now_ns;
                self.contact.last_report_ns = self.contact.now_ns;
                self.contact.say(Event::Streaming);
            }
            _ => {}
        }
    }

    fn counted(&mut self, received: Collected<'_>, counts: [i32; 2]) {
        self.contact.last_report_ns = self.contact.now_ns;
        let wheels = self.wheels;
        let reading = Reading { counts, time_ns: self.contact.now_ns };
        let step = self.pose.take(reading, |counts| wheels.motion(counts));
        let Some((odom_from_base, restarted)) = step.accepted() else {
            self.next_counts_ns = self.contact.now_ns;
            return;
        };
        let (offset, length, battery_v) = (received.offset, received.length, self.upkeep.battery_v);
        self.contact.report(OdometryReading { offset, length, odom_from_base, battery_v }, restarted);
    }

    fn reported_status(&mut self, bits: StatusBits) {
        let was_trouble = self.upkeep.status.is_some_and(|before| before.words().next().is_some());
        let is_trouble = bits.words().next().is_some();
        if self.upkeep.status != Some(bits) && (is_trouble || was_trouble) {
            self.contact.say(Event::BaseStatus(bits));
        }
        self.upkeep.status = Some(bits);
        self.contact.info.has_fault = Some(is_trouble);
        if matches!(self.stage, Stage::AskingStatus { .. }) {
            self.stage = Stage::Done;
        }
    }

    /// Whatever was asked was not heard, and whatever comes first may be an old answer.
    pub(crate) fn port_back(&mut self) {
        self.contact.port_back();
        self.open = None;
        self.ask_ns = self.contact.now_ns + QUIET_NS;
        self.quiet_limit_ns = Some(self.contact.now_ns + LONGEST_QUIET_NS);
        self.pace = Pace::Lost;
    }

    /// Nothing was commanded, so nothing has to be undone.
    pub(crate) fn stop(&mut self) {
        match self.stage {
            Stage::Running => self.stage = Stage::Stopping,
            Stage::Stopping => {}
            _ => (self.open, self.stage) = (None, Stage::Done),
        }
    }

    pub(crate) fn deadline_ns(&self) -> i64 {
        let question_ns = match self.open {
            Some((_, until_ns)) => until_ns,
            None => self.ask_ns,
        };
        match self.stage {
            Stage::Done | Stage::Listening => i64::MAX,
            Stage::Resting { until_ns } => until_ns,
            Stage::Identifying { .. } | Stage::AskingStatus { .. } | Stage::Stopping => question_ns,
            Stage::Running => {
                let due_ns = self.next_counts_ns.min(self.upkeep.next_ns);
                let ask_ns = if self.open.is_some() { question_ns } else { question_ns.max(due_ns) };
                ask_ns.min(self.contact.silence_deadline_ns())
            }
        }
    }
}
