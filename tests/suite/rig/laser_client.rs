//! Another program on a laser's line, instead of the engine: it says its requests and waits for their
//! answers, as the adapter lets it have them.
//!
//! Times are nanoseconds since the start.

use biplane_mock::devices::device::DeviceCounts;
use biplane_mock::devices::lms::frame::checksum;

use crate::rig::line::SimLine;

/// Code of a scan.
pub(crate) const SCAN: u8 = 0xB0;
/// Longest telegram that a laser sends.
const LONGEST_TELEGRAM: usize = 820;

/// A program with a laser's port open.
pub(crate) struct LaserClient {
    line: SimLine,
    now_ns: i64,
    received: Vec<u8>,
    /// Bytes of it that have been taken.
    taken: usize,
    chunk: Vec<u8>,
}

impl LaserClient {
    /// A program that has just opened the port of this line, at this rate.
    #[must_use]
    pub(crate) fn new(mut line: SimLine, baud: u32) -> Self {
        line.set_baud(baud);
        Self { line, now_ns: 0, received: Vec::new(), taken: 0, chunk: Vec::new() }
    }

    /// The time that has been reached.
    #[must_use]
    pub(crate) fn now_ns(&self) -> i64 {
        self.now_ns
    }

    /// What the device counted.
    #[must_use]
    pub(crate) fn device_counts(&self) -> DeviceCounts {
        self.line.device_counts()
    }

    /// Changes the rate of the port; what has not been taken is dropped.
    pub(crate) fn set_baud(&mut self, baud: u32) {
        self.line.set_baud(baud);
        self.taken = self.received.len();
    }

    /// Says this now.
    pub(crate) fn say(&mut self, request: &[u8]) {
        self.line.write(self.now_ns, request);
    }

    /// Lets time pass; what comes meanwhile waits.
    pub(crate) fn pass(&mut self, duration_ns: i64) {
        self.run(self.now_ns + duration_ns, |_| false);
    }

    /// The next whole telegram, waited for so long.
    pub(crate) fn wait(&mut self, max_ns: i64) -> Option<Vec<u8>> {
        let mut telegram = self.take();
        if telegram.is_none() {
            self.run(self.now_ns + max_ns, |client| {
                telegram = client.take();
                telegram.is_some()
            });
        }
        telegram
    }

    fn run(&mut self, end_ns: i64, mut until: impl FnMut(&mut Self) -> bool) {
        while self.line.next_ns() <= end_ns {
            self.now_ns = self.now_ns.max(self.line.next_ns());
            self.line.run(self.now_ns);
            while self.line.read(self.now_ns, &mut self.chunk) {
                self.received.extend_from_slice(&self.chunk);
            }
            if until(self) {
                return;
            }
        }
        self.now_ns = end_ns;
    }

    /// The first whole telegram among what has not been taken; what stands before it is dropped.
    fn take(&mut self) -> Option<Vec<u8>> {
        let waiting = &self.received[self.taken..];
        let (end, telegram) =
            (0..waiting.len()).find_map(|at| intact(&waiting[at..]).map(|t| (at + t.len(), t.to_vec())))?;
        self.taken += end;
        Some(telegram)
    }
}

/// The intact telegram at the front.
fn intact(bytes: &[u8]) -> Option<&[u8]> {
    let &[0x02, 0x80, low, high, ..] = bytes else { return None };
    let length = usize::from(u16::from_le_bytes([low, high])) + 6;
    let telegram = bytes.get(..length).filter(|_| length <= LONGEST_TELEGRAM)?;
    let (covered, sum) = telegram.split_at(length - 2);
    (checksum(covered).to_le_bytes() == sum).then_some(telegram)
}
