//! A mock rFLEX base without any input or output: state, motion reports of two axes, input reports.
//!
//! `1B 02 | port | id | opcode | n | data | xor | 1B 03`, big-endian. A command that comes less than 10 ms
//! behind another is lost, as drivers say of the real base. It drives where its world drives it. Sources: the
//! drivers of Player and CARMEN; no such base was at hand. Written apart from `biplane-wire`. Times are
//! nanoseconds.

use super::counters::{Counters, Counts, CountsFeed};
use crate::devices::device::{Device, DeviceCounts};
use crate::devices::pacing::{Kind, Line};

const MS: i64 = 1_000_000;
const US: i64 = 1_000;
/// How often a base that has nothing to do wants to be asked.
const IDLE_NS: i64 = 1_000 * MS;

/// How a mock base is made.
#[derive(Clone, Debug)]
pub struct RflexParams {
    /// Rate of the line, in Bd.
    pub baud: u32,
    /// From a command to its answer.
    pub reply_ns: i64,
    /// From power-on until it answers.
    pub boot_ns: i64,
    /// Whether an earlier client left its reports on.
    pub left_open: bool,
    /// Battery, hundredths of a volt.
    pub battery_cv: u32,
    /// Silence that a command needs before it, or it is lost. Larger asks more patience of clients; 0 hears
    /// everything.
    pub silence_ns: i64,
    /// Where the counters begin; those of a base just switched on are zero.
    pub first_counts: Counts,
}

impl Default for RflexParams {
    fn default() -> Self {
        Self {
            baud: 115_200,
            reply_ns: 2 * MS,
            boot_ns: 1_000 * MS,
            left_open: false,
            battery_cv: 2460,
            silence_ns: 10 * MS,
            first_counts: [0, 0],
        }
    }
}

/// A whole packet.
#[must_use]
pub fn packet(port: u8, id: u8, opcode: u8, data: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0x1B, 0x02, port, id, opcode, data.len().min(255) as u8];
    bytes.extend(data.iter().take(255));
    let sum = bytes[2..].iter().fold(0, |sum, byte| sum ^ byte);
    bytes.extend([sum, 0x1B, 0x03]);
    bytes
}

/// A report of one axis.
#[must_use]
pub fn motion_report(id: u8, time: u32, axis: u8, position: i32) -> Vec<u8> {
    let mut data = vec![0; 4];
    data.extend(time.to_be_bytes());
    data.push(axis);
    data.extend(position.to_be_bytes());
    data.extend([0; 12]);
    packet(2, id, 33, &data)
}

/// Reports of one kind, again and again.
#[derive(Clone, Copy, Debug, Default)]
struct Cycle {
    period_ns: i64,
    next_ns: i64,
}

impl Cycle {
    fn set(&mut self, now_ns: i64, period_us: u32) {
        *self = Self { period_ns: i64::from(period_us) * US, next_ns: now_ns };
    }

    fn is_due(&self, now_ns: i64) -> bool {
        self.period_ns > 0 && now_ns >= self.next_ns
    }

    fn done(&mut self, now_ns: i64) {
        let next_ns = self.next_ns + self.period_ns;
        self.next_ns = if next_ns > now_ns { next_ns } else { now_ns + self.period_ns };
    }
}

/// A mock base.
pub struct RflexDevice {
    params: RflexParams,
    feed: Box<dyn CountsFeed>,
    counters: Counters,
    received: Vec<u8>,
    last_command_ns: i64,
    line: Line,
    boot_until_ns: i64,
    axes: u32,
    motion: Cycle,
    inputs: Cycle,
    id: u8,
    brake_on: bool,
    counts: DeviceCounts,
}

impl RflexDevice {
    /// A base whose counters come from `feed`.
    #[must_use]
    pub fn new(params: RflexParams, feed: Box<dyn CountsFeed>) -> Self {
        let period_ns = if params.left_open { 100 * MS } else { 0 };
        Self {
            counters: Counters::new(params.first_counts),
            motion: Cycle { period_ns, next_ns: 0 },
            params,
            feed,
            received: Vec::new(),
            last_command_ns: i64::MIN,
            line: Line::default(),
            boot_until_ns: i64::MIN,
            axes: 0b11,
            inputs: Cycle::default(),
            id: 0,
            brake_on: true,
            counts: DeviceCounts::default(),
        }
    }

