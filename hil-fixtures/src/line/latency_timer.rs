//! The latency timer of a USB adapter: bytes wait in the adapter until a packet is full or a timer runs out.
//!
//! An FTDI chip hands a packet to the host when its 62 bytes are full, or when the timer has run since the
//! packet before (16 ms unless the driver sets another); an empty packet goes out then, too, and starts the
//! timer anew. So the tail of a telegram arrives up to one timer late, in step with nothing. (FTDI
//! application note AN232B-04.) No preset: the delay is the adapter's usual behavior, not a fault of it.

use super::channel::{Arrival, Fault};
use std::collections::VecDeque;

/// How the adapter waits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatencyTimerParams {
    /// The timer, milliseconds. Larger: later tails of telegrams.
    pub timer_ms: f64,
    /// Bytes of a full packet. Larger: fewer packets, more waiting.
    pub packet_bytes: usize,
}

impl Default for LatencyTimerParams {
    fn default() -> Self {
        Self { timer_ms: 16.0, packet_bytes: 62 }
    }
}

/// The timer, and the packet that waits for it.
#[derive(Clone, Debug)]
pub(crate) struct LatencyTimer {
    timer_ns: i64,
    packet_bytes: usize,
    /// When the last packet went out, full or by the timer.
    handed_over_ns: i64,
    /// Bytes in the packet that is not full: the last of the arrivals.
    waiting: usize,
}

impl LatencyTimer {
    /// A timer that started at time 0.
    #[must_use]
    pub(crate) fn new(params: LatencyTimerParams) -> Self {
        let timer_ns = ((params.timer_ms * 1e6) as i64).max(1);
        Self { timer_ns, packet_bytes: params.packet_bytes.max(1), handed_over_ns: 0, waiting: 0 }
    }

    /// One byte; what was handed over before `now_ns` is out of reach.
    fn take(&mut self, now_ns: i64, byte: u8, arrivals: &mut VecDeque<Arrival>) {
        let due_ns = self.handed_over_ns + self.timer_ns;
        if due_ns <= now_ns {
            let run_out = (now_ns - self.handed_over_ns).div_euclid(self.timer_ns);
            self.handed_over_ns += run_out * self.timer_ns;
            self.waiting = 0;
        }
        match arrivals.back_mut().filter(|_| self.waiting > 0) {
            Some(packet) => packet.bytes.push(byte),
            None => {
                let at_ns = self.handed_over_ns + self.timer_ns;
                arrivals.push_back(Arrival { at_ns, bytes: vec![byte] });
            }
        }
        self.waiting += 1;
        if self.waiting == self.packet_bytes {
            if let Some(packet) = arrivals.back_mut() {
                packet.at_ns = now_ns;
            }
            self.handed_over_ns = now_ns;
            self.waiting = 0;
        }
    }
}

impl Fault for LatencyTimer {
    fn pass(&mut self, now_ns: i64, bytes: &[u8], arrivals: &mut VecDeque<Arrival>) -> u64 {
        bytes.iter().for_each(|&byte| self.take(now_ns, byte, arrivals));
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn packets(bytes: &[(i64, u8)]) -> Vec<(i64, usize)> {
        let mut timer = LatencyTimer::new(LatencyTimerParams::default());
        let mut arrivals = VecDeque::new();
        for &(now_ns, byte) in bytes {
            timer.pass(now_ns, &[byte], &mut arrivals);
        }
        arrivals.iter().map(|arrival| (arrival.at_ns, arrival.bytes.len())).collect()
    }

    #[test]
    fn a_packet_goes_when_it_is_full_or_when_the_timer_has_run_since_the_one_before() {
        // A byte each 0.26 ms as at 38400 Bd: 61 in the first 16 ms, so the timer is first, then again.
        let slow: Vec<(i64, u8)> = (1..=100).map(|n| (n * 260_416, 0)).collect();
        assert_eq!(packets(&slow), [(16 * MS, 61), (32 * MS, 39)]);
        // A byte each 20 us as at 500000 Bd: full packets, then the rest a timer after the last full one.
        let fast: Vec<(i64, u8)> = (1..=150).map(|n| (n * 20_000, 0)).collect();
        assert_eq!(packets(&fast), [(62 * 20_000, 62), (124 * 20_000, 62), (124 * 20_000 + 16 * MS, 26)]);
    }

    #[test]
    fn after_a_silence_the_timer_is_where_it_would_be_by_itself() {
        assert_eq!(packets(&[(1000 * MS + 5, 1)]), [(1008 * MS, 1)]);
        assert_eq!(packets(&[(3 * MS, 1), (15 * MS, 2), (16 * MS, 3)]), [(16 * MS, 2), (32 * MS, 1)]);
    }
}
