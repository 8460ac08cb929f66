//! Who else speaks on a port: a device that belongs elsewhere is named, so that nobody looks for a broken
//! cable.
//!
//! While a line brings nothing of its own device, its bytes are held against what other devices say: intact
//! telegrams of a laser, packets of a Pioneer or of an rFLEX base, measurements of an inertial unit,
//! sentences of a satellite receiver, lines of text, and our own requests coming back. Chance brings none of
//! these twice. A device that only answers (a RoboClaw), or that speaks at a rate at which this port does not
//! listen, is not told.

use biplane_recording::Port;
use biplane_recording::rig::BaseProtocol;
use biplane_wire::framing::{Deframer, Framing};
use biplane_wire::{Item, lms, p2os, rflex, xsens};

use crate::session::device_session::RequestBytes;
use crate::types::foreign_protocol::ForeignProtocol;

/// So many telegrams, sentences or echoes are no chance.
const ENOUGH: u8 = 2;
/// A line that has brought something of its own so short a time ago needs no second ear, nanoseconds.
const OWN_NS: i64 = 300_000_000;
/// Shorter lines of text are not counted.
const SHORTEST_LINE: u8 = 4;

/// Frames of one protocol.
#[derive(Debug)]
struct Frames<F, const N: usize> {
    deframer: Deframer<F, N>,
    /// Whether a frame counts.
    counts: fn(&[u8]) -> bool,
    count: u8,
}

impl<F: Framing, const N: usize> Frames<F, N> {
    /// Every frame counts: chance makes none in a day.
    fn all() -> Self {
        Self::those(|_| true)
    }

    fn those(counts: fn(&[u8]) -> bool) -> Self {
        Self { deframer: Deframer::new(), counts, count: 0 }
    }

    fn hear(&mut self, bytes: &[u8]) -> bool {
        let Self { deframer, counts, count } = self;
        deframer.feed(bytes, |item| {
            *count =
                count.saturating_add(u8::from(matches!(item, Item::Frame { bytes, .. } if counts(bytes))));
        });
        *count >= ENOUGH
    }

    fn forget(&mut self) {
        self.deframer.abandon();
        self.deframer.feed(&[], |_| {});
        self.count = 0;
    }
}

/// Lines of text.
#[derive(Copy, Clone, Debug, Default)]
struct Lines {
    length: u8,
    /// Exclusive or of what stands between `$` and `*`, and the sum behind it.
    sum: u8,
    stated_sum: Option<u8>,
    is_sentence: bool,
    texts: u8,
    sentences: u8,
}

impl Lines {
    fn hear(&mut self, bytes: &[u8]) -> Option<ForeignProtocol> {
        for &byte in bytes {
            match byte {
                b'\r' | b'\n' => self.end(),
                b' '..=b'~' => self.letter(byte),
                _ => *self = Self::default(),
            }
        }
        if self.sentences >= ENOUGH {
            Some(ForeignProtocol::Receiver)
        } else {
            (self.texts >= ENOUGH && self.sentences == 0).then_some(ForeignProtocol::Text)
        }
    }

    fn letter(&mut self, byte: u8) {
        if self.length == 0 {
            (self.is_sentence, self.sum, self.stated_sum) = (matches!(byte, b'$' | b'!'), 0, None);
        } else if byte == b'*' {
            self.stated_sum = Some(0);
        } else if let Some(reported) = &mut self.stated_sum {
            let digit = char::from(byte).to_digit(16).map_or(0, |digit| digit as u8);
            *reported = (*reported << 4) | digit;
        } else {
            self.sum ^= byte;
        }
        self.length = self.length.saturating_add(1);
    }

    fn end(&mut self) {
        if self.length >= SHORTEST_LINE {
            self.texts = self.texts.saturating_add(1);
            let fits = self.is_sentence && self.stated_sum == Some(self.sum);
            self.sentences = self.sentences.saturating_add(u8::from(fits));
        }
        self.length = 0;
    }
}

/// What was sent, as far as it has come back.
#[derive(Clone, Debug, Default)]
struct Echoes {
    sent: RequestBytes,
    back: usize,
    count: u8,
}

