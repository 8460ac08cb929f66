//! When the computer gets the bytes of a line: a USB adapter hands them over in packets, a little late and
//! now and then very late.

use super::channel::{Arrival, Fault};
use super::latency_timer::{LatencyTimer, LatencyTimerParams};
use crate::rng::Rng;
use std::collections::VecDeque;

/// How bytes reach the program that reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadParams {
    /// Most bytes that one read returns, without a latency timer. Larger: fewer, longer reads.
    pub max_bytes: usize,
    /// Mean lateness of a read after its last byte (exponential). Larger: noisier arrival times.
    pub lateness_mean_ms: f64,
    /// Share of reads that come very late. Larger: more outliers among arrival times.
    pub hiccup_share: f64,
    /// A very late read comes up to this much later.
    pub hiccup_max_ms: f64,
    /// Latency timer of the adapter: bytes wait until a packet of 62 is full or the timer has run out. 0:
    /// none.
    pub timer_ms: f64,
}

impl Default for ReadParams {
    fn default() -> Self {
        Self { max_bytes: 32, lateness_mean_ms: 0.3, hiccup_share: 0.004, hiccup_max_ms: 8.0, timer_ms: 0.0 }
    }
}

/// Most bytes of a read from a network: the payload of an Ethernet frame.
const SEGMENT_BYTES: usize = 1460;

impl ReadParams {
    /// The same for a network: bytes come in segments, and no adapter holds them back.
    #[must_use]
    pub fn on_network(self) -> Self {
        Self { max_bytes: SEGMENT_BYTES, timer_ms: 0.0, ..self }
    }
}

/// One read: when it returned, and what.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SerialRead {
    /// Time, nanoseconds.
    pub time_ns: i64,
    /// Bytes.
    pub bytes: Vec<u8>,
}

/// Turns bytes with their times into reads, one line at a time.
#[derive(Clone, Debug)]
pub struct Adapter {
    params: ReadParams,
    rng: Rng,
    timer: Option<LatencyTimer>,
    /// Packets on their way to a read; without a timer only the one that is being filled.
    packets: VecDeque<Arrival>,
    wanted: usize,
    reads: Vec<SerialRead>,
}

impl Adapter {
    /// An adapter of its own; `line` tells lines of one seed apart.
    #[must_use]
    pub fn new(params: ReadParams, seed: u64, line: u64) -> Self {
        let mut rng = Rng::new(seed, 0xADA, line.cast_signed());
        let wanted = wanted(&params, &mut rng);
        let timer = LatencyTimerParams { timer_ms: params.timer_ms, ..LatencyTimerParams::default() };
        let timer = (params.timer_ms > 0.0).then(|| LatencyTimer::new(timer));
        Self { params, rng, timer, packets: VecDeque::new(), wanted, reads: Vec::new() }
    }

    /// A byte that has arrived at `time_ns`; `byte_ns` is the time of one byte. Times do not step back.
    pub fn push(&mut self, byte: u8, time_ns: i64, byte_ns: i64) {
        match &mut self.timer {
            Some(timer) => {
                timer.pass(time_ns, &[byte], &mut self.packets);
                while self.packets.len() > 1 {
                    self.read();
                }
            }
            None => self.gather(byte, time_ns, byte_ns),
        }
    }

    /// Bytes that follow each other without a pause come in one read, as many as it wants.
    fn gather(&mut self, byte: u8, time_ns: i64, byte_ns: i64) {
        if let Some(packet) = self.packets.front()
            && (time_ns - packet.at_ns > 2 * byte_ns || packet.bytes.len() >= self.wanted)
        {
            self.read();
        }
        match self.packets.front_mut() {
            Some(packet) => {
                packet.at_ns = time_ns;
                packet.bytes.push(byte);
            }
            None => self.packets.push_back(Arrival { at_ns: time_ns, bytes: vec![byte] }),
        }
    }

    /// The first packet is read, late.
    fn read(&mut self) {
        let Some(Arrival { at_ns, bytes }) = self.packets.pop_front() else { return };
        let params = &self.params;
        let mut late_ms = self.rng.exponential(params.lateness_mean_ms);
        if self.rng.unit() < params.hiccup_share {
            late_ms += self.rng.between(0.0, params.hiccup_max_ms);
        }
        let mut time_ns = at_ns + (late_ms * 1e6) as i64;
        if let Some(before) = self.reads.last() {
            time_ns = time_ns.max(before.time_ns);
        }
        self.reads.push(SerialRead { time_ns, bytes });
        self.wanted = wanted(&self.params, &mut self.rng);
    }

    /// All reads.
    #[must_use]
    pub fn finish(mut self) -> Vec<SerialRead> {
        while !self.packets.is_empty() {
            self.read();
        }
        self.reads
    }
}

/// How many bytes the next read will bring at most.
fn wanted(params: &ReadParams, rng: &mut Rng) -> usize {
    1 + (rng.unit() * params.max_bytes as f64) as usize
}

#[cfg(test)]
mod tests {
    use super::super::{laser_byte_ns, scans_per_telegram, transfer_ns};
    use super::{Adapter, ReadParams};
    use crate::rig::scanner::TURN_NS;

