//! The state of an rFLEX session and what leads from one state to the next. Times are nanoseconds.

use biplane_wire::WireError;
use biplane_wire::rflex::{
    AxisMotion, BOTH_AXES, Command, MotionReport, Packet, ROTATION, Report, RflexFraming, SystemStatus,
    TRANSLATION,
};

use crate::session::base::contact::Contact;
use crate::session::base::counted::{CountedPose, Reading};
use crate::session::base::driver::Purpose;
use crate::session::base::packets::PacketMachine;
use crate::session::base::reading::OdometryReading;
use crate::session::base::rflex::axes::Axes;
use crate::session::base::rflex::scale::Scale;
use crate::session::event::Event;
use crate::session::timing::retry::{Due, Patience, Question};
use crate::types::device_name::ShortText;

const STATUS: Patience = Patience::new(500, 4);
/// The base loses commands that come without 10 ms of silence between them.
const PAUSE_NS: i64 = 20_000_000;
/// Motion reports come every 100 ms.
const SILENCE_NS: i64 = 900_000_000;
/// Between two rounds of asking.
const ROUND_NS: i64 = 500_000_000;
/// Between two questions for the battery.
const STATUS_PERIOD_NS: i64 = 5_000_000_000;
/// Both reports every tenth of a second. The sources disagree about the unit; only microseconds make sense of
/// the value.
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
enum State {
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

/// The session with an rFLEX base, but for the deframer.
#[derive(Debug)]
pub struct Machine {
    contact: Contact,
    scale: Scale,
    purpose: Purpose,
    state: State,
    question: Option<Question>,
    axes: Axes,
    pose: CountedPose,
    battery_v: f32,
    has_reported: bool,
}

impl Machine {
    pub(crate) fn new(baud: u32, scale: Scale, purpose: Purpose, now_ns: i64) -> Self {
        Self {
            contact: Contact::new(baud, SILENCE_NS, now_ns),
            scale,
            purpose,
            state: if purpose == Purpose::Listen { State::Listening } else { State::Asking },
            question: None,
            axes: Axes::default(),
            pose: CountedPose::default(),
            battery_v: 0.0,
            has_reported: false,
        }
    }

    fn send(&mut self, command: &Command) {
        self.contact.send(|out| command.emit(HOST_ID, out));
    }

    fn ask(&mut self) {
        self.state = State::Asking;
        self.question = Some(Question::new(STATUS, self.contact.now_ns));
        self.time();
    }

    fn asking(&mut self) {
        match self.question.as_mut().map(|question| question.poll(self.contact.now_ns)) {
            Some(Due::Ask(_)) => self.send(&Command::Status),
            Some(Due::GivenUp) => {
                self.question = None;
                self.contact.round_failed(Event::NotFound { rounds: 1 });
                // Long before the next command, which needs a silence.
                self.contact.flush();
                self.state = State::Resting { until_ns: self.contact.now_ns + ROUND_NS };
            }
            _ => {}
        }
    }

    fn starting(&mut self, next: usize) {
        match START.get(next) {
            Some(command) => {
                self.send(command);
                self.state = State::Starting { next: next + 1, at_ns: self.contact.now_ns + PAUSE_NS };
            }
            None => {
                self.contact.last_report_ns = self.contact.last_report_ns.max(self.contact.now_ns);
                self.state = State::Running { status_ns: self.contact.now_ns + STATUS_PERIOD_NS };
            }
        }
    }

    fn running(&mut self, status_ns: i64) {
        if self.contact.is_lost() {
            self.contact.say_lost();
            self.has_reported = false;
            self.ask();
        } else if self.contact.now_ns >= status_ns {
            self.send(&Command::Status);
            self.state = State::Running { status_ns: self.contact.now_ns + STATUS_PERIOD_NS };
        }
    }

    fn stopping(&mut self, next: usize) {
        match STOP.get(next) {
            Some(command) => {
                self.send(command);
                self.state = State::Stopping { next: next + 1, at_ns: self.contact.now_ns + PAUSE_NS };
            }
            None => {
                self.contact.say(Event::Stopped);
                self.state = State::Done;
            }
        }
    }