impl Echoes {
    /// Zeros are sent to end what a base waits for, and come back as no echo.
    fn sent(&mut self, bytes: &[u8]) {
        if bytes.iter().all(|byte| *byte == 0) {
            return;
        }
        if self.back >= self.sent.len() {
            self.sent.clear();
            self.back = 0;
        }
        if self.sent.extend_from_slice(bytes).is_err() {
            self.sent.clear();
        }
    }

    /// A base that is synchronized sends our packets back, once: one of several in a row that it does not is
    /// enough.
    fn hear(&mut self, bytes: &[u8]) -> bool {
        for &byte in bytes {
            if self.back == 0 && byte == 0 {
                continue;
            }
            if self.sent.get(self.back) != Some(&byte) {
                *self = Self::default();
                continue;
            }
            self.back += 1;
            if self.back == self.sent.len() {
                self.count = self.count.saturating_add(1);
            }
        }
        self.count > ENOUGH
    }
}

/// The ear of one port.
#[derive(Debug)]
pub(crate) struct ForeignDevice {
    laser: Frames<lms::DeviceFraming, 2048>,
    pioneer: Frames<p2os::P2osFraming, 1024>,
    rflex: Frames<rflex::RflexFraming, 1024>,
    xsens: Frames<xsens::XsensFraming, 4096>,
    lines: Lines,
    echoes: Echoes,
    own: Option<ForeignProtocol>,
    own_frames: u64,
    own_ns: i64,
    has_received: bool,
    reported: bool,
}

impl ForeignDevice {
    /// The ear of a port whose own device is this.
    #[must_use]
    pub(crate) fn on(port: Port, protocol: &BaseProtocol) -> Self {
        let own = match (port, protocol) {
            (Port::Horizontal | Port::Vertical, _) => Some(ForeignProtocol::Laser),
            (Port::Base, BaseProtocol::P2os { .. }) => Some(ForeignProtocol::Pioneer),
            (Port::Base, BaseProtocol::Rflex { .. }) => Some(ForeignProtocol::Rflex),
            (Port::Base, BaseProtocol::RoboClaw { .. } | BaseProtocol::None) => None,
            (Port::Imu, _) => Some(ForeignProtocol::Inertial),
        };
        Self {
            laser: Frames::all(),
            pioneer: Frames::all(),
            rflex: Frames::all(),
            xsens: Frames::those(is_measurement),
            lines: Lines::default(),
            echoes: Echoes::default(),
            own,
            own_frames: 0,
            own_ns: i64::MIN,
            has_received: false,
            reported: false,
        }
    }

    /// Something was sent.
    pub(crate) fn sent(&mut self, bytes: &[u8]) {
        self.echoes.sent(bytes);
    }

    /// A measurement of the port's own device: whoever comes next is said again.
    pub(crate) fn measured(&mut self) {
        self.reported = false;
    }

    /// Bytes came, after which the session has so many intact telegrams of its device. Who speaks, said once.
    pub(crate) fn hear(&mut self, now_ns: i64, own_frames: u64, bytes: &[u8]) -> Option<ForeignProtocol> {
        let is_own = std::mem::replace(&mut self.own_frames, own_frames) != own_frames;
        let is_echo = self.echoes.hear(bytes);
        if is_own {
            self.own_ns = now_ns;
            self.forget();
        }
        if self.reported || (!is_echo && now_ns.saturating_sub(self.own_ns) < OWN_NS) {
            return None;
        }
        self.has_received = true;
        let text = self.lines.hear(bytes);
        let received = [
            (ForeignProtocol::Echo, is_echo),
            (ForeignProtocol::Laser, self.laser.hear(bytes)),
            (ForeignProtocol::Pioneer, self.pioneer.hear(bytes)),
            (ForeignProtocol::Rflex, self.rflex.hear(bytes)),
            (ForeignProtocol::Inertial, self.xsens.hear(bytes)),
        ];
        let found = received
            .into_iter()
            .find(|(foreign_protocol, is_received)| *is_received && Some(*foreign_protocol) != self.own);
        let foreign_protocol = found.map(|(foreign_protocol, _)| foreign_protocol).or(text)?;
        self.reported = true;
        Some(foreign_protocol)
    }