    #[test]
    fn every_nth_scan_is_sent_with_the_n_of_the_listings_table() {
        // SICK telegram listing 8007954, table of lost scans: 401 values (100/0.25), 361 (180/0.5), 181
        // (180/1), 181 with remission (S14): bytes, turns of a scan.
        let columns = [(812, 4), (732, 2), (372, 1), (559, 1)];
        let table = [(9600, [16, 29, 30, 44]), (19_200, [8, 15, 15, 22]), (38_400, [4, 8, 8, 11])];
        for (baud, expected) in table {
            let found = columns.map(|(bytes, turns)| scans_per_telegram(bytes, baud, turns * TURN_NS));
            assert_eq!(found, expected, "{baud} Bd");
        }
    }

    #[test]
    fn with_a_latency_timer_reads_come_in_packets_up_to_16_ms_late_and_nothing_is_lost() {
        let byte_ns = transfer_ns(1, 38_400);
        let params = ReadParams { timer_ms: 16.0, hiccup_share: 0.0, ..ReadParams::default() };
        let mut adapter = Adapter::new(params, 1, 0);
        let due: Vec<i64> = (0..20_000_i64).map(|n| n * byte_ns + n / 372 * 9_700_000).collect();
        for (n, time_ns) in due.iter().enumerate() {
            adapter.push((n % 251) as u8, *time_ns, byte_ns);
        }
        let reads = adapter.finish();
        let bytes: Vec<u8> = reads.iter().flat_map(|read| read.bytes.clone()).collect();
        assert!(bytes.iter().enumerate().all(|(n, byte)| *byte == (n % 251) as u8) && bytes.len() == 20_000);
        let mut next = 0;
        let (mut latest_ns, mut waited_ms) = (0, 0.0);
        for read in &reads {
            assert!(read.bytes.len() <= 62);
            latest_ns = latest_ns.max(read.time_ns - due[next]);
            next += read.bytes.len();
            assert!(read.time_ns >= due[next - 1]);
            waited_ms += (read.time_ns - due[next - 1]) as f64 * 1e-6 / reads.len() as f64;
        }
        // The first byte of a packet waits up to the whole timer, and then for the read.
        assert!((15_000_000..19_500_000).contains(&latest_ns), "{latest_ns}");
        assert!((0.3..8.0).contains(&waited_ms), "{waited_ms}");
    }

    #[test]
    fn output_periods_are_those_of_the_listing_and_of_a_real_device() {
        // bytes, baud, mirror turns of a scan, period in ms: transfer time, rounded up to whole scans (213.1
        // ms measured on an LMS 200)
        for (bytes, baud, turns, period_ms) in [
            (372, 38_400, 1, 106.56),
            (732, 38_400, 2, 213.12),
            (732, 9600, 2, 772.56),
            (372, 9600, 1, 399.6),
            (372, 500_000, 1, 13.32),
            (732, 500_000, 2, 26.64),
            (812, 500_000, 4, 53.28),
        ] {
            let scan_ns = turns * TURN_NS;
            let period = scans_per_telegram(bytes, baud, scan_ns) * scan_ns;
            assert!((period as f64 * 1e-6 - period_ms).abs() < 1e-9, "{bytes} at {baud}: {period}");
        }
    }

    #[test]
    fn at_500000_bd_a_long_telegram_takes_two_turns() {
        // 508 bytes in one turn, the remaining 224 in the next: 13.32 + 4.48 ms.
        assert_eq!(laser_byte_ns(731, 500_000), 17_800_000);
        assert_eq!(laser_byte_ns(507, 500_000), 10_160_000);
        assert_eq!(laser_byte_ns(371, 38_400), 96_875_000);
    }

    #[test]
    fn reads_return_every_byte_in_order_late_by_the_mean_asked_for() {
        let byte_ns = transfer_ns(1, 38_400);
        let params = ReadParams { hiccup_share: 0.0, ..ReadParams::default() };
        let mut adapter = Adapter::new(params, 1, 0);
        let mut due = Vec::new();
        for index in 0..40_000_i64 {
            // Pauses after every 372 bytes.
            let time_ns = index * byte_ns + index / 372 * 9_000_000;
            due.push(time_ns);
            adapter.push((index % 251) as u8, time_ns, byte_ns);
        }
        let reads = adapter.finish();
        let bytes: Vec<u8> = reads.iter().flat_map(|read| read.bytes.clone()).collect();
        assert!(
            bytes.iter().enumerate().all(|(i, byte)| *byte == (i % 251) as u8) && bytes.len() == due.len()
        );
        let (mut end, mut late_ns) = (0, 0.0);
        for read in &reads {
            assert!((1..=params.max_bytes).contains(&read.bytes.len()));
            end += read.bytes.len();
            let last_ns = due[end - 1];
            assert!(read.time_ns >= last_ns && last_ns - due[end - read.bytes.len()] < 9_000_000);
            late_ns += (read.time_ns - last_ns) as f64 / reads.len() as f64;
        }
        assert!((late_ns * 1e-6 - 0.3).abs() < 0.03, "{late_ns}");
        assert!(reads.windows(2).all(|pair| pair[0].time_ns <= pair[1].time_ns));
    }
}
