//! A session around the state machine of a laser that states the time of its scans itself (CoLa, SCIP): bytes
//! to telegrams, telegrams to the machine, what the machine wants to whoever drives the session.

use biplane_wire::framing::{Deframer, Framing};
use biplane_wire::{Counts, Item};

use crate::session::device_session::{Input, Output, Session};
use crate::session::lms::health::LaserHealth;
use crate::session::lms::streaming::self_truncated::{SelfTruncation, TruncationCounts};
use crate::session::queues::{Intake, Outputs};

/// What a session is for.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Goal {
    /// Scans.
    Stream,
    /// Who the device is and how it measures.
    Probe,
}

/// What a machine does at the moment.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Phase {
    /// It only listens to what once came.
    Listening,
    /// It asks, or waits for a new connection.
    Asking,
    /// Scans are awaited, or flow.
    Streaming,
    /// Nothing more is to be done.
    Done,
}

/// The state machine of one protocol.
pub(crate) trait LaserMachine: Sized {
    /// What the rig asks of the laser.
    type Settings;
    /// What is known of the laser.
    type Info;
    /// The scan that is taken over from a telegram.
    type Scan: Default;

    /// A machine that listens until [`LaserMachine::begin`].
    fn new(settings: Self::Settings, goal: Goal, now_ns: i64) -> Self;

    /// A line or a connection is there: everything begins.
    fn begin(&mut self);

    /// What follows happens at this time.
    fn set_now(&mut self, now_ns: i64);

    /// Time has passed.
    fn time(&mut self);

    /// Bytes have come.
    fn received(&mut self, _bytes: &[u8]) {}

    /// A piece of the stream; a scan is taken over into `scan`.
    fn item(&mut self, item: Item<'_>, scan: &mut Self::Scan);

    /// The port does not run at this rate.
    fn rate_refused(&mut self, _baud: u32) {}

    /// The device shall be left idle.
    fn stop(&mut self);

    /// What it does at the moment.
    fn phase(&self) -> Phase;

    /// When it has to be told of the time.
    fn deadline_ns(&self) -> i64;

    /// The rate of the line, bits per second; 0 on a network.
    fn baud(&self) -> u32 {
        0
    }

    /// What is known of the laser.
    fn info(&self) -> &Self::Info;

    /// What it has seen of its device.
    fn health(&self) -> &LaserHealth;

    /// What waits to be polled.
    fn outputs(&self) -> &Outputs;

    /// The same, to be taken.
    fn outputs_mut(&mut self) -> &mut Outputs;
}

/// A session with one laser: `M` its machine, `F` how its telegrams are framed, in `N` bytes at most.
#[derive(Debug)]
pub(crate) struct MachineSession<M: LaserMachine, F, const N: usize> {
    intake: Intake,
    deframer: Deframer<F, N>,
    machine: M,
    scan: M::Scan,
    self_truncation: SelfTruncation,
    now_ns: i64,
}

impl<M: LaserMachine, F: Framing, const N: usize> MachineSession<M, F, N> {
    /// A session that brings the laser to stream; the connection is there.
    #[must_use]
    pub(crate) fn streaming(settings: M::Settings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Stream, now_ns);
        session.host_sent(now_ns);
        session.machine.begin();
        session
    }

    /// A session that asks the laser what it is, changes nothing, and is done.
    #[must_use]
    pub(crate) fn probing(settings: M::Settings, now_ns: i64) -> Self {
        let mut session = Self::new(settings, Goal::Probe, now_ns);
        session.machine.begin();
        session
    }

    /// A session that only listens to what once came from a laser.
    #[must_use]
    pub(crate) fn listening(settings: M::Settings, now_ns: i64) -> Self {
        Self::new(settings, Goal::Stream, now_ns)
    }

    fn new(settings: M::Settings, goal: Goal, now_ns: i64) -> Self {
        Self {
            intake: Intake::default(),
            deframer: Deframer::new(),
            machine: M::new(settings, goal, now_ns),
            scan: M::Scan::default(),
            self_truncation: SelfTruncation::default(),
            now_ns,
        }
    }

    /// What is known of the laser.
    #[must_use]
    pub(crate) fn info(&self) -> &M::Info {
        self.machine.info()
    }

    /// What it has seen of its device.
    #[must_use]
    pub(crate) fn health(&self) -> &LaserHealth {
        self.machine.health()
    }

    /// The scan that [`Output::TimedScan`] tells of, until the next one.
    #[must_use]
    pub(crate) fn scan(&self) -> &M::Scan {
        &self.scan
    }

    /// Telegrams that were cut because we stopped the laser.
    #[must_use]
    pub(crate) fn truncated(&self) -> TruncationCounts {
        self.self_truncation.truncated(self.deframer.counts())
    }

    /// Something was sent to the laser at this time, now or in a recording.
    pub(crate) fn host_sent(&mut self, now_ns: i64) {
        self.self_truncation.asked(now_ns, self.deframer.counts());
    }

    /// A scan has come.
    fn note_flow(&mut self) {
        let counts = self.deframer.counts();
        match self.machine.phase() {
            Phase::Streaming => self.self_truncation.measured(counts),
            Phase::Listening => self.self_truncation.recorded(self.now_ns, counts),
            Phase::Asking | Phase::Done => {}
        }
    }

    /// Whether scans flow.
    #[must_use]
    pub(crate) fn is_streaming(&self) -> bool {
        matches!(self.machine.phase(), Phase::Streaming | Phase::Listening)
    }

    /// The input ends: what the deframer still holds is let go. Drain [`Session::poll`] afterwards.
    pub(crate) fn finish(&mut self) {
        self.deframer.finish();
    }

    /// What the old connection has cut off has no rest; a machine that is at work begins anew.
    fn port_back(&mut self) {
        self.deframer.abandon();
        if matches!(self.machine.phase(), Phase::Asking | Phase::Streaming) {
            self.machine.begin();
        }
    }

    /// Takes the next piece of the stream; false when there is none.
    fn read_on(&mut self) -> bool {
        if let Some(item) = self.deframer.next() {
            self.machine.item(item, &mut self.scan);
            return true;
        }
        self.intake.hand_on(&mut self.deframer)
    }
}

impl<M: LaserMachine, F: Framing, const N: usize> Session for MachineSession<M, F, N> {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.now_ns = now_ns;
        self.machine.set_now(now_ns);
        match input {
            Input::Bytes(bytes) => {
                self.machine.received(bytes);
                self.intake.take(bytes);
                return;
            }
            Input::Time => {}
            Input::RateRefused(baud) => self.machine.rate_refused(baud),
            Input::PortBack => self.port_back(),
            Input::Stop => {
                self.host_sent(now_ns);
                self.machine.stop();
            }
        }
        self.machine.time();
    }

    /// One piece at a time, so that a scan is taken before the next one comes.
    fn poll(&mut self) -> Output {
        loop {
            if let Some(output) = self.machine.outputs_mut().pop() {
                if matches!(output, Output::TimedScan) {
                    self.note_flow();
                }
                return output;
            }
            if self.read_on() {
                continue;
            }
            // Only now is it known what came until now.
            self.machine.time();
            if self.machine.outputs().is_empty() {
                return Output::WaitUntil(self.machine.deadline_ns());
            }
        }
    }

    fn is_done(&self) -> bool {
        self.machine.phase() == Phase::Done && self.machine.outputs().is_empty()
    }

    fn baud(&self) -> u32 {
        self.machine.baud()
    }

    fn counts(&self) -> Counts {
        self.deframer.counts()
    }

    fn overflowed(&self) -> u64 {
        self.machine.outputs().overflowed()
    }
}
