//! What the session of a base, or of another device that speaks in packets, keeps of its line: when something
//! came, what is said of an outage, what waits to be done.
//!
//! Units: nanoseconds, bits per second.

use biplane_wire::WireError;

use crate::session::base::reading::{BaseInfo, OdometryReading};
use crate::session::device_session::Output;
use crate::session::event::Event;
use crate::session::queues::Outputs;
use crate::session::timing::silence;

/// While an answer is awaited, a pause of this length ends a packet: longer than any adapter's usual delay.
const ANSWER_GAP_NS: i64 = 60_000_000;
/// So many requests of zeros are longer than the longest packet (255 bytes and its head and tail).
const FLUSHES: usize = 5;

/// The line to a device, as one machine's states know it.
#[derive(Debug)]
pub struct Contact {
    pub(crate) baud: u32,
    /// Without a report for so long, a base that reports is lost.
    silence_ns: i64,
    pub(crate) info: BaseInfo,
    /// What a unit of its position was last taken as, of a base with such units, meters.
    pub(crate) metres_per_tick: Option<f64>,
    pub(crate) outputs: Outputs,
    pub(crate) now_ns: i64,
    pub(crate) last_report_ns: i64,
    pub(crate) last_byte_ns: i64,
    /// When a port that was gone came back.
    port_back_ns: i64,
    /// That reports stay out has been said, and none has come since.
    is_loss_reported: bool,
    /// Rounds of asking, one after the other, that nobody answered.
    rounds: u32,
}

impl Contact {
    pub(crate) fn new(baud: u32, silence_ns: i64, now_ns: i64) -> Self {
        Self {
            baud,
            silence_ns,
            info: BaseInfo::default(),
            metres_per_tick: None,
            outputs: Outputs::default(),
            now_ns,
            last_report_ns: now_ns,
            last_byte_ns: now_ns,
            port_back_ns: i64::MIN,
            is_loss_reported: false,
            rounds: 0,
        }
    }

    pub(crate) fn say(&mut self, event: Event) {
        self.outputs.say(event);
    }

    pub(crate) fn send(&mut self, emit: impl FnOnce(&mut [u8]) -> Result<usize, WireError>) {
        self.outputs.write(emit);
    }

    /// Whether nothing came for longer before what comes now than a packet may pause.
    pub(crate) fn has_paused(&self) -> bool {
        self.now_ns.saturating_sub(self.last_byte_ns) > ANSWER_GAP_NS
    }

    /// A base that got a packet with a damaged length waits for its rest: bytes that begin no packet end
    /// that, and mean nothing otherwise.
    pub(crate) fn flush(&mut self) {
        for _ in 0..FLUSHES {
            self.send(|out| {
                out.fill(0);
                Ok(out.len())
            });
        }
    }

    pub(crate) fn set_rate(&mut self) {
        self.outputs.push(Output::SetBaud(self.baud));
    }

    /// Hands on where the base is; that it counts anew is said before.
    pub(crate) fn report(&mut self, reading: OdometryReading, restarted: bool) {
        if restarted {
            self.say(Event::OdometryRestarted);
        }
        self.is_loss_reported = false;
        self.outputs.push(Output::Odometry(reading));
    }

    /// A measurement has come, which its machine hands on: when the next stay out, that is said.
    pub(crate) fn measured(&mut self) {
        self.last_report_ns = self.now_ns;
        self.is_loss_reported = false;
    }

    /// A round of asking has led to nothing: says so, once. Who waits for hours need not read it every few
    /// seconds.
    pub(crate) fn round_failed(&mut self, event: Event) {
        self.rounds += 1;
        if self.rounds == 1 {
            self.say(event);
        }
    }

    /// Whether the last round of asking led to nothing.
    pub(crate) fn has_failed(&self) -> bool {
        self.rounds > 0
    }

    /// The base answers: when it is lost again, that is said again.
    pub(crate) fn found(&mut self) {
        self.rounds = 0;
    }

    /// Until when a report must come.
    pub(crate) fn silence_deadline_ns(&self) -> i64 {
        silence::deadline_ns(self.last_report_ns, self.silence_ns, self.port_back_ns)
    }

    /// Whether reports stay out by now.
    pub(crate) fn is_lost(&self) -> bool {
        self.now_ns >= self.silence_deadline_ns()
    }

    /// Says for how long there were no reports, and whether other bytes came instead; once until one comes:
    /// something may answer that never reports.
    pub(crate) fn say_lost(&mut self) {
        if std::mem::replace(&mut self.is_loss_reported, true) {
            return;
        }
        let silent_ns = self.now_ns - self.last_report_ns;
        let for_ms = u32::try_from(silent_ns / 1_000_000).unwrap_or(u32::MAX);
        let bytes_came = self.last_byte_ns - self.last_report_ns > self.silence_ns / 2;
        self.say(if bytes_came { Event::Garbled { for_ms } } else { Event::Silent { for_ms } });
    }

    /// The port was gone and is there again; the base may report as before.
    pub(crate) fn port_back(&mut self) {
        self.port_back_ns = self.now_ns;
        self.set_rate();
    }
}
