//! A mock Hokuyo laser (URG, UTM, UXM, UST) on a serial line, on USB or on a network, without any input or
//! output: it answers SCIP 2.0 and streams scans with the time of a clock of its own.
//!
//! Sources: Hokuyo C-42-03320B and byte logs of three devices. What a second client meets is known of no
//! device: here it is refused while there is a first.

pub mod model;
mod requests;
mod stream;
mod turns;

use biplane_wire::scip::{Delivery, ScanRequest};

use crate::devices::device::{Device, DeviceCounts};
use crate::devices::pacing::{Kind, Line};
use crate::rig::fan::FanSource;
pub use model::{ScipLink, ScipParams, ScipState, turns};
use requests::{Effect, Memory, RequestLines};
use stream::MeasuredScans;
pub use stream::ScipScans;
pub use turns::scan_reply;

/// How often a device that has nothing to do wants to be asked.
const IDLE_NS: i64 = 1_000_000_000;
/// A line that is no serial one, in Bd as bytes leave it: Ethernet, and USB at a tenth of that.
const NETWORK_BAUD: u32 = 100_000_000;
const USB_BAUD: u32 = 10_000_000;
/// A caller that is late by less than this finds the scans that have left meanwhile.
const LATEST_NS: i64 = 500_000_000;

/// A stream that runs.
#[derive(Clone, Debug)]
struct Stream {
    request: ScanRequest,
    /// The client's own text in the request.
    tag: Option<Vec<u8>>,
    turn: i64,
    is_once: bool,
}

/// A mock laser.
pub struct ScipDevice {
    params: ScipParams,
    scans: Box<dyn ScipScans>,
    lines: RequestLines,
    memory: Memory,
    line: Line,
    stream: Option<Stream>,
    /// From then on it answers.
    awake_ns: i64,
    /// An old laser that was asked for what it does not know says nothing until it is switched off.
    hangs: bool,
    counts: DeviceCounts,
}

impl ScipDevice {
    /// A laser that measures what `source` gives.
    #[must_use]
    pub fn new(params: ScipParams, source: FanSource) -> Self {
        let scans = MeasuredScans::new(&params, source);
        Self::of_scans(params, Box::new(scans))
    }

    /// A laser that sends these scans.
    #[must_use]
    pub fn of_scans(params: ScipParams, scans: Box<dyn ScipScans>) -> Self {
        let mut device = Self {
            memory: Memory::of(&params),
            scans,
            lines: RequestLines::default(),
            line: Line::default(),
            stream: None,
            awake_ns: i64::MIN,
            hangs: false,
            counts: DeviceCounts::default(),
            params,
        };
        if device.params.state == ScipState::Streaming {
            device.left_in(ScipState::Streaming, 0);
        }
        device
    }

    /// Another client leaves it so.
    pub fn left_in(&mut self, state: ScipState, now_ns: i64) {
        self.memory.state = state;
        self.stream = (state == ScipState::Streaming).then(|| {
            let parameters = self.params.parameters;
            let request = ScanRequest {
                delivery: Delivery::Stream { skip: 0, count: 0 },
                all_echoes: false,
                with_intensity: false,
                first_step: parameters.front_step - 40,
                last_step: parameters.front_step + 40,
                cluster: 2,
            };
            Stream { request, tag: None, turn: self.scans.turn_from(now_ns), is_once: false }
        });
    }

    /// Bytes leave the device at this rate.
    fn line_baud(&self) -> u32 {
        match self.params.link {
            ScipLink::Serial(_) => self.memory.baud,
            ScipLink::Usb => USB_BAUD,
            ScipLink::Network => NETWORK_BAUD,
        }
    }

    fn answer(&mut self, now_ns: i64, text: &[u8]) {
        if text.is_empty() || self.hangs || now_ns < self.awake_ns {
            return;
        }
        self.counts.requests += 1;
        let Some(answer) = self.memory.answer(&self.params, &*self.scans, text, now_ns) else {
            self.hangs = true;
            return;
        };
        self.counts.refused += u64::from(answer.is_refused);
        if matches!(answer.effect, Effect::Stop | Effect::Stream(_) | Effect::Reset | Effect::Reboot) {
            self.stop(now_ns);
        }
        let start_ns = now_ns + self.params.latency_ns;
        let kind = match answer.effect {
            Effect::Baud(baud) => Kind::ReplyThenBaud(baud),
            Effect::Reboot => Kind::ReplyThenReset,
            _ => Kind::Reply,
        };
        self.line.send(start_ns, self.line_baud(), kind, answer.bytes, None);
        self.follow(answer.effect, text, start_ns);
    }

