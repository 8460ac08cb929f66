//! A USB adapter that delivers late: a little always, some milliseconds now and then, and every few seconds
//! everything of a while at once. No byte is lost or changed; only the times are.

use crate::faults::episodes::{EpisodeParams, Episodes};
use crate::line::{Arrival, Fault};
use crate::rng::Rng;
use std::collections::VecDeque;

/// How late it delivers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UsbStallParams {
    /// Mean of the usual delay (exponential), milliseconds.
    pub mean_delay_ms: f64,
    /// Share of deliveries with a hiccup.
    pub hiccup_rate: f64,
    /// Longest hiccup, milliseconds.
    pub longest_hiccup_ms: f64,
    /// The stalls. Beyond a driver's patience it takes the device for silent.
    pub stalls: EpisodeParams,
}

impl Default for UsbStallParams {
    fn default() -> Self {
        let stalls =
            EpisodeParams { shortest_pause_s: 0.0, mean_pause_s: 5.0, shortest_s: 0.0, longest_s: 0.3 };
        Self { mean_delay_ms: 0.3, hiccup_rate: 0.004, longest_hiccup_ms: 8.0, stalls }
    }
}

/// The fault.
#[derive(Debug)]
pub struct UsbStall {
    params: UsbStallParams,
    rng: Rng,
    stalls: Episodes,
    last_arrival_ns: i64,
}

impl UsbStall {
    /// An adapter with its own stream of random numbers.
    #[must_use]
    pub fn new(params: UsbStallParams, mut rng: Rng) -> Self {
        let stalls = Episodes::by_chance(params.stalls, rng.branch());
        Self { params, rng, stalls, last_arrival_ns: i64::MIN }
    }
}

impl Fault for UsbStall {
    fn pass(&mut self, now_ns: i64, bytes: &[u8], arrivals: &mut VecDeque<Arrival>) -> u64 {
        let stall = self.stalls.at(now_ns);
        let mut delay_ms = self.rng.exponential(self.params.mean_delay_ms);
        if self.rng.unit() < self.params.hiccup_rate {
            delay_ms += self.rng.between(0.0, self.params.longest_hiccup_ms);
        }
        let mut at_ns = now_ns + (delay_ms * 1e6) as i64;
        if let Some(stall) = stall {
            at_ns = at_ns.max(stall.to_ns);
        }
        let at_ns = at_ns.max(self.last_arrival_ns);
        self.last_arrival_ns = at_ns;
        arrivals.push_back(Arrival { at_ns, bytes: bytes.to_vec() });
        if stall.is_some() { bytes.len() as u64 } else { 0 }
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
