//! A base's side of a capture: its odometry packets as they were, and its name. Nanoseconds on the capture's clock.

use super::byte_times::ByteTimes;
use biplane_wire::deframe::Item;
use biplane_wire::p2os::{Deframer, Packet, Report};

/// One packet of a base.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedPacket {
    /// When its first byte left the base.
    pub time_ns: i64,
    /// Body, without header and checksum.
    pub body: Vec<u8>,
}

/// A base's side of a capture.
#[derive(Clone, Debug, Default)]
pub struct BaseTrack {
    /// Odometry packets in order.
    pub packets: Vec<RecordedPacket>,
    /// Name, class and subclass that it reported.
    pub identity: Option<[String; 3]>,
    /// Bytes that are in no packet.
    pub skipped_bytes: u64,
}

/// Bytes of a base on their way to a track.
pub struct BaseReading {
    /// Bytes taken so far and their times.
    pub bytes: ByteTimes,
    deframer: Deframer,
    track: BaseTrack,
}

impl BaseReading {
    /// Nothing read yet, on a line of this rate.
    #[must_use]
    pub fn new(baud: u32) -> Self {
        let (deframer, track) = (Deframer::new(), BaseTrack::default());
        Self { bytes: ByteTimes::new(baud), deframer, track }
    }

    /// Takes the bytes of a read.
    pub fn take(&mut self, time_ns: i64, bytes: &[u8]) {
        self.bytes.read(time_ns, bytes.len());
        let (times, track) = (&self.bytes, &mut self.track);
        self.deframer.feed(bytes, |item| {
            if let Item::Frame { offset, bytes } = item {
                track.keep(times.left_ns(offset), bytes);
            }
        });
    }

    /// The track, if there was any byte.
    #[must_use]
    pub fn finish(mut self) -> Option<BaseTrack> {
        self.deframer.finish();
        while self.deframer.next().is_some() {}
        self.track.skipped_bytes = self.deframer.counts().skipped_bytes;
        (self.bytes.position > 0).then_some(self.track)
    }
}

impl BaseTrack {
    fn keep(&mut self, time_ns: i64, frame: &[u8]) {
        let Ok(packet) = Packet::parse(frame) else { return };
        match packet.report() {
            Ok(Report::Sip(_)) => {
                let body = frame.get(3..frame.len().saturating_sub(2)).unwrap_or_default().to_vec();
                self.packets.push(RecordedPacket { time_ns, body });
            }
            Ok(Report::Identity(identity)) => {
                let texts = [identity.name, identity.class, identity.subclass];
                self.identity = Some(texts.map(|text| String::from_utf8_lossy(text.0).into_owned()));
            }
            _ => {}
        }
    }
}