    fn reported(&mut self, offset: u64, length: usize, report: &Report<'_>) {
        match report {
            Report::Motion(motion) => self.motion(offset, length, motion),
            Report::Status(status) => self.reported_status(status),
            _ => {}
        }
    }

    fn found(&mut self) {
        self.question = None;
        self.contact.found();
        if self.contact.info.class.is_empty() {
            self.contact.info.class = ShortText::try_from("rFLEX").unwrap_or_default();
            self.contact.say(Event::Identified(self.contact.info.class.clone()));
        }
        self.state = match self.purpose {
            Purpose::Probe => State::Done,
            // The answer is behind its own 10 ms of silence.
            _ => State::Starting { next: 0, at_ns: self.contact.now_ns + PAUSE_NS },
        };
    }

    fn reported_status(&mut self, status: &SystemStatus) {
        self.battery_v = (f64::from(status.centivolts) / 100.0) as f32;
    }

    fn motion(&mut self, offset: u64, length: usize, report: &MotionReport) {
        if self.state == State::Done {
            return;
        }
        let Some(pair) = self.axes.take(self.contact.now_ns, offset, length, report) else { return };
        self.contact.last_report_ns = self.contact.now_ns;
        if !self.has_reported && self.state != State::Listening {
            self.has_reported = true;
            self.contact.say(Event::Streaming);
        }
        let scale = self.scale;
        let reading = Reading { counts: pair.counts, time_ns: self.contact.now_ns };
        let step = self.pose.take(reading, |counts| scale.motion(counts));
        let Some((odom_from_base, restarted)) = step.accepted() else { return };
        let battery_v = self.battery_v;
        let reading = OdometryReading { offset: pair.offset, length: pair.length, odom_from_base, battery_v };
        self.contact.report(reading, restarted);
    }
}

impl PacketMachine for Machine {
    type Framing = RflexFraming;
    const HEADER: u8 = 0x1B;

    fn contact(&self) -> &Contact {
        &self.contact
    }

    fn contact_mut(&mut self) -> &mut Contact {
        &mut self.contact
    }

    fn begin(&mut self) {
        self.contact.say(Event::Untried);
        self.ask();
    }

    fn packet(&mut self, offset: u64, bytes: &[u8]) -> Result<(), WireError> {
        let report = Packet::parse(bytes).and_then(|packet| packet.report());
        let read = report.map(|report| self.reported(offset, bytes.len(), &report));
        // Whatever it says: somebody is there.
        if self.state == State::Asking {
            self.found();
        }
        read
    }

    fn time(&mut self) {
        match self.state {
            State::Asking => self.asking(),
            State::Resting { until_ns } if self.contact.now_ns >= until_ns => self.ask(),
            State::Starting { next, at_ns } if self.contact.now_ns >= at_ns => self.starting(next),
            State::Running { status_ns } => self.running(status_ns),
            State::Stopping { next, at_ns } if self.contact.now_ns >= at_ns => self.stopping(next),
            _ => {}
        }
    }

    fn stop(&mut self) {
        self.question = None;
        self.state = match self.state {
            State::Done | State::Listening => State::Done,
            stopping @ State::Stopping { .. } => stopping,
            // Nobody has answered, so nothing was begun.
            State::Asking | State::Resting { .. } if self.contact.info.class.is_empty() => State::Done,
            _ => State::Stopping { next: 0, at_ns: self.contact.now_ns + PAUSE_NS },
        };
    }

    fn deadline_ns(&self) -> i64 {
        match self.state {
            State::Asking => self.question.as_ref().map_or(i64::MAX, Question::deadline_ns),
            State::Resting { until_ns } => until_ns,
            State::Starting { at_ns, .. } | State::Stopping { at_ns, .. } => at_ns,
            State::Running { status_ns } => status_ns.min(self.contact.silence_deadline_ns()),
            State::Listening | State::Done => i64::MAX,
        }
    }

    /// An answer alone is no stream: something may answer that never reports.
    fn is_streaming(&self) -> bool {
        match self.state {
            State::Running { .. } => self.has_reported,
            state => state == State::Listening,
        }
    }

    fn is_done(&self) -> bool {
        self.state == State::Done
    }
}
