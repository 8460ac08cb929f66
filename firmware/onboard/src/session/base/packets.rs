//! The session of a base that sends packets with a frame of their own: from the bytes to the packets, and
//! what all such sessions do alike.
//!
//! What a packet means and what is sent when is a [`PacketMachine`]'s business, one a protocol.

use biplane_wire::framing::{Deframer, Framing};
use biplane_wire::{Counts, Item, WireError};

use crate::session::base::contact::Contact;
use crate::session::base::driver::{BaseDriver, Purpose};
use crate::session::base::reading::BaseInfo;
use crate::session::device_session::{Input, Output, Session};
use crate::session::event::Event;
use crate::session::queues::Intake;

/// Bytes that a deframer holds: some of the longest packets.
const HELD_BYTES: usize = 4096;

/// The states of one protocol's session. It stands beside the deframer, so that a packet can be lent to it.
pub trait PacketMachine {
    /// How its packets are found in a stream.
    type Framing: Framing;
    /// The first byte of every packet.
    const HEADER: u8;

    /// What it knows of its line.
    fn contact(&self) -> &Contact;

    /// What it knows of its line, to be told more.
    fn contact_mut(&mut self) -> &mut Contact;

    /// Says and asks the first things.
    fn begin(&mut self);

    /// An intact packet, with the index in the stream of its first byte. An error when it cannot be read.
    fn packet(&mut self, offset: u64, bytes: &[u8]) -> Result<(), WireError>;

    /// Whether the last packet is none that the device has sent, for a reason that its checksum does not
    /// show: its bytes are searched for others. Whoever says so counts it.
    fn takes_back(&self) -> bool {
        false
    }

    /// Does what is due now.
    fn time(&mut self);

    /// The port is there again.
    fn port_back(&mut self) {}

    /// The base shall be left idle.
    fn stop(&mut self);

    /// When something is due.
    fn deadline_ns(&self) -> i64;

    /// Whether odometry flows.
    fn is_streaming(&self) -> bool;

    /// Whether nothing is left to do.
    fn is_done(&self) -> bool;

    /// See [`BaseDriver::overslept`].
    fn watchdog_missed(&mut self) {}
}

/// A session with a base that sends packets.
#[derive(Debug)]
pub struct PacketSession<M: PacketMachine> {
    intake: Intake,
    deframer: Deframer<M::Framing, HELD_BYTES>,
    machine: M,
    not_kept: u64,
}

impl<M: PacketMachine> PacketSession<M> {
    /// What it knows of its device.
    pub(crate) fn machine(&self) -> &M {
        &self.machine
    }

    pub(crate) fn new(mut machine: M, purpose: Purpose) -> Self {
        if purpose != Purpose::Listen {
            machine.contact_mut().set_rate();
            machine.begin();
        }
        Self { intake: Intake::default(), deframer: Deframer::new(), machine, not_kept: 0 }
    }

    /// Reads on in what has come, while there is room for what it leads to.
    fn drain(&mut self) {
        while self.machine.contact().outputs.has_room() {
            if let Some(item) = self.deframer.next() {
                if let Item::Frame { offset, bytes } = item {
                    self.not_kept += u64::from(self.machine.packet(offset, bytes).is_err());
                    if self.machine.takes_back() {
                        self.deframer.reject();
                    }
                }
            } else if !self.intake.hand_on(&mut self.deframer) {
                break;
            }
        }
    }

    /// The packet that is under way has no rest.
    fn abandon(&mut self) {
        self.deframer.abandon();
        self.drain();
    }

    /// Whether the line paused before these bytes for longer than a packet may, and they begin with another
    /// one: then the one before was cut, or is what another device left on the line, and an answer must not
    /// wait for its rest. While reports flow none is given up so: an adapter may hold its bytes back.
    fn is_cut_before(&self, bytes: &[u8]) -> bool {
        let begins = bytes.first() == Some(&M::HEADER);
        !self.machine.is_streaming() && begins && self.machine.contact().has_paused()
    }

    fn take_bytes(&mut self, bytes: &[u8]) {
        if self.is_cut_before(bytes) {
            self.abandon();
        }
        let contact = self.machine.contact_mut();
        contact.last_byte_ns = contact.now_ns;
        self.intake.take(bytes);
        self.drain();
    }

    fn port_back(&mut self) {
        self.abandon();
        self.machine.contact_mut().port_back();
        self.machine.port_back();
    }
}

impl<M: PacketMachine> BaseDriver for PacketSession<M> {
    fn info(&self) -> &BaseInfo {
        &self.machine.contact().info
    }

    fn metres_per_tick(&self) -> Option<f64> {
        self.machine.contact().metres_per_tick
    }

    fn not_kept(&self) -> u64 {
        self.not_kept
    }

    fn is_streaming(&self) -> bool {
        self.machine.is_streaming()
    }

    fn watchdog_missed(&mut self) {
        self.machine.watchdog_missed();
    }

    fn finish(&mut self) {
        self.deframer.finish();
        self.drain();
    }
}

impl<M: PacketMachine> Session for PacketSession<M> {
    fn handle(&mut self, now_ns: i64, input: Input<'_>) {
        self.machine.contact_mut().now_ns = now_ns;
        match input {
            Input::Bytes(bytes) => self.take_bytes(bytes),
            Input::Time => {}
            Input::RateRefused(baud) => self.machine.contact_mut().say(Event::RateRefused { baud }),
            Input::PortBack => self.port_back(),
            Input::Stop => self.machine.stop(),
        }
        self.machine.time();
    }

    fn poll(&mut self) -> Output {
        if self.machine.contact().outputs.is_empty() {
            self.drain();
        }
        let output = self.machine.contact_mut().outputs.pop();
        output.unwrap_or_else(|| Output::WaitUntil(self.machine.deadline_ns()))
    }

    fn is_done(&self) -> bool {
        self.machine.is_done() && self.machine.contact().outputs.is_empty()
    }

    fn baud(&self) -> u32 {
        self.machine.contact().baud
    }

    fn counts(&self) -> Counts {
        self.deframer.counts()
    }

    fn overflowed(&self) -> u64 {
        self.machine.contact().outputs.overflowed()
    }
}
