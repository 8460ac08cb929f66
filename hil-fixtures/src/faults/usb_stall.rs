//! A USB adapter that delivers late: a little always, some milliseconds now and then, and every few seconds everything of a while
//! at once. No byte is lost or changed; only the times are.

use super::{Arrival, Fault};
use crate::rng::Rng;
use std::collections::VecDeque;

/// How late it delivers.
#[derive(Clone, Copy, Debug)]
pub struct UsbStallParams {
    /// Mean of the usual delay (exponential), milliseconds.
    pub mean_delay_ms: f64,
    /// Share of deliveries with a hiccup.
    pub hiccup_rate: f64,
    /// Longest hiccup, milliseconds.
    pub longest_hiccup_ms: f64,
    /// Mean time between stalls, seconds. Shorter stalls more often.
    pub mean_interval_s: f64,
    /// Longest stall, milliseconds. Beyond a driver's patience it takes the device for silent.
    pub longest_stall_ms: f64,
}

impl Default for UsbStallParams {
    fn default() -> Self {
        Self {
            mean_delay_ms: 0.3,
            hiccup_rate: 0.004,
            longest_hiccup_ms: 8.0,
            mean_interval_s: 5.0,
            longest_stall_ms: 300.0,
        }
    }
}

/// The fault.
#[derive(Debug)]
pub struct UsbStall {
    params: UsbStallParams,
    rng: Rng,
    stall_ns: Option<(i64, i64)>,
    last_arrival_ns: i64,
}

impl UsbStall {
    /// An adapter with its own stream of random numbers.
    #[must_use]
    pub fn new(params: UsbStallParams, rng: Rng) -> Self {
        Self { params, rng, stall_ns: None, last_arrival_ns: i64::MIN }
    }

    fn next_stall(&mut self, after_ns: i64) -> (i64, i64) {
        let from_ns = after_ns + (self.rng.exponential(self.params.mean_interval_s) * 1e9) as i64;
        (from_ns, from_ns + (self.rng.between(0.0, self.params.longest_stall_ms) * 1e6) as i64)
    }
}

impl Fault for UsbStall {
    fn pass(&mut self, now_ns: i64, bytes: &[u8], arrivals: &mut VecDeque<Arrival>) -> u64 {
        let mut stall_ns = match self.stall_ns {
            Some(stall_ns) => stall_ns,
            None => self.next_stall(now_ns),
        };
        while stall_ns.1 <= now_ns {
            stall_ns = self.next_stall(stall_ns.1);
        }
        self.stall_ns = Some(stall_ns);
        let mut delay_ms = self.rng.exponential(self.params.mean_delay_ms);
        if self.rng.unit() < self.params.hiccup_rate {
            delay_ms += self.rng.between(0.0, self.params.longest_hiccup_ms);
        }
        let mut at_ns = now_ns + (delay_ms * 1e6) as i64;
        if now_ns >= stall_ns.0 {
            at_ns = at_ns.max(stall_ns.1);
        }
        let at_ns = at_ns.max(self.last_arrival_ns);
        self.last_arrival_ns = at_ns;
        arrivals.push_back(Arrival { at_ns, bytes: bytes.to_vec() });
        if now_ns >= stall_ns.0 { bytes.len() as u64 } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_keep_their_order_and_arrive_after_they_left() {
        let mut stall = UsbStall::new(UsbStallParams::default(), Rng::new(1, 1, 1));
        let mut arrivals = VecDeque::new();
        for step in 0..100_000i64 {
            stall.pass(step * 1_000_000, &step.to_le_bytes()[..3], &mut arrivals);
        }
        let mut before_ns = i64::MIN;
        let mut latest_ns = 0;
        for (step, arrival) in (0..).zip(&arrivals) {
            assert_eq!(arrival.bytes, i64::to_le_bytes(step)[..3]);
            assert!(arrival.at_ns >= step * 1_000_000 && arrival.at_ns >= before_ns);
            before_ns = arrival.at_ns;
            latest_ns = latest_ns.max(arrival.at_ns - step * 1_000_000);
        }
        assert!(latest_ns > 150_000_000, "{latest_ns}");
    }
}
