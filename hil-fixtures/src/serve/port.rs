//! One device on one pseudo-terminal: the loop that moves bytes between the two, each at its time.

use super::LinkName;
use super::clock::VirtualClock;
use super::run::Run;
use crate::device::{Device, DeviceCounts};
use crate::faults::{Channel, garble};
use crate::pty::Pty;
use crate::rng::Rng;
use std::sync::atomic::{AtomicBool, Ordering};

/// A loop looks at least this often whether it shall stop; wall time.
const LONGEST_WAIT_NS: i64 = 20_000_000;

/// A device, its terminal and its place in the rig.
pub struct Port {
    /// Name of the link.
    pub name: LinkName,
    /// Place in the run's list of devices.
    pub place: usize,
    /// The device.
    pub device: Box<dyn Device>,
    /// Its terminal.
    pub pty: Pty,
    /// Faults on the bytes from the device.
    pub to_host: Channel,
    /// Faults on the bytes to the device.
    pub from_host: Channel,
    /// Noise of a line at two rates.
    pub noise: Rng,
    /// Whether the client's rate is not looked at.
    pub any_baud: bool,
}

/// What a port has done, for the summary.
#[derive(Clone, Copy, Debug)]
pub struct PortReport {
    /// Name of the link.
    pub name: LinkName,
    /// What the device counted.
    pub device: DeviceCounts,
    /// Bytes that no client received.
    pub lost_bytes: u64,
    /// Bytes that faults changed, dropped or added.
    pub faulted_bytes: u64,
}

impl Port {
    /// Runs until `stop`.
    pub fn run(mut self, clock: VirtualClock, run: &Run, stop: &AtomicBool) -> PortReport {
        let mut out = Vec::new();
        while !stop.load(Ordering::Relaxed) {
            let now_ns = clock.now_ns();
            self.listen(now_ns);
            out.clear();
            let baud = self.device.baud();
            let due_ns = self.device.poll(now_ns, &mut out);
            run.report(self.place, self.device.is_streaming(), now_ns);
            let due_ns = self.speak(now_ns, baud, &out, due_ns);
            let wait_ns = clock.wall_between_ns(clock.now_ns(), due_ns);
            self.pty.wait(wait_ns.min(LONGEST_WAIT_NS));
        }
        self.pty.withdraw();
        PortReport {
            name: self.name,
            device: self.device.counts(),
            lost_bytes: self.pty.lost_bytes,
            faulted_bytes: self.to_host.changed_bytes() + self.from_host.changed_bytes(),
        }
    }

    /// The rate that the client has set, when it is not the device's.
    fn wrong_baud(&self, baud: u32) -> Option<u32> {
        self.pty.client_baud().filter(|&client| client != baud && !self.any_baud)
    }

    fn listen(&mut self, now_ns: i64) {
        let mut buffer = [0; 1024];
        let count = self.pty.read(&mut buffer);
        if count == 0 && !self.from_host.holds_bytes() {
            return;
        }
        if self.wrong_baud(self.device.baud()).is_some() {
            self.device.handle_noise(now_ns, count);
            return;
        }
        self.from_host.push(now_ns, &buffer[..count]);
        let mut heard = Vec::new();
        self.from_host.take(now_ns, &mut heard);
        self.device.handle(now_ns, &heard);
    }

    fn speak(&mut self, now_ns: i64, baud: u32, out: &[u8], due_ns: i64) -> i64 {
        if !out.is_empty() {
            match self.wrong_baud(baud) {
                Some(client) => {
                    let noise = garble(out, baud, client, &mut self.noise);
                    self.to_host.push(now_ns, &noise);
                }
                None => self.to_host.push(now_ns, out),
            }
        }
        let mut bytes = Vec::new();
        self.to_host.take(now_ns, &mut bytes);
        if !bytes.is_empty() {
            self.pty.write(&bytes);
        }
        let held = [self.to_host.next_due_ns(), self.from_host.next_due_ns()];
        held.into_iter().flatten().fold(due_ns, i64::min)
    }
}
