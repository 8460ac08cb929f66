//! One direction of a serial line with its faults: bytes leave at one end and arrive at the other, some
//! later, some changed, some never.
//!
//! Times are nanoseconds on the device's clock.

use crate::rng::Rng;
use std::collections::VecDeque;

/// One fault on one direction of one line.
pub trait Fault: Send {
    /// Bytes that left at `now_ns` become bytes that arrive, some later, some changed, some never. Returns
    /// how many it touched.
    fn pass(&mut self, now_ns: i64, bytes: &[u8], arrivals: &mut VecDeque<Arrival>) -> u64;
}

/// Bytes and when they arrive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// When.
    pub at_ns: i64,
    /// What.
    pub bytes: Vec<u8>,
}

/// A direction of a line with its faults, the first of them nearest to the sender.
#[derive(Default)]
pub struct Channel {
    stages: Vec<(Box<dyn Fault>, VecDeque<Arrival>)>,
    arrived: VecDeque<Arrival>,
    changed_bytes: u64,
}

impl Channel {
    /// Faults of one's own, the first nearest to the sender.
    #[must_use]
    pub fn of(faults: Vec<Box<dyn Fault>>) -> Self {
        let stages = faults.into_iter().map(|fault| (fault, VecDeque::new()));
        Self { stages: stages.collect(), ..Self::default() }
    }

    /// Whether nothing acts on it.
    #[must_use]
    pub fn is_faultless(&self) -> bool {
        self.stages.is_empty()
    }

    /// Bytes leave the sender.
    pub fn push(&mut self, now_ns: i64, bytes: &[u8]) {
        if !bytes.is_empty() {
            self.feed(0, now_ns, bytes);
        }
    }

    fn feed(&mut self, stage: usize, now_ns: i64, bytes: &[u8]) {
        match self.stages.get_mut(stage) {
            Some((fault, waiting)) => self.changed_bytes += fault.pass(now_ns, bytes, waiting),
            None => self.arrived.push_back(Arrival { at_ns: now_ns, bytes: bytes.to_vec() }),
        }
    }

    /// Appends what has arrived by `now_ns`.
    pub fn take(&mut self, now_ns: i64, out: &mut Vec<u8>) {
        for stage in 0..self.stages.len() {
            while self.stages[stage].1.front().is_some_and(|arrival| arrival.at_ns <= now_ns) {
                if let Some(arrival) = self.stages[stage].1.pop_front() {
                    self.feed(stage + 1, arrival.at_ns, &arrival.bytes);
                }
            }
        }
        while let Some(arrival) = self.arrived.pop_front() {
            out.extend(arrival.bytes);
        }
    }

    /// When the next bytes arrive.
    #[must_use]
    pub fn next_due_ns(&self) -> Option<i64> {
        self.stages.iter().filter_map(|(_, waiting)| waiting.front()).map(|arrival| arrival.at_ns).min()
    }

    /// Whether bytes are on the way.
    #[must_use]
    pub fn holds_bytes(&self) -> bool {
        self.next_due_ns().is_some()
    }

    /// Bytes changed, dropped or delayed by a fault so far.
    #[must_use]
    pub fn changed_bytes(&self) -> u64 {
        self.changed_bytes
    }
}

/// What a host at `client_baud` reads of bytes sent at `baud`: nonsense, more of it when it reads faster.
#[must_use]
pub fn garble(bytes: &[u8], baud: u32, client_baud: u32, rng: &mut Rng) -> Vec<u8> {
    let ratio = (f64::from(client_baud) / f64::from(baud.max(1))).clamp(0.02, 4.0);
    let mut noise = Vec::new();
    let mut owed = rng.unit();
    for _ in bytes {
        owed += ratio;
        while owed >= 1.0 {
            owed -= 1.0;
            noise.push(rng.bits().to_le_bytes()[0]);
        }
    }
    noise
}