    fn follow(&mut self, effect: Effect, text: &[u8], start_ns: i64) {
        let place = text.iter().position(|&byte| byte == b';');
        let tag = place.and_then(|place| text.get(place + 1..)).map(<[u8]>::to_vec);
        match effect {
            Effect::Stream(request) => {
                let turn = self.scans.turn_from(start_ns);
                self.stream = Some(Stream { request, tag, turn, is_once: false });
            }
            Effect::Once(request) => {
                let turn = self.scans.turn_from(start_ns);
                self.stream = Some(Stream { request, tag, turn, is_once: true });
            }
            Effect::Reset => self.scans.reset_clock(start_ns),
            Effect::None | Effect::Stop | Effect::Reboot | Effect::Baud(_) => {}
        }
    }

    /// The scan that is on the line is cut.
    fn stop(&mut self, now_ns: i64) {
        self.stream = None;
        let (_, cut) = self.line.interrupt(now_ns);
        self.counts.cut += u64::from(cut == Some(Kind::Stream));
    }

    /// Puts the scans on the line that have been measured by now; whole ones are left out while it is busy.
    fn measure(&mut self, now_ns: i64) {
        let baud = self.line_baud();
        while let Some(stream) = &mut self.stream {
            let sent_ns = self.scans.sent_ns(&self.params, &stream.request, stream.turn);
            if sent_ns > now_ns {
                return;
            }
            let turn = stream.turn;
            stream.turn += turns(&stream.request);
            if self.line.free_ns() > sent_ns + self.scans.waits_ns() || now_ns - sent_ns > LATEST_NS {
                self.counts.skipped += 1;
                continue;
            }
            let mut is_last = stream.is_once;
            if let Delivery::Stream { count, .. } = &mut stream.request.delivery
                && *count > 0
            {
                *count -= 1;
                is_last |= *count == 0;
            }
            let (request, tag) = (stream.request, stream.tag.clone());
            let bytes = self.scans.reply(&self.params, &request, turn, tag.as_deref());
            self.line.send(sent_ns, baud, Kind::Stream, bytes, None);
            self.counts.telegrams += 1;
            if is_last {
                self.stream = None;
                self.memory.state = ScipState::Idle;
            }
        }
    }
}

impl Device for ScipDevice {
    fn handle(&mut self, now_ns: i64, bytes: &[u8]) {
        self.counts.bytes_received += bytes.len() as u64;
        let mut requests = Vec::new();
        self.lines.feed(bytes, |line| requests.push(line.to_vec()));
        for request in requests {
            self.answer(now_ns, &request);
        }
    }

    fn handle_noise(&mut self, _: i64, count: usize) {
        self.counts.receive_noise(count);
        self.lines.clear();
    }

    fn poll(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64 {
        let sent = out.len();
        self.measure(now_ns);
        while let Some(kind) = self.line.take(now_ns, out) {
            match kind {
                Kind::ReplyThenBaud(baud) => {
                    self.memory.baud = baud;
                    break;
                }
                Kind::ReplyThenReset => {
                    self.power_on(now_ns);
                    break;
                }
                _ => {}
            }
        }
        self.counts.bytes_sent += (out.len() - sent) as u64;
        let scan_ns =
            self.stream.as_ref().map(|stream| self.scans.sent_ns(&self.params, &stream.request, stream.turn));
        let due = [self.line.next_due_ns(), scan_ns];
        due.into_iter().flatten().min().unwrap_or(now_ns + IDLE_NS)
    }

    fn power_on(&mut self, now_ns: i64) {
        self.memory.power_on(&self.params);
        self.stream = None;
        self.hangs = false;
        self.lines.clear();
        self.line.clear(now_ns);
        self.awake_ns = now_ns + self.params.boot_ns;
        self.scans.reset_clock(now_ns);
    }

    fn connected(&mut self, now_ns: i64) {
        self.lines.clear();
        self.line.clear(now_ns);
    }

    fn disconnected(&mut self, now_ns: i64) {
        self.connected(now_ns);
        self.stream = None;
        if self.memory.state == ScipState::Streaming {
            self.memory.state = ScipState::Idle;
        }
    }

    fn baud(&self) -> u32 {
        match self.params.link {
            ScipLink::Serial(_) => self.memory.baud,
            ScipLink::Usb | ScipLink::Network => 0,
        }
    }

    fn is_streaming(&self) -> bool {
        self.stream.is_some()
    }

    fn counts(&self) -> DeviceCounts {
        self.counts
    }
}