    /// Whether the brake is on.
    #[must_use]
    pub fn brake_is_on(&self) -> bool {
        self.brake_on
    }

    fn hear(&mut self, now_ns: i64, byte: u8) {
        self.received.push(byte);
        let wanted = [0x1B, 0x02];
        if self.received.iter().zip(wanted).any(|(received, wanted)| *received != wanted) {
            self.counts.noise_bytes += self.received.len() as u64;
            self.received.clear();
            return;
        }
        let [_, _, port, _, opcode, length, ref rest @ ..] = self.received[..] else { return };
        if rest.len() < usize::from(length) + 3 {
            return;
        }
        let (data, tail) = rest.split_at(usize::from(length));
        let sum = self.received[2..6 + data.len()].iter().fold(0, |sum, byte| sum ^ byte);
        let is_good = *tail == [sum, 0x1B, 0x03];
        let data = data.to_vec();
        self.received.clear();
        if !is_good {
            self.counts.bad_checksums += 1;
        } else if now_ns.saturating_sub(self.last_command_ns) < self.params.silence_ns {
            self.counts.refused += 1;
        } else {
            self.last_command_ns = now_ns;
            self.obey(now_ns, (port, opcode), &data);
        }
    }

    fn obey(&mut self, now_ns: i64, place: (u8, u8), data: &[u8]) {
        self.counts.requests += 1;
        let word = |at: usize| {
            data.get(at..at + 4).and_then(|word| word.try_into().ok()).map_or(0, u32::from_be_bytes)
        };
        match place {
            (1, 1) => {
                let mut state = self.clock(now_ns).to_be_bytes().to_vec();
                state.extend(self.params.battery_cv.to_be_bytes());
                state.push(u8::from(self.brake_on));
                self.send(now_ns + self.params.reply_ns, Kind::Reply, 1, 1, &state);
            }
            (2, 11) => self.brake_on = true,
            (2, 12) => self.brake_on = false,
            (2, 34) => {
                self.motion.set(now_ns + self.params.reply_ns, word(0));
                self.axes = word(4);
            }
            (5, 0) => self.inputs.set(now_ns + self.params.reply_ns, word(0)),
            _ => {}
        }
    }

    /// The base's own clock, microseconds.
    fn clock(&self, now_ns: i64) -> u32 {
        (now_ns / US) as u32
    }

    fn send(&mut self, start_ns: i64, kind: Kind, port: u8, opcode: u8, data: &[u8]) {
        self.id = self.id.wrapping_add(1);
        let bytes = packet(port, self.id, opcode, data);
        self.line.send(start_ns, self.params.baud, kind, bytes, None);
    }

    /// Puts reports that are due on the line when it is free; returns whether it did.
    fn offer(&mut self, now_ns: i64) -> bool {
        if now_ns < self.boot_until_ns || !self.line.is_idle() {
            return false;
        }
        if self.motion.is_due(now_ns) {
            self.motion.done(now_ns);
            let counts = self.counters.read(self.feed.as_mut(), now_ns);
            let time = self.clock(now_ns);
            for axis in [0, 1_u8].into_iter().filter(|axis| self.axes >> axis & 1 != 0) {
                self.id = self.id.wrapping_add(1);
                let report = motion_report(self.id, time, axis, counts[usize::from(axis)]);
                self.line.send(now_ns, self.params.baud, Kind::Stream, report, None);
            }
            return true;
        }
        if self.inputs.is_due(now_ns) {
            self.inputs.done(now_ns);
            let mut data = self.clock(now_ns).to_be_bytes().to_vec();
            data.extend([0x40, 0, 0]);
            self.send(now_ns, Kind::Reply, 5, 1, &data);
            return true;
        }
        false
    }

    fn next_report_ns(&self) -> Option<i64> {
        let due = [self.motion, self.inputs].into_iter().filter(|cycle| cycle.period_ns > 0);
        due.map(|cycle| cycle.next_ns.max(self.boot_until_ns)).min()
    }
}

impl Device for RflexDevice {
    fn handle(&mut self, now_ns: i64, bytes: &[u8]) {
        self.counts.bytes_received += bytes.len() as u64;
        if now_ns >= self.boot_until_ns {
            for &byte in bytes {
                self.hear(now_ns, byte);
            }
        }
    }

