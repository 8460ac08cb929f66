//! A loose connector: every few seconds the contact is gone for a moment, and the bytes of that time with it;
//! where it breaks and comes back a byte arrives damaged.

use crate::faults::episodes::{EpisodeParams, Episodes};
use crate::line::{Arrival, Fault};
use crate::rng::Rng;
use std::collections::VecDeque;

/// How loose it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LooseConnectorParams {
    /// The interruptions. Beyond a second a driver has to notice the silence.
    pub gaps: EpisodeParams,
}

impl Default for LooseConnectorParams {
    fn default() -> Self {
        let gaps =
            EpisodeParams { shortest_pause_s: 0.0, mean_pause_s: 4.0, shortest_s: 0.002, longest_s: 0.4 };
        Self { gaps }
    }
}

/// The fault.
#[derive(Debug)]
pub struct LooseConnector {
    rng: Rng,
    gaps: Episodes,
    in_gap: bool,
}

impl LooseConnector {
    /// A connector with its own stream of random numbers.
    #[must_use]
    pub fn new(params: LooseConnectorParams, mut rng: Rng) -> Self {
        let gaps = Episodes::by_chance(params.gaps, rng.branch());
        Self { rng, gaps, in_gap: false }
    }
}

impl Fault for LooseConnector {
    fn pass(&mut self, now_ns: i64, bytes: &[u8], arrivals: &mut VecDeque<Arrival>) -> u64 {
        let open = self.gaps.at(now_ns).is_some();
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
