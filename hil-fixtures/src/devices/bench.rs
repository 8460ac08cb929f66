//! For tests: a device on a bench in simulated time, which notes when which byte left.

use crate::devices::device::Device;
use crate::devices::lms::scans::feed::Timeline;

/// A device, a clock, and what came out.
pub(crate) struct Bench<D> {
    pub(crate) device: D,
    pub(crate) now_ns: i64,
    /// Bytes and when their stop bits ended.
    pub(crate) received: Vec<(i64, u8)>,
}

impl<D: Device> Bench<D> {
    pub(crate) fn of(device: D) -> Self {
        Self { device, now_ns: 0, received: Vec::new() }
    }

    pub(crate) fn run_ms(&mut self, duration_ms: i64) {
        let end_ns = self.now_ns + duration_ms * 1_000_000;
        loop {
            let mut out = Vec::new();
            let due_ns = self.device.poll(self.now_ns, &mut out);
            let portion = out.into_iter().map(|byte| (self.now_ns, byte));
            self.received.extend(portion);
            if due_ns > end_ns {
                break;
            }
            self.now_ns = due_ns.max(self.now_ns + 1);
        }
        self.now_ns = end_ns;
    }

    /// Sends something now, forgetting what was heard before.
    pub(crate) fn send(&mut self, request: &[u8]) {
        self.received.clear();
        self.device.handle(self.now_ns, request);
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.received.iter().map(|&(_, byte)| byte).collect()
    }
}

/// A device whose time is the world's.
pub(crate) struct Same;

impl Timeline for Same {
    fn world_ns(&self, device_ns: i64) -> i64 {
        device_ns
    }
}

pub(crate) fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("hex in a test")).collect()
}