    fn handle_noise(&mut self, _now_ns: i64, count: usize) {
        self.counts.receive_noise(count);
        self.counts.noise_bytes += self.received.len() as u64;
        self.received.clear();
    }

    fn poll(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64 {
        let before = out.len();
        loop {
            match self.line.take(now_ns, out) {
                Some(kind) => self.counts.telegrams += u64::from(kind == Kind::Stream),
                None if self.offer(now_ns) => {}
                None => break,
            }
        }
        self.counts.bytes_sent += (out.len() - before) as u64;
        let due_ns = self.line.next_due_ns().or_else(|| self.next_report_ns()).unwrap_or(i64::MAX);
        due_ns.clamp(now_ns, now_ns + IDLE_NS)
    }

    fn power_on(&mut self, now_ns: i64) {
        self.received.clear();
        self.line.clear(now_ns);
        self.counters.restart();
        self.counters.read(self.feed.as_mut(), now_ns);
        (self.motion, self.inputs) = (Cycle::default(), Cycle::default());
        self.brake_on = true;
        self.boot_until_ns = now_ns + self.params.boot_ns;
    }

    fn baud(&self) -> u32 {
        self.params.baud
    }

    fn is_streaming(&self) -> bool {
        self.motion.period_ns > 0
    }

    fn counts(&self) -> DeviceCounts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::bench::hex;

    /// A count a millisecond along, none aside.
    struct Clock;

    impl CountsFeed for Clock {
        fn counts(&mut self, now_ns: i64) -> Option<Counts> {
            Some([(now_ns / MS) as i32, 7])
        }
    }

    fn run(device: &mut RflexDevice, from_ms: i64, to_ms: i64) -> Vec<u8> {
        let (mut out, mut at_ns) = (Vec::new(), from_ms * MS);
        while at_ns < to_ms * MS {
            at_ns = device.poll(at_ns, &mut out).max(at_ns + 1);
        }
        out
    }

    #[test]
    fn the_sheets_frames_are_understood_and_the_state_is_told() {
        let mut device = RflexDevice::new(RflexParams::default(), Box::new(Clock));
        device.handle(0, &hex("1B 02 01 00 01 00 00 1B 03"));
        let state = run(&mut device, 0, 20);
        assert_eq!(state[..6], hex("1B 02 01 01 01 09"));
        assert_eq!(state[10..15], hex("00 00 09 9C 01"));
        device.handle(20 * MS, &hex("1B 02 02 00 0C 00 0E 1B 03"));
        assert!(!device.brake_is_on());
    }

    #[test]
    fn both_axes_report_every_tenth_of_a_second_once_asked() {
        let mut device = RflexDevice::new(RflexParams::default(), Box::new(Clock));
        assert_eq!(run(&mut device, 0, 500), [0_u8; 0]);
        device.handle(500 * MS, &hex("1B 02 02 00 22 08 00 01 86 A0 00 00 00 03 0C 1B 03"));
        let received = run(&mut device, 500, 950);
        // From 502 ms on, five times two reports of 34 bytes; the counters begin at zero.
        assert_eq!(received.len(), 5 * 2 * 34);
        let position = |report: usize| {
            i32::from_be_bytes(received[34 * report + 15..34 * report + 19].try_into().unwrap())
        };
        assert_eq!([0, 1, 2, 3].map(position), [0, 0, 100, 0]);
        assert_eq!((received[14], received[34 + 14]), (0, 1));
        device.handle(960 * MS, &hex("1B 02 02 00 22 08 00 00 00 00 00 00 00 00 28 1B 03"));
        run(&mut device, 960, 980);
        assert_eq!(run(&mut device, 980, 2000), [0_u8; 0]);
    }

    #[test]
    fn a_command_without_silence_before_it_is_lost() {
        let mut device = RflexDevice::new(RflexParams::default(), Box::new(Clock));
        device.handle(0, &hex("1B 02 02 00 0A 00 08 1B 03 1B 02 02 00 0C 00 0E 1B 03"));
        assert!(device.brake_is_on());
        assert_eq!((device.counts().requests, device.counts().refused), (1, 1));
    }
}