    fn forget(&mut self) {
        if std::mem::take(&mut self.has_received) {
            self.laser.forget();
            self.pioneer.forget();
            self.rflex.forget();
            self.xsens.forget();
            self.lines = Lines::default();
        }
    }
}

/// A sum of eight bits fits often by chance; items that fit each other do not.
fn is_measurement(frame: &[u8]) -> bool {
    let report = xsens::Message::parse(frame).and_then(|message| message.report());
    matches!(report, Ok(xsens::Report::Data(items)) if items.iter().next().is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    const P2OS: BaseProtocol = BaseProtocol::P2os { metres_per_tick: None };

    /// What is said of these bytes, in pieces of seven, on a port whose own device is silent.
    fn named(port: Port, protocol: &BaseProtocol, bytes: &[u8]) -> Vec<ForeignProtocol> {
        let mut foreign_device = ForeignDevice::on(port, protocol);
        bytes.chunks(7).filter_map(|piece| foreign_device.hear(0, 0, piece)).collect()
    }

    #[test]
    fn each_of_them_is_named_once_by_what_it_says() {
        // A type reply of a laser, a SYNC0 of a Pioneer, and what is printed in NMEA 0183 with its sum (all
        // sums by hand).
        let type_reply = [0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A];
        let sync = [0xFA, 0xFB, 0x03, 0x00, 0x00, 0x00];
        let sentence = b"$GPGSA,A,3,10,07,05,02,29,04,08,13,,,,,1.72,1.03,1.38*0A\r\n";
        // Of a log in a driver for an Xsens unit.
        let turning = [
            0xFA, 0xFF, 0x36, 0x0F, 0x80, 0x40, 0x0C, 0x3B, 0x8B, 0xBC, 0x00, 0xBB, 0xE2, 0x4F, 0x00, 0x3B,
            0x4E, 0x4A, 0x00, 0xAF,
        ];
        for (port, bytes, foreign_protocol) in [
            (Port::Base, &type_reply[..], ForeignProtocol::Laser),
            (Port::Vertical, &sync[..], ForeignProtocol::Pioneer),
            (Port::Horizontal, &sentence[..], ForeignProtocol::Receiver),
            (Port::Base, b"\r\nNO CARRIER\r\n", ForeignProtocol::Text),
            (Port::Base, &turning[..], ForeignProtocol::Inertial),
            (Port::Imu, &sync[..], ForeignProtocol::Pioneer),
        ] {
            assert_eq!(named(port, &P2OS, &bytes.repeat(5)), [foreign_protocol], "{port:?}");
            assert_eq!(named(port, &P2OS, bytes), [], "once may be chance");
        }
        assert_eq!(named(Port::Base, &P2OS, &sync.repeat(9)), [], "its own device");
        assert_eq!(named(Port::Vertical, &P2OS, &type_reply.repeat(9)), [], "its own device");
        assert_eq!(named(Port::Imu, &P2OS, &turning.repeat(9)), [], "its own device");
    }

    #[test]
    fn three_requests_that_come_back_in_a_row_are_an_echo_and_an_answered_one_is_none() {
        let mut foreign_device = ForeignDevice::on(Port::Horizontal, &P2OS);
        let request = [0x02, 0x00, 0x01, 0x00, 0x31, 0x15, 0x12];
        let mut reported = Vec::new();
        for answered in [false, false, true, false, false, false, false] {
            foreign_device.sent(&request);
            reported.extend(foreign_device.hear(0, 0, &request[..3]));
            reported.extend(foreign_device.hear(0, 0, if answered { &[6, 2, 0x80] } else { &request[3..] }));
        }
        assert_eq!(reported, [ForeignProtocol::Echo]);
        foreign_device.measured();
        assert!(!foreign_device.reported);
    }

    #[test]
    fn three_million_random_bytes_are_nobody() {
        let mut noise = crate::session::testing::noise::Noise::new(7);
        let mut foreign_device = ForeignDevice::on(Port::Base, &P2OS);
        for _ in 0..3_000_000 / 50 {
            let bytes: [u8; 50] = std::array::from_fn(|_| noise.byte());
            assert_eq!(foreign_device.hear(0, 0, &bytes), None);
        }
    }
}
