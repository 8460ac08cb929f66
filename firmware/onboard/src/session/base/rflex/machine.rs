//! The state of an rFLEX session and what leads from one state to the next. Times are nanoseconds.

use biplane_wire::rflex::{
    AxisMotion, BOTH_AXES, Command, MotionReport, Packet, ROTATION, Report, SystemStatus, TRANSLATION,
};

use super::Scale;
use super::axes::Axes;
use crate::session::base::counted::{CountedPose, Reading, Step as Counted};
use crate::session::base::driver::Purpose;
use crate::session::base::{BaseInfo, OdometryReading};
use crate::session::retry::{Due, Patience, Question};
use crate::session::{Event, Output, Outputs, RequestBytes, ShortText, silence};

const STATUS: Patience = Patience::new(500, 4);
/// The base loses commands that come without 10 ms of silence between them.
const PAUSE_NS: i64 = 20_000_000;
/// Motion reports come every 100 ms.
const SILENCE_NS: i64 = 900_000_000;
/// Between two rounds of asking.
const ROUND_NS: i64 = 500_000_000;
/// Between two questions for the battery.
const STATUS_PERIOD_NS: i64 = 5_000_000_000;
/// Both reports every tenth of a second. The sources disagree about the unit; only microseconds make sense of the value.
const PERIOD_US: u32 = 100_000;
/// As CARMEN sets them; at speed 0 they move nothing.
const ACCELERATION: u32 = 1000;
const TORQUE: u32 = 30_000;
/// A host's packets carry this id.
const HOST_ID: u8 = 0;

const fn standing(axis: u8) -> Command {
    Command::SetDirection(AxisMotion {
        axis,
        speed: 0,
        acceleration: ACCELERATION,
        torque: TORQUE,
        direction: 1,
    })
}

/// What a base is told before it reports, one after the other.
const START: [Command; 6] = [
    Command::MotionReports { period_us: PERIOD_US, axes: BOTH_AXES },
    Command::DigitalReports { period_us: PERIOD_US },
    Command::SetDefaults,
    Command::BrakeOff,
    standing(TRANSLATION),
    standing(ROTATION),
];

/// What it is told at the end.
const STOP: [Command; 3] = [
    Command::MotionReports { period_us: 0, axes: 0 },
    Command::DigitalReports { period_us: 0 },
    Command::BrakeOn,
];

/// Where the session stands.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(super) enum State {
    /// Asking whether anybody is there.
    Asking,
    /// Nobody answered; the next round comes.
    Resting { until_ns: i64 },
    /// This command of [`START`] goes out next, at this time.
    Starting { next: usize, at_ns: i64 },
    /// Reports flow.
    Running { status_ns: i64 },
    /// This command of [`STOP`] goes out next.
    Stopping { next: usize, at_ns: i64 },
    /// A recording is read.
    Listening,
    /// Nothing left to do.
    Done,
}

/// Everything but the deframer, so that a packet can be lent to it.
#[derive(Debug)]
pub(super) struct Machine {
    pub(super) baud: u32,
    scale: Scale,
    purpose: Purpose,
    pub(super) state: State,
    question: Option<Question>,
    pub(super) info: BaseInfo,
    axes: Axes,
    pose: CountedPose,
    pub(super) outputs: Outputs,
    pub(super) now_ns: i64,
    last_pair_ns: i64,
    pub(super) last_byte_ns: i64,
    /// When a port that was gone came back.
    port_back_ns: i64,
    battery_v: f32,
    rounds: u32,
    has_reported: bool,
    pub(super) not_kept: u64,
}

impl Machine {
    pub(super) fn new(baud: u32, scale: Scale, purpose: Purpose, now_ns: i64) -> Self {
        Self {
            baud,
            scale,
            purpose,
            state: if purpose == Purpose::Listen { State::Listening } else { State::Asking },
            question: None,
            info: BaseInfo::default(),
            axes: Axes::default(),
            pose: CountedPose::default(),
            outputs: Outputs::default(),
            now_ns,
            last_pair_ns: now_ns,
            last_byte_ns: now_ns,
            port_back_ns: i64::MIN,
            battery_v: 0.0,
            rounds: 0,
            has_reported: false,
            not_kept: 0,
        }
    }

    pub(super) fn say(&mut self, event: Event) {
        self.outputs.push(Output::Event(event));
    }

    fn send(&mut self, command: &Command) {
        let mut bytes = [0; 64];
        if let Ok(length) = command.emit(HOST_ID, &mut bytes)
            && let Ok(bytes) = RequestBytes::from_slice(&bytes[..length])
        {
            self.outputs.push(Output::Write(bytes));
        }
    }

    /// The session begins: say what it is, ask whether anybody is there.
    pub(super) fn begin(&mut self) {
        self.say(Event::Untried);
        self.ask();
    }

    fn ask(&mut self) {
        self.state = State::Asking;
        self.question = Some(Question::new(STATUS, self.now_ns));
        self.time();
    }

    pub(super) fn time(&mut self) {
        match self.state {
            State::Asking => self.asking(),
            State::Resting { until_ns } if self.now_ns >= until_ns => self.ask(),
            State::Starting { next, at_ns } if self.now_ns >= at_ns => self.starting(next),
            State::Running { status_ns } => self.running(status_ns),
            State::Stopping { next, at_ns } if self.now_ns >= at_ns => self.stopping(next),
            _ => {}
        }
    }

