//! A serial line that carries one telegram after another, and counts those that have to wait.

use super::{EncodeOptions, EncodeReport};
use crate::line::Adapter;

/// A line that carries one telegram after another.
pub(crate) struct BusyLine {
    pub(crate) adapter: Adapter,
    pub(crate) free_ns: i64,
    last_stamp_ns: i64,
    pub(crate) latest_stamp_ns: i64,
}

impl BusyLine {
    pub(crate) fn new(options: &EncodeOptions, line: u64) -> Self {
        let adapter = Adapter::new(options.reads, options.seed, line);
        Self { adapter, free_ns: i64::MIN, last_stamp_ns: i64::MIN, latest_stamp_ns: i64::MIN }
    }

    /// Sends `bytes` at `due_ns` or when the line is free; `arrival_ns` is a byte's time after the first bit.
    pub(crate) fn send(
        &mut self,
        bytes: &[u8],
        due_ns: i64,
        byte_ns: i64,
        arrival_ns: impl Fn(usize) -> i64,
    ) -> i64 {
        let start_ns = due_ns.max(self.free_ns);
        for (index, byte) in bytes.iter().enumerate() {
            self.free_ns = start_ns + arrival_ns(index);
            self.adapter.push(*byte, self.free_ns, byte_ns);
        }
        start_ns - due_ns
    }

    pub(crate) fn count(&mut self, stamp_ns: i64, delay_ns: i64, report: &mut EncodeReport) {
        report.backward_stamps += u64::from(stamp_ns < self.last_stamp_ns);
        self.last_stamp_ns = stamp_ns;
        self.latest_stamp_ns = self.latest_stamp_ns.max(stamp_ns);
        report.delayed += u64::from(delay_ns > 0);
        report.longest_delay_ms = report.longest_delay_ms.max(delay_ns as f64 * 1e-6);
    }
}
