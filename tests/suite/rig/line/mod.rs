//! A serial line between the engine and a mock device: bytes take their time, two rates make noise, faults
//! and plugs act.
//!
//! A byte takes ten bit times (8N1). Where the two ends run at different rates, each reads nonsense of what
//! the other sends. Nanoseconds.

pub(crate) mod byte_faults;
pub(crate) mod tape;
pub(crate) mod usb;

use std::collections::VecDeque;

use biplane_mock::devices::device::{Device, DeviceCounts};
use biplane_mock::faults::Faults;
use biplane_mock::line::transfer_ns;
use biplane_mock::line::{Channel, garble};
use biplane_mock::rng::Rng;

use super::MS;
use super::plan::Happening;
use crate::rig::devices::foreign::streaming_laser;
use crate::rig::line::byte_faults::Harm;
use crate::rig::line::tape::Tape;
use crate::rig::line::usb::{Usb, UsbParams};

/// From a write to its first bit on the line.
const WRITE_NS: i64 = 200_000;
/// Random bytes come in pieces of this length.
const BABBLE_NS: i64 = 5 * MS;

/// The device's end of a line.
struct DeviceEnd {
    device: Box<dyn Device>,
    /// When it acts next.
    next_ns: i64,
    /// The line's own device and its next turn, while a foreign one is in its place.
    away: Option<(Box<dyn Device>, i64)>,
    /// Without power.
    dark: bool,
}

/// The host's end of a line.
struct HostEnd {
    baud: u32,
    /// Bytes on their way to the device: when, what, at which rate.
    outbound: VecDeque<(i64, u8, u32)>,
    /// When the last of these has left.
    free_ns: i64,
}

/// What lies between both ends.
struct Wiring {
    to_host: Channel,
    from_host: Channel,
    usb: Usb,
    /// Nothing is unplugged.
    linked: bool,
    /// What the device sends is lost.
    muted: bool,
    /// When the next random bytes come.
    babble_ns: i64,
}

/// A line.
pub(crate) struct SimLine {
    /// What left the device, as it left.
    pub sent: Tape,
    /// What the host wrote, whether it arrived or not.
    pub asked: Tape,
    /// What reads returned.
    pub delivered: Tape,
    /// Whether the tapes are kept; they grow with time.
    pub keeps_tapes: bool,
    /// Share of requests that the device does not hear at all ("at some mirror positions").
    pub missed_share: f64,
    device_end: DeviceEnd,
    host_end: HostEnd,
    wiring: Wiring,
    seed: u64,
    stream: u64,
    rng: Rng,
    scratch: Vec<u8>,
}

impl SimLine {
    /// A line to a device; `stream` tells the lines of one seed apart.
    #[must_use]
    pub(crate) fn new(device: Box<dyn Device>, seed: u64, stream: u64) -> Self {
        Self {
            sent: Tape::default(),
            asked: Tape::default(),
            delivered: Tape::default(),
            keeps_tapes: true,
            missed_share: 0.0,
            device_end: DeviceEnd { device, next_ns: 0, away: None, dark: false },
            host_end: HostEnd { baud: 9600, outbound: VecDeque::new(), free_ns: 0 },
            wiring: Wiring {
                to_host: Channel::default(),
                from_host: Channel::default(),
                usb: Usb::new(UsbParams::default(), Rng::new(seed, 0x05B0 + stream, 0)),
                linked: true,
                muted: false,
                babble_ns: i64::MAX,
            },
            seed,
            stream,
            rng: Rng::new(seed, 0x11E0 + stream, 0),
            scratch: Vec::new(),
        }
    }

    /// The same line behind another adapter.
    #[must_use]
    pub(crate) fn behind(mut self, usb: UsbParams) -> Self {
        self.wiring.usb = Usb::new(usb, Rng::new(self.seed, 0x05B0 + self.stream, 0));
        self
    }

    /// What the device counted.
    #[must_use]
    pub(crate) fn device_counts(&self) -> DeviceCounts {
        self.device_end.device.counts()
    }

