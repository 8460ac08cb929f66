//! A loose connector: every few seconds the contact is gone for a moment, and the bytes of that time with it; where it breaks and
//! comes back a byte arrives damaged.

use super::{Arrival, Fault};
use crate::rng::Rng;
use std::collections::VecDeque;

/// How loose it is.
#[derive(Clone, Copy, Debug)]
pub struct LooseConnectorParams {
    /// Mean time between interruptions, seconds. Shorter interrupts more often.
    pub mean_interval_s: f64,
    /// Shortest interruption, seconds.
    pub shortest_s: f64,
    /// Longest interruption, seconds. Beyond a second a driver has to notice the silence.
    pub longest_s: f64,
}

impl Default for LooseConnectorParams {
    fn default() -> Self {
        Self { mean_interval_s: 4.0, shortest_s: 0.002, longest_s: 0.4 }
    }
}

/// The fault.
#[derive(Debug)]
pub struct LooseConnector {
    params: LooseConnectorParams,
    rng: Rng,
    /// The next interruption: from, to.
    gap_ns: Option<(i64, i64)>,
    in_gap: bool,
}

impl LooseConnector {
    /// A connector with its own stream of random numbers.
    #[must_use]
    pub fn new(params: LooseConnectorParams, rng: Rng) -> Self {
        Self { params, rng, gap_ns: None, in_gap: false }
    }

    fn next_gap(&mut self, after_ns: i64) -> (i64, i64) {
        let wait_s = self.rng.exponential(self.params.mean_interval_s);
        let length_s = self.rng.between(self.params.shortest_s, self.params.longest_s);
        let from_ns = after_ns + (wait_s * 1e9) as i64;
        (from_ns, from_ns + (length_s * 1e9) as i64)
    }
}

impl Fault for LooseConnector {
    fn pass(&mut self, now_ns: i64, bytes: &[u8], arrivals: &mut VecDeque<Arrival>) -> u64 {
        let mut gap_ns = match self.gap_ns {
            Some(gap_ns) => gap_ns,
            None => self.next_gap(now_ns),
        };
        while gap_ns.1 <= now_ns {
            gap_ns = self.next_gap(gap_ns.1);
        }
        self.gap_ns = Some(gap_ns);
        let open = now_ns >= gap_ns.0;
        let edge = open != self.in_gap;
        self.in_gap = open;
        let mut kept = if open { Vec::new() } else { bytes.to_vec() };
        if edge {
            kept.truncate(bytes.len().saturating_sub(1));
            kept.insert(0, self.rng.bits().to_le_bytes()[0]);
        }
        let touched = if open { bytes.len() as u64 } else { u64::from(edge) };
        if !kept.is_empty() {
            arrivals.push_back(Arrival { at_ns: now_ns, bytes: kept });
        }
        touched
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn about_a_twentieth_of_the_bytes_is_lost_in_stretches() {
        let mut connector = LooseConnector::new(LooseConnectorParams::default(), Rng::new(1, 1, 1));
        let mut arrivals = VecDeque::new();
        for step in 0..1_000_000 {
            connector.pass(step * 1_000_000, &[1], &mut arrivals);
        }
        let lost = 1_000_000 - arrivals.len();
        assert!((30_000..70_000).contains(&lost), "{lost}");
        let gaps =
            arrivals.iter().zip(arrivals.iter().skip(1)).filter(|(a, b)| b.at_ns - a.at_ns > 1_000_000);
        assert!((150..350).contains(&gaps.count()));
    }
}
