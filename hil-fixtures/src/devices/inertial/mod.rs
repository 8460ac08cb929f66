//! A mock Xsens MTi unit without any input or output: wake-up, config and measuring state, outputs, samples.
//!
//! `FA FF | MID | length | data | sum`, big-endian. It measures by itself half a second after it was switched
//! on, unless somebody answers its wake-up. Measurements average the time since the one before and leave a
//! moment after its end. Sources: Xsens MT0101P; no such unit was at hand. Written apart from `biplane-wire`.
//! Times are nanoseconds.

pub mod feed;
pub mod message;
pub mod outputs;
#[cfg(test)]
mod tests;

use crate::devices::device::{Device, DeviceCounts};
use crate::devices::pacing::{Kind, Line};
use feed::InertialFeed;
use message::{MessageParser, message};
use outputs::Outputs;

const MS: i64 = 1_000_000;
/// How often a unit that has nothing to do wants to be asked.
const IDLE_NS: i64 = 1_000 * MS;
/// Nanoseconds of a tick of its clock.
const TICK_NS: f64 = 100_000.0;

/// How a mock unit is made.
#[derive(Clone, Debug)]
pub struct XsensParams {
    /// Rate of the line, in Bd.
    pub baud: u32,
    /// Its number.
    pub device_id: u32,
    /// The outputs that are set, as its memory keeps them.
    pub outputs: Outputs,
    /// From a command to its answer.
    pub reply_ns: i64,
    /// From power-on to its wake-up.
    pub boot_ns: i64,
    /// From its wake-up until it measures unless it is answered.
    pub wake_ns: i64,
    /// From the end of a sample to the first byte of its message.
    pub latency_ns: i64,
    /// By how many millionths its clock runs fast.
    pub clock_ppm: f64,
    /// Ten-thousandths of a second that its clock shows at time 0; one that is switched on begins at 0.
    pub first_ticks: u32,
    /// Whether an earlier client left it in the config state.
    pub left_idle: bool,
    /// The most samples a second that it makes; it sends no more when it is asked for more.
    pub fastest_hz: u16,
}

impl Default for XsensParams {
    fn default() -> Self {
        Self {
            baud: 115_200,
            device_id: 0x0380_0D10,
            outputs: Outputs::factory(),
            reply_ns: 2 * MS,
            boot_ns: 600 * MS,
            wake_ns: 500 * MS,
            latency_ns: 3 * MS / 2,
            clock_ppm: 25.0,
            first_ticks: 0,
            left_idle: false,
            fastest_hz: 400,
        }
    }
}

/// What it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// It starts; then it says that it is awake.
    Booting { until_ns: i64 },
    /// It has said so, and waits for an answer.
    Waking { until_ns: i64 },
    /// It takes settings.
    Config,
    /// It measures; its next sample ends at this time.
    Measuring { next_ns: i64 },
}

/// A mock unit.
pub struct XsensDevice {
    params: XsensParams,
    feed: Box<dyn InertialFeed>,
    outputs: Outputs,
    parser: MessageParser,
    line: Line,
    state: State,
    /// When its clock showed `first_ticks`.
    clock_from_ns: i64,
    first_ticks: u32,
    counter: u16,
    counts: DeviceCounts,
}

impl XsensDevice {
    /// A unit whose samples come from `feed`.
    #[must_use]
    pub fn new(params: XsensParams, feed: Box<dyn InertialFeed>) -> Self {
        Self {
            state: if params.left_idle { State::Config } else { State::Measuring { next_ns: 0 } },
            outputs: params.outputs.clone(),
            first_ticks: params.first_ticks,
            params,
            feed,
            parser: MessageParser::default(),
            line: Line::default(),
            clock_from_ns: 0,
            counter: 0,
            counts: DeviceCounts::default(),
        }
    }

    fn reply(&mut self, now_ns: i64, mid: u8, data: &[u8]) {
        let start_ns = now_ns + self.params.reply_ns;
        self.line.send(start_ns, self.params.baud, Kind::Reply, message(mid, data), None);
    }