    /// Whether the device sends measurements unasked.
    #[must_use]
    pub(crate) fn device_streams(&self) -> bool {
        !self.device_end.dark && self.device_end.device.is_streaming()
    }

    /// The host writes.
    pub(crate) fn write(&mut self, now_ns: i64, bytes: &[u8]) {
        if self.keeps_tapes {
            self.asked.push(now_ns, bytes);
        }
        let missed = self.rng.unit() < self.missed_share;
        if !self.wiring.linked || missed {
            return;
        }
        self.host_end.free_ns = self.host_end.free_ns.max(now_ns + WRITE_NS);
        for &byte in bytes {
            self.host_end.free_ns += transfer_ns(1, self.host_end.baud);
            self.host_end.outbound.push_back((self.host_end.free_ns, byte, self.host_end.baud));
        }
    }

    /// The host changes its rate; what it has not read is dropped.
    pub(crate) fn set_baud(&mut self, baud: u32) {
        self.host_end.baud = baud;
        self.wiring.usb.clear();
    }

    /// Something happens to the line.
    pub(crate) fn happen(&mut self, now_ns: i64, happening: Happening) {
        match happening {
            Happening::Unplug => {
                self.wiring.linked = false;
                self.wiring.usb.clear();
                self.host_end.outbound.clear();
                self.delivered.interrupt();
            }
            Happening::Part => self.wiring.linked = false,
            Happening::Plug | Happening::Join => self.wiring.linked = true,
            Happening::PowerOff => self.device_end.dark = true,
            Happening::PowerOn => {
                self.device_end.dark = false;
                self.device_end.device.power_on(now_ns);
                self.device_end.next_ns = now_ns;
            }
            Happening::Mute => self.wiring.muted = true,
            Happening::Unmute => self.wiring.muted = false,
            Happening::Babble => self.wiring.babble_ns = now_ns,
            Happening::Clear => self.wiring.babble_ns = i64::MAX,
            Happening::Faults(presets) => {
                let faults = Faults::new(&presets, self.seed);
                let channels = [0, 1].map(|way| faults.channel(2 * self.stream + way));
                self.set_channels(now_ns, channels);
            }
            Happening::Harm(harms) => {
                let stream = 2 * self.stream;
                let [to_host, from_host] = harms;
                let channel = |harm: Option<(Harm, u32)>, way| {
                    harm.map(|(harm, once_in)| harm.channel(once_in, self.seed, stream + way))
                };
                let channels = [channel(to_host, 0), channel(from_host, 1)].map(Option::unwrap_or_default);
                self.set_channels(now_ns, channels);
            }
            Happening::ForeignDevice(foreign_device) => {
                let foreign_device = foreign_device.device(self.seed, self.stream);
                let own = std::mem::replace(&mut self.device_end.device, foreign_device);
                self.device_end.away.get_or_insert((own, self.device_end.next_ns));
                self.device_end.next_ns = now_ns;
            }
            Happening::Own => {
                if let Some(own) = self.device_end.away.take() {
                    (self.device_end.device, self.device_end.next_ns) = own;
                    self.catch_up(now_ns);
                }
            }
            Happening::OtherRate(baud) => {
                // Its own noise: the telegram under way began before, when the other one measured too.
                let stream = self.stream + 8 * (1 + now_ns.unsigned_abs() / 1_000_000_000);
                self.device_end.device = streaming_laser(baud, self.seed, stream);
                self.device_end.next_ns = now_ns;
            }
        }
    }

    fn set_channels(&mut self, now_ns: i64, [to_host, from_host]: [Channel; 2]) {
        // What a fault held back comes when the fault ends.
        let mut held = Vec::new();
        self.wiring.to_host.take(i64::MAX, &mut held);
        self.wiring.usb.push(now_ns, &held);
        (self.wiring.to_host, self.wiring.from_host) = (to_host, from_host);
    }

    /// What the device said while it was elsewhere, nobody heard.
    fn catch_up(&mut self, now_ns: i64) {
        while self.device_end.next_ns <= now_ns {
            self.scratch.clear();
            self.device_end.next_ns = self
                .device_end
                .device
                .poll(self.device_end.next_ns, &mut self.scratch)
                .max(self.device_end.next_ns + 1);
        }
    }

