//! A mock RoboClaw in packet serial mode, without any input or output: answers questions, obeys nothing that
//! moves.
//!
//! A request is address and command, with a CRC where it writes; an answer is bare data and a CRC over
//! address, command and data. Half a request is forgotten after 10 ms of silence. Source: Basicmicro RoboClaw
//! user manual, "packet serial". Written apart from `biplane-wire`, so that the driver and the device that
//! tests it do not share a mistake. Times are nanoseconds.

use super::counters::{Counters, Counts, CountsFeed};
use crate::devices::device::{Device, DeviceCounts};
use crate::devices::pacing::{Kind, Line};

const MS: i64 = 1_000_000;
/// How often a controller that has nothing to do wants to be asked.
const IDLE_NS: i64 = 1_000 * MS;
/// A controller forgets half a request after so long.
const FORGET_NS: i64 = 10 * MS;
/// A client that has asked for counts within this time is served.
const SERVED_NS: i64 = 1_000 * MS;

/// How a mock controller is made.
#[derive(Clone, Debug)]
pub struct RoboClawParams {
    /// Its address, 128 to 135.
    pub address: u8,
    /// Rate of the line, in Bd.
    pub baud: u32,
    /// From a request to its answer. Larger lets fewer questions through.
    pub reply_ns: i64,
    /// From power-on until it answers.
    pub boot_ns: i64,
    /// Product and version, without line feed and zero.
    pub version: String,
    /// Two bytes of status, as older firmware answers, instead of four.
    pub narrow_status: bool,
    /// Status bits.
    pub status: u32,
    /// Main battery, tenths of a volt.
    pub battery_dv: u16,
    /// Where the counters begin; those of a controller just switched on are zero.
    pub first_counts: Counts,
}

impl Default for RoboClawParams {
    fn default() -> Self {
        Self {
            address: 0x80,
            baud: 38_400,
            reply_ns: MS,
            boot_ns: 500 * MS,
            version: "RoboClaw 2x15a v4.1.34".to_owned(),
            narrow_status: false,
            status: 0,
            battery_dv: 123,
            first_counts: [0, 0],
        }
    }
}

/// CRC with the polynomial 1021h from 0, as the manual writes it.
#[must_use]
pub fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |crc: u16, &byte| {
        let step = |crc: u16, _| if crc & 0x8000 == 0 { crc << 1 } else { (crc << 1) ^ 0x1021 };
        (0..8).fold(crc ^ (u16::from(byte) << 8), step)
    })
}

/// A mock controller.
pub struct RoboClawDevice {
    params: RoboClawParams,
    feed: Box<dyn CountsFeed>,
    counters: Counters,
    request: Vec<u8>,
    received_ns: i64,
    line: Line,
    boot_until_ns: i64,
    asked_ns: Option<i64>,
    counts: DeviceCounts,
}

impl RoboClawDevice {
    /// A controller whose counters come from `feed`.
    #[must_use]
    pub fn new(params: RoboClawParams, feed: Box<dyn CountsFeed>) -> Self {
        Self {
            counters: Counters::new(params.first_counts),
            params,
            feed,
            request: Vec::new(),
            received_ns: i64::MIN,
            line: Line::default(),
            boot_until_ns: i64::MIN,
            asked_ns: None,
            counts: DeviceCounts::default(),
        }
    }

    fn hear(&mut self, now_ns: i64, byte: u8) {
        if self.request.is_empty() && byte != self.params.address {
            self.counts.noise_bytes += 1;
            return;
        }
        self.request.push(byte);
        let [_, command, ref sum @ ..] = self.request[..] else { return };
        match command {
            16 | 17 | 21 | 24 | 78 | 90 => self.answer(now_ns, command),
            20 if sum.len() < 2 => {}
            20 => self.reset(now_ns),
            _ => self.refuse(),
        }
    }

    /// A command that is not for reading: it is not answered, and moves nothing.
    fn refuse(&mut self) {
        self.counts.refused += 1;
        self.request.clear();
    }

    fn reset(&mut self, now_ns: i64) {
        let request = std::mem::take(&mut self.request);
        let (head, sum) = request.split_at(2);
        if crc(head).to_be_bytes() != sum {
            self.counts.bad_checksums += 1;
            return;
        }
        self.counts.requests += 1;
        self.counters.restart();
        self.line.send(now_ns + self.params.reply_ns, self.params.baud, Kind::Reply, vec![0xFF], None);
    }

    fn answer(&mut self, now_ns: i64, command: u8) {
        self.request.clear();
        self.counts.requests += 1;
        let start_ns = (now_ns + self.params.reply_ns).max(self.line.free_ns());
        let mut kind = Kind::Reply;
        let mut data = match command {
            21 => [self.params.version.as_bytes(), b"\n\0"].concat(),
            24 => self.params.battery_dv.to_be_bytes().to_vec(),
            90 if self.params.narrow_status => (self.params.status as u16).to_be_bytes().to_vec(),
            90 => self.params.status.to_be_bytes().to_vec(),
            _ => {
                self.asked_ns = Some(now_ns);
                kind = Kind::Stream;
                let [left, right] = self.counters.read(self.feed.as_mut(), start_ns).map(i32::to_be_bytes);
                match command {
                    16 => [&left[..], &[0]].concat(),
                    17 => [&right[..], &[0]].concat(),
                    _ => [left, right].concat(),
                }
            }
        };
        let sum = crc(&[&[self.params.address, command][..], &data].concat());
        data.extend(sum.to_be_bytes());
        self.line.send(start_ns, self.params.baud, kind, data, None);
    }
}

