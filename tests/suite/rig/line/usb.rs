//! A USB adapter on the way to the computer: bytes arrive in order, a little late, now and then some
//! milliseconds late.
//!
//! Causal: what it does with bytes depends on what came before them alone. Nanoseconds.

use std::collections::VecDeque;

use biplane_mock::rng::Rng;

/// How late it hands bytes over.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UsbParams {
    /// Mean of the usual delay (exponential), milliseconds.
    pub mean_ms: f64,
    /// Share of deliveries with a hiccup.
    pub hiccup_share: f64,
    /// Longest hiccup, milliseconds.
    pub hiccup_ms: f64,
    /// It hands bytes over at multiples of this only, milliseconds; 0: at any time.
    pub tick_ms: f64,
}

impl Default for UsbParams {
    fn default() -> Self {
        Self { mean_ms: 0.3, hiccup_share: 0.004, hiccup_ms: 8.0, tick_ms: 0.0 }
    }
}

/// The adapter.
#[derive(Debug)]
pub(crate) struct Usb {
    params: UsbParams,
    rng: Rng,
    waiting: VecDeque<(i64, Vec<u8>)>,
    last_ns: i64,
}

impl Usb {
    /// An adapter with its own random numbers.
    #[must_use]
    pub(crate) fn new(params: UsbParams, rng: Rng) -> Self {
        Self { params, rng, waiting: VecDeque::new(), last_ns: i64::MIN }
    }

    /// Bytes have come off the line.
    pub(crate) fn push(&mut self, now_ns: i64, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        let mut late_ms = self.rng.exponential(self.params.mean_ms);
        if self.rng.unit() < self.params.hiccup_share {
            late_ms += self.rng.between(0.0, self.params.hiccup_ms);
        }
        let tick_ns = ((self.params.tick_ms * 1e6) as i64).max(1);
        let due_ns = now_ns + (late_ms * 1e6) as i64;
        self.last_ns = self.last_ns.max((due_ns + tick_ns - 1) / tick_ns * tick_ns);
        match self.waiting.back_mut().filter(|last| tick_ns > 1 && last.0 == self.last_ns) {
            Some(last) => last.1.extend_from_slice(bytes),
            None => self.waiting.push_back((self.last_ns, bytes.to_vec())),
        }
    }

    /// When the next read returns.
    #[must_use]
    pub(crate) fn next_ns(&self) -> i64 {
        self.waiting.front().map_or(i64::MAX, |(at_ns, _)| *at_ns)
    }

    /// The read that returns by `now_ns`.
    pub(crate) fn take(&mut self, now_ns: i64) -> Option<Vec<u8>> {
        if self.next_ns() > now_ns {
            return None;
        }
        self.waiting.pop_front().map(|(_, bytes)| bytes)
    }

    /// Everything that waits is lost.
    pub(crate) fn clear(&mut self) {
        self.waiting.clear();
    }
}