    /// When something is due.
    #[must_use]
    pub(crate) fn next_ns(&self) -> i64 {
        let outbound_ns = self.host_end.outbound.front().map_or(i64::MAX, |(at_ns, ..)| *at_ns);
        let device_ns = if self.device_end.dark { i64::MAX } else { self.device_end.next_ns };
        let held = [self.wiring.to_host.next_due_ns(), self.wiring.from_host.next_due_ns()];
        let held_ns = held.into_iter().flatten().min().unwrap_or(i64::MAX);
        outbound_ns.min(device_ns).min(held_ns).min(self.wiring.usb.next_ns()).min(self.wiring.babble_ns)
    }

    /// Everything that is due by `now_ns`.
    pub(crate) fn run(&mut self, now_ns: i64) {
        while self.host_end.outbound.front().is_some_and(|(at_ns, ..)| *at_ns <= now_ns) {
            if let Some((at_ns, byte, baud)) = self.host_end.outbound.pop_front() {
                self.arrive_at_device(at_ns, byte, baud);
            }
        }
        self.hear(now_ns);
        self.poll_device(now_ns);
        if self.wiring.babble_ns <= now_ns {
            self.babble(now_ns);
        }
        self.scratch.clear();
        self.wiring.to_host.take(now_ns, &mut self.scratch);
        if self.wiring.linked {
            self.wiring.usb.push(now_ns, &self.scratch);
        }
    }

    /// The next read, if one returns by `now_ns`.
    pub(crate) fn read(&mut self, now_ns: i64, out: &mut Vec<u8>) -> bool {
        out.clear();
        let Some(bytes) = self.wiring.usb.take(now_ns) else { return false };
        out.extend_from_slice(&bytes);
        if self.keeps_tapes {
            self.delivered.push(now_ns, &bytes);
        }
        true
    }

    fn arrive_at_device(&mut self, at_ns: i64, byte: u8, baud: u32) {
        if self.device_end.dark {
            return;
        }
        if self.device_hears(baud) {
            self.wiring.from_host.push(at_ns, &[byte]);
        } else {
            self.device_end.device.handle_noise(at_ns, 1);
        }
    }

    /// A device of no rate hears all.
    fn device_hears(&self, baud: u32) -> bool {
        let own = self.device_end.device.baud();
        own == baud || own == 0
    }

    fn hear(&mut self, now_ns: i64) {
        self.scratch.clear();
        self.wiring.from_host.take(now_ns, &mut self.scratch);
        if !self.device_end.dark && !self.scratch.is_empty() {
            self.device_end.device.handle(now_ns, &self.scratch);
            self.device_end.next_ns = now_ns;
        }
    }

    fn poll_device(&mut self, now_ns: i64) {
        if self.device_end.dark || self.device_end.next_ns > now_ns {
            return;
        }
        let baud = self.device_end.device.baud();
        self.scratch.clear();
        self.device_end.next_ns = self.device_end.device.poll(now_ns, &mut self.scratch).max(now_ns + 1);
        if self.keeps_tapes && self.device_end.away.is_none() {
            self.sent.push(now_ns, &self.scratch);
        }
        if self.wiring.muted || self.wiring.babble_ns != i64::MAX || self.scratch.is_empty() {
            return;
        }
        if baud == self.host_end.baud || baud == 0 {
            self.wiring.to_host.push(now_ns, &self.scratch);
        } else {
            let noise = garble(&self.scratch, baud, self.host_end.baud, &mut self.rng);
            self.wiring.to_host.push(now_ns, &noise);
        }
    }

    fn babble(&mut self, now_ns: i64) {
        let count = BABBLE_NS / transfer_ns(1, self.host_end.baud).max(1);
        let noise: Vec<u8> = (0..count).map(|_| self.rng.bits().to_le_bytes()[0]).collect();
        self.wiring.to_host.push(now_ns, &noise);
        self.wiring.babble_ns = now_ns + BABBLE_NS;
    }
}