    fn obey(&mut self, now_ns: i64, mid: u8, data: &[u8]) {
        self.counts.requests += 1;
        match (mid, self.state) {
            (0x30, _) => {
                self.state = State::Config;
                self.reply(now_ns, 0x31, &[]);
            }
            (0x3F, State::Waking { .. }) => self.state = State::Config,
            (0x40, _) => {
                self.reply(now_ns, 0x41, &[]);
                self.start(now_ns);
            }
            (0x00, State::Config) => {
                let id = self.params.device_id.to_be_bytes();
                self.reply(now_ns, 0x01, &id);
            }
            (0x10, State::Config) => {
                self.reply(now_ns, 0x11, &[]);
                self.counter = 0;
                self.state = State::Measuring { next_ns: now_ns + self.params.reply_ns };
            }
            (0xC0, State::Config) => {
                if !data.is_empty() {
                    self.outputs = Outputs::parse(data, self.params.fastest_hz);
                }
                let set = self.outputs.bytes();
                self.reply(now_ns, 0xC1, &set);
            }
            // While it measures it hears nothing else; an answer to its wake-up may come late.
            (0x3F, _) | (_, State::Measuring { .. } | State::Booting { .. }) => self.counts.refused += 1,
            _ => {
                self.counts.refused += 1;
                self.reply(now_ns, 0x42, &[0x04]);
            }
        }
    }

    fn start(&mut self, now_ns: i64) {
        self.state = State::Booting { until_ns: now_ns + self.params.boot_ns };
        (self.clock_from_ns, self.first_ticks) = (now_ns, 0);
    }

    fn ticks(&self, at_ns: i64) -> u32 {
        let passed_ns = (at_ns - self.clock_from_ns) as f64 * (1.0 + self.params.clock_ppm * 1e-6);
        self.first_ticks.wrapping_add((passed_ns / TICK_NS).floor() as i64 as u32)
    }

    /// What is due by itself; returns whether anything was.
    fn advance(&mut self, now_ns: i64) -> bool {
        match self.state {
            State::Booting { until_ns } if now_ns >= until_ns => {
                self.line.send(until_ns, self.params.baud, Kind::Reply, message(0x3E, &[]), None);
                self.state = State::Waking { until_ns: until_ns + self.params.wake_ns };
            }
            State::Waking { until_ns } if now_ns >= until_ns => {
                self.state = State::Measuring { next_ns: until_ns };
            }
            State::Measuring { next_ns } if now_ns >= next_ns => self.measure(now_ns, next_ns),
            _ => return false,
        }
        true
    }

    fn measure(&mut self, now_ns: i64, end_ns: i64) {
        let period_ns = self.outputs.period_ns();
        // A source that stood still does not catch up.
        let end_ns = if now_ns - end_ns > IDLE_NS { now_ns } else { end_ns };
        self.state = State::Measuring { next_ns: end_ns + period_ns };
        let Some(sample) = self.feed.sample(end_ns - period_ns / 2, period_ns) else { return };
        let items = self.outputs.items(self.counter, self.ticks(end_ns), &sample);
        self.counter = self.counter.wrapping_add(1);
        let start_ns = end_ns + self.params.latency_ns;
        self.line.send(start_ns, self.params.baud, Kind::Stream, message(0x36, &items), None);
    }

    fn next_ns(&self) -> Option<i64> {
        match self.state {
            State::Booting { until_ns } | State::Waking { until_ns } => Some(until_ns),
            State::Measuring { next_ns } => Some(next_ns),
            State::Config => None,
        }
    }
}

impl Device for XsensDevice {
    fn handle(&mut self, now_ns: i64, bytes: &[u8]) {
        self.counts.bytes_received += bytes.len() as u64;
        if matches!(self.state, State::Booting { .. }) {
            return;
        }
        for &byte in bytes {
            if let Some((mid, data)) = self.parser.hear(byte) {
                self.obey(now_ns, mid, &data);
            }
        }
    }

    fn handle_noise(&mut self, _now_ns: i64, count: usize) {
        self.counts.receive_noise(count);
        self.parser.forget();
    }

    fn poll(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64 {
        let before = out.len();
        loop {
            match self.line.take(now_ns, out) {
                Some(kind) => self.counts.telegrams += u64::from(kind == Kind::Stream),
                None if self.advance(now_ns) => {}
                None => break,
            }
        }
        self.counts.bytes_sent += (out.len() - before) as u64;
        let due_ns = [self.line.next_due_ns(), self.next_ns()].into_iter().flatten().min();
        due_ns.unwrap_or(i64::MAX).clamp(now_ns, now_ns + IDLE_NS)
    }

    /// Its outputs are in its memory; its state, its clock and its count are not.
    fn power_on(&mut self, now_ns: i64) {
        self.line.clear(now_ns);
        self.parser.forget();
        self.counter = 0;
        self.start(now_ns);
    }

    fn baud(&self) -> u32 {
        self.params.baud
    }

    fn is_streaming(&self) -> bool {
        matches!(self.state, State::Measuring { .. })
    }

    fn counts(&self) -> DeviceCounts {
        let noise_bytes = self.counts.noise_bytes + self.parser.dropped_bytes;
        DeviceCounts { noise_bytes, bad_checksums: self.parser.bad_checksums, ..self.counts }
    }
}