    fn asking(&mut self) {
        match self.question.as_mut().map(|question| question.poll(self.now_ns)) {
            Some(Due::Ask(_)) => self.send(&Command::Status),
            Some(Due::GivenUp) => {
                self.question = None;
                self.rounds += 1;
                // Once is enough: who waits for hours need not read it every few seconds.
                if self.rounds == 1 {
                    self.say(Event::NotFound { rounds: self.rounds });
                }
                self.state = State::Resting { until_ns: self.now_ns + ROUND_NS };
            }
            _ => {}
        }
    }

    fn starting(&mut self, next: usize) {
        match START.get(next) {
            Some(command) => {
                self.send(command);
                self.state = State::Starting { next: next + 1, at_ns: self.now_ns + PAUSE_NS };
            }
            None => {
                self.last_pair_ns = self.last_pair_ns.max(self.now_ns);
                self.state = State::Running { status_ns: self.now_ns + STATUS_PERIOD_NS };
            }
        }
    }

    fn running(&mut self, status_ns: i64) {
        let silent_ns = self.now_ns - self.last_pair_ns;
        if self.now_ns >= self.silence_deadline_ns() {
            let for_ms = u32::try_from(silent_ns / 1_000_000).unwrap_or(u32::MAX);
            let bytes_came = self.last_byte_ns - self.last_pair_ns > SILENCE_NS / 2;
            self.say(if bytes_came { Event::Garbled { for_ms } } else { Event::Silent { for_ms } });
            self.has_reported = false;
            self.ask();
        } else if self.now_ns >= status_ns {
            self.send(&Command::Status);
            self.state = State::Running { status_ns: self.now_ns + STATUS_PERIOD_NS };
        }
    }

    fn stopping(&mut self, next: usize) {
        match STOP.get(next) {
            Some(command) => {
                self.send(command);
                self.state = State::Stopping { next: next + 1, at_ns: self.now_ns + PAUSE_NS };
            }
            None => {
                self.say(Event::Stopped);
                self.state = State::Done;
            }
        }
    }

    pub(super) fn frame(&mut self, offset: u64, bytes: &[u8]) {
        match Packet::parse(bytes).and_then(|packet| packet.report()) {
            Ok(Report::Motion(motion)) => self.motion(offset, bytes.len(), &motion),
            Ok(Report::Status(status)) => self.told_status(&status),
            Ok(_) => {}
            Err(_) => self.not_kept += 1,
        }
        // Whatever it says: somebody is there.
        if self.state == State::Asking {
            self.found();
        }
    }

    fn found(&mut self) {
        self.question = None;
        self.rounds = 0;
        if self.info.class.is_empty() {
            self.info.class = ShortText::try_from("rFLEX").unwrap_or_default();
            self.say(Event::Identified(self.info.class.clone()));
        }
        self.state = match self.purpose {
            Purpose::Probe => State::Done,
            // The answer is behind its own 10 ms of silence.
            _ => State::Starting { next: 0, at_ns: self.now_ns + PAUSE_NS },
        };
    }

    fn told_status(&mut self, status: &SystemStatus) {
        self.battery_v = (f64::from(status.centivolts) / 100.0) as f32;
    }

    fn motion(&mut self, offset: u64, length: usize, report: &MotionReport) {
        if self.state == State::Done {
            return;
        }
        let Some(pair) = self.axes.take(self.now_ns, offset, length, report) else { return };
        self.last_pair_ns = self.now_ns;
        if !self.has_reported && self.state != State::Listening {
            self.has_reported = true;
            self.say(Event::Streaming);
        }
        let scale = self.scale;
        let reading = Reading { counts: pair.counts, time_ns: self.now_ns };
        let odom_from_base = match self.pose.take(reading, |counts| scale.motion(counts)) {
            Counted::At(pose) => pose,
            Counted::Restarted(pose) => {
                self.say(Event::OdometryRestarted);
                pose
            }
            Counted::Doubtful => return,
        };
        let battery_v = self.battery_v;
        let reading = OdometryReading { offset: pair.offset, length: pair.length, odom_from_base, battery_v };
        self.outputs.push(Output::Odometry(reading));
    }

    fn silence_deadline_ns(&self) -> i64 {
        silence::deadline_ns(self.last_pair_ns, SILENCE_NS, self.port_back_ns)
    }

    /// The base may still report: it is listened to.
    pub(super) fn port_back(&mut self) {
        self.port_back_ns = self.now_ns;
        self.outputs.push(Output::SetBaud(self.baud));
    }

    pub(super) fn stop(&mut self) {
        self.question = None;
        self.state = match self.state {
            State::Done | State::Listening => State::Done,
            stopping @ State::Stopping { .. } => stopping,
            // Nobody has answered, so nothing was begun.
            State::Asking | State::Resting { .. } if self.info.class.is_empty() => State::Done,
            _ => State::Stopping { next: 0, at_ns: self.now_ns + PAUSE_NS },
        };
    }

    pub(super) fn deadline_ns(&self) -> i64 {
        match self.state {
            State::Asking => self.question.as_ref().map_or(i64::MAX, Question::deadline_ns),
            State::Resting { until_ns } => until_ns,
            State::Starting { at_ns, .. } | State::Stopping { at_ns, .. } => at_ns,
            State::Running { status_ns } => status_ns.min(self.silence_deadline_ns()),
            State::Listening | State::Done => i64::MAX,
        }
    }
}