impl Device for RoboClawDevice {
    fn handle(&mut self, now_ns: i64, bytes: &[u8]) {
        self.counts.bytes_received += bytes.len() as u64;
        if now_ns < self.boot_until_ns {
            return;
        }
        if now_ns.saturating_sub(self.received_ns) > FORGET_NS {
            self.counts.noise_bytes += self.request.len() as u64;
            self.request.clear();
        }
        self.received_ns = now_ns;
        for &byte in bytes {
            self.hear(now_ns, byte);
        }
    }

    fn handle_noise(&mut self, now_ns: i64, count: usize) {
        self.counts.receive_noise(count);
        self.counts.noise_bytes += self.request.len() as u64;
        self.received_ns = now_ns;
        self.request.clear();
    }

    fn poll(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64 {
        let before = out.len();
        if self.asked_ns.is_some_and(|asked_ns| now_ns - asked_ns > SERVED_NS) {
            self.asked_ns = None;
        }
        while let Some(kind) = self.line.take(now_ns, out) {
            self.counts.telegrams += u64::from(kind == Kind::Stream);
        }
        self.counts.bytes_sent += (out.len() - before) as u64;
        self.line.next_due_ns().unwrap_or(i64::MAX).clamp(now_ns, now_ns + IDLE_NS)
    }

    fn power_on(&mut self, now_ns: i64) {
        self.request.clear();
        self.line.clear(now_ns);
        self.counters.restart();
        self.counters.read(self.feed.as_mut(), now_ns);
        self.asked_ns = None;
        self.boot_until_ns = now_ns + self.params.boot_ns;
    }

    fn baud(&self) -> u32 {
        self.params.baud
    }

    /// It sends nothing unasked; that a client asks for counts again and again is as good.
    fn is_streaming(&self) -> bool {
        self.asked_ns.is_some()
    }

    fn counts(&self) -> DeviceCounts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A count a millisecond.
    struct Clock;

    impl CountsFeed for Clock {
        fn counts(&mut self, now_ns: i64) -> Option<Counts> {
            Some([(now_ns / MS) as i32, 0])
        }
    }

    fn ask(device: &mut RoboClawDevice, now_ns: i64, request: &[u8]) -> Vec<u8> {
        device.handle(now_ns, request);
        let (mut out, mut at_ns) = (Vec::new(), now_ns);
        while at_ns < now_ns + 40 * MS {
            at_ns = device.poll(at_ns, &mut out).max(at_ns + 1);
        }
        out
    }

    #[test]
    fn answers_are_those_worked_out_with_another_crc() {
        let mut device = RoboClawDevice::new(RoboClawParams::default(), Box::new(Clock));
        let version = b"RoboClaw 2x15a v4.1.34\n\0\x6A\x6B";
        assert_eq!(ask(&mut device, 0, &[0x80, 21]), version);
        assert_eq!(ask(&mut device, 100 * MS, &[0x80, 24]), [0x00, 0x7B, 0xF8, 0x06]);
        assert_eq!(ask(&mut device, 200 * MS, &[0x80, 20, 0x49, 0x2D]), [0xFF]);
        assert_eq!(ask(&mut device, 250 * MS, &[0x80, 20, 0x49, 0x2E]), [0_u8; 0]);
        assert_eq!(device.counts().bad_checksums, 1);
    }

    #[test]
    fn counts_are_those_of_the_moment_when_the_first_byte_leaves() {
        let mut device = RoboClawDevice::new(RoboClawParams::default(), Box::new(Clock));
        ask(&mut device, 0, &[0x80, 78]);
        let answer = ask(&mut device, 500 * MS, &[0x80, 78]);
        // First asked at 0, answered from 1 ms on; so is this one, half a second later.
        assert_eq!(answer[..8], [0, 0, 1, 0xF4, 0, 0, 0, 0]);
        assert!(device.is_streaming());
    }

    #[test]
    fn other_addresses_commands_that_drive_and_half_requests_are_not_answered() {
        let mut device = RoboClawDevice::new(RoboClawParams::default(), Box::new(Clock));
        assert_eq!(ask(&mut device, 0, &[0x81, 78]), [0_u8; 0]);
        // Forward at full speed: not obeyed, not answered.
        assert_eq!(ask(&mut device, 100 * MS, &[0x80, 0, 127, 0x11, 0x22]), [0_u8; 0]);
        assert_eq!(ask(&mut device, 200 * MS, &[0x80]), [0_u8; 0]);
        assert_eq!(ask(&mut device, 300 * MS, &[0x80, 24]).len(), 4);
    }

    #[test]
    fn power_that_comes_back_makes_it_count_from_zero_and_its_boot_keeps_it_silent() {
        let mut device = RoboClawDevice::new(RoboClawParams::default(), Box::new(Clock));
        ask(&mut device, 0, &[0x80, 78]);
        device.power_on(2_000 * MS);
        assert_eq!(ask(&mut device, 2_100 * MS, &[0x80, 78]), [0_u8; 0]);
        // The answer leaves 1 ms behind the question: 601 counts.
        assert_eq!(ask(&mut device, 2_600 * MS, &[0x80, 78])[..8], [0, 0, 2, 89, 0, 0, 0, 0]);
    }
}
