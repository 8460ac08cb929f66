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
    device: Box<dyn Device>,
    /// The line's own device and its next turn, while a stranger is in its place.
    away: Option<(Box<dyn Device>, i64)>,
    dark: bool,
    device_ns: i64,
    host_baud: u32,
    /// Bytes on their way to the device: when, what, at which rate.
    outbound: VecDeque<(i64, u8, u32)>,
    free_ns: i64,
    to_host: Channel,
    from_host: Channel,
    usb: Usb,
    linked: bool,
    muted: bool,
    babble_ns: i64,
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
            device,
            away: None,
            dark: false,
            device_ns: 0,
            host_baud: 9600,
            outbound: VecDeque::new(),
            free_ns: 0,
            to_host: Channel::default(),
            from_host: Channel::default(),
            usb: Usb::new(UsbParams::default(), Rng::new(seed, 0x05B0 + stream, 0)),
            linked: true,
            muted: false,
            babble_ns: i64::MAX,
            seed,
            stream,
            rng: Rng::new(seed, 0x11E0 + stream, 0),
            scratch: Vec::new(),
        }
    }

    /// The same line behind another adapter.
    #[must_use]
    pub(crate) fn behind(mut self, usb: UsbParams) -> Self {
        self.usb = Usb::new(usb, Rng::new(self.seed, 0x05B0 + self.stream, 0));
        self
    }

    /// What the device counted.
    #[must_use]
    pub(crate) fn device_counts(&self) -> DeviceCounts {
        self.device.counts()
    }

    /// Whether the device sends measurements unasked.
    #[must_use]
    pub(crate) fn device_streams(&self) -> bool {
        !self.dark && self.device.is_streaming()
    }

    /// The host writes.
    pub(crate) fn write(&mut self, now_ns: i64, bytes: &[u8]) {
        if self.keeps_tapes {
            self.asked.push(now_ns, bytes);
        }
        let missed = self.rng.unit() < self.missed_share;
        if !self.linked || missed {
            return;
        }
        self.free_ns = self.free_ns.max(now_ns + WRITE_NS);
        for &byte in bytes {
            self.free_ns += transfer_ns(1, self.host_baud);
            self.outbound.push_back((self.free_ns, byte, self.host_baud));
        }
    }

    /// The host changes its rate; what it has not read is dropped.
    pub(crate) fn set_baud(&mut self, baud: u32) {
        self.host_baud = baud;
        self.usb.clear();
    }

    /// Something happens to the line.
    pub(crate) fn happen(&mut self, now_ns: i64, happening: Happening) {
        match happening {
            Happening::Unplug => {
                self.linked = false;
                self.usb.clear();
                self.outbound.clear();
                self.delivered.interrupt();
            }
            Happening::Part => self.linked = false,
            Happening::Plug | Happening::Join => self.linked = true,
            Happening::PowerOff => self.dark = true,
            Happening::PowerOn => {
                self.dark = false;
                self.device.power_on(now_ns);
                self.device_ns = now_ns;
            }
            Happening::Mute => self.muted = true,
            Happening::Unmute => self.muted = false,
            Happening::Babble => self.babble_ns = now_ns,
            Happening::Clear => self.babble_ns = i64::MAX,
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
                let own = std::mem::replace(&mut self.device, foreign_device);
                self.away.get_or_insert((own, self.device_ns));
                self.device_ns = now_ns;
            }
            Happening::Own => {
                if let Some(own) = self.away.take() {
                    (self.device, self.device_ns) = own;
                    self.catch_up(now_ns);
                }
            }
            Happening::OtherRate(baud) => {
                // Its own noise: the telegram under way began before, when the other one measured too.
                let stream = self.stream + 8 * (1 + now_ns.unsigned_abs() / 1_000_000_000);
                self.device = streaming_laser(baud, self.seed, stream);
                self.device_ns = now_ns;
            }
        }
    }

    fn set_channels(&mut self, now_ns: i64, [to_host, from_host]: [Channel; 2]) {
        // What a fault held back comes when the fault ends.
        let mut held = Vec::new();
        self.to_host.take(i64::MAX, &mut held);
        self.usb.push(now_ns, &held);
        (self.to_host, self.from_host) = (to_host, from_host);
    }

    /// What the device said while it was elsewhere, nobody heard.
    fn catch_up(&mut self, now_ns: i64) {
        while self.device_ns <= now_ns {
            self.scratch.clear();
            self.device_ns = self.device.poll(self.device_ns, &mut self.scratch).max(self.device_ns + 1);
        }
    }

    /// When something is due.
    #[must_use]
    pub(crate) fn next_ns(&self) -> i64 {
        let outbound_ns = self.outbound.front().map_or(i64::MAX, |(at_ns, ..)| *at_ns);
        let device_ns = if self.dark { i64::MAX } else { self.device_ns };
        let held = [self.to_host.next_due_ns(), self.from_host.next_due_ns()];
        let held_ns = held.into_iter().flatten().min().unwrap_or(i64::MAX);
        outbound_ns.min(device_ns).min(held_ns).min(self.usb.next_ns()).min(self.babble_ns)
    }

    /// Everything that is due by `now_ns`.
    pub(crate) fn run(&mut self, now_ns: i64) {
        while self.outbound.front().is_some_and(|(at_ns, ..)| *at_ns <= now_ns) {
            if let Some((at_ns, byte, baud)) = self.outbound.pop_front() {
                self.arrive_at_device(at_ns, byte, baud);
            }
        }
        self.hear(now_ns);
        self.poll_device(now_ns);
        if self.babble_ns <= now_ns {
            self.babble(now_ns);
        }
        self.scratch.clear();
        self.to_host.take(now_ns, &mut self.scratch);
        if self.linked {
            self.usb.push(now_ns, &self.scratch);
        }
    }

    /// The next read, if one returns by `now_ns`.
    pub(crate) fn read(&mut self, now_ns: i64, out: &mut Vec<u8>) -> bool {
        out.clear();
        let Some(bytes) = self.usb.take(now_ns) else { return false };
        out.extend_from_slice(&bytes);
        if self.keeps_tapes {
            self.delivered.push(now_ns, &bytes);
        }
        true
    }

    fn arrive_at_device(&mut self, at_ns: i64, byte: u8, baud: u32) {
        if self.dark {
            return;
        }
        if self.device_hears(baud) {
            self.from_host.push(at_ns, &[byte]);
        } else {
            self.device.handle_noise(at_ns, 1);
        }
    }

    /// A device of no rate hears all.
    fn device_hears(&self, baud: u32) -> bool {
        let own = self.device.baud();
        own == baud || own == 0
    }

    fn hear(&mut self, now_ns: i64) {
        self.scratch.clear();
        self.from_host.take(now_ns, &mut self.scratch);
        if !self.dark && !self.scratch.is_empty() {
            self.device.handle(now_ns, &self.scratch);
            self.device_ns = now_ns;
        }
    }

    fn poll_device(&mut self, now_ns: i64) {
        if self.dark || self.device_ns > now_ns {
            return;
        }
        let baud = self.device.baud();
        self.scratch.clear();
        self.device_ns = self.device.poll(now_ns, &mut self.scratch).max(now_ns + 1);
        if self.keeps_tapes && self.away.is_none() {
            self.sent.push(now_ns, &self.scratch);
        }
        if self.muted || self.babble_ns != i64::MAX || self.scratch.is_empty() {
            return;
        }
        if baud == self.host_baud || baud == 0 {
            self.to_host.push(now_ns, &self.scratch);
        } else {
            let noise = garble(&self.scratch, baud, self.host_baud, &mut self.rng);
            self.to_host.push(now_ns, &noise);
        }
    }

    fn babble(&mut self, now_ns: i64) {
        let count = BABBLE_NS / transfer_ns(1, self.host_baud).max(1);
        let noise: Vec<u8> = (0..count).map(|_| self.rng.bits().to_le_bytes()[0]).collect();
        self.to_host.push(now_ns, &noise);
        self.babble_ns = now_ns + BABBLE_NS;
    }
}
