//! A base's side of a capture: its odometry packets as they were, or its counts, and its name. Nanoseconds on
//! the capture's clock.

use super::byte_times::ByteTimes;
use crate::devices::base::counters::Counts;
use biplane_recording::rig::BaseProtocol;
use biplane_wire::framing::Item;
use biplane_wire::p2os::{Packet, Report};
use biplane_wire::roboclaw::{Answer, Collector, Question, Request};
use biplane_wire::{p2os, rflex};

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
    /// Odometry packets of a P2OS base in order.
    pub packets: Vec<RecordedPacket>,
    /// Counters of another base in order: when they were taken, and both.
    pub counts: Vec<(i64, Counts)>,
    /// Name, class and subclass that a P2OS base reported.
    pub identity: Option<[String; 3]>,
    /// Bytes that are in no packet.
    pub skipped_bytes: u64,
}

/// Finds what a base says in its bytes.
enum Reading {
    P2os(p2os::Deframer),
    RoboClaw { address: u8, collector: Collector },
    Rflex { deframer: rflex::Deframer, way: Option<(i64, i32)> },
}

/// Bytes of a base on their way to a track.
pub struct BaseReading {
    /// Bytes taken so far and their times.
    pub bytes: ByteTimes,
    reading: Reading,
    track: BaseTrack,
}

impl BaseReading {
    /// Nothing read yet, on a line of this rate, of a base that speaks this.
    #[must_use]
    pub fn new(baud: u32, protocol: &BaseProtocol) -> Self {
        let reading = match *protocol {
            BaseProtocol::None | BaseProtocol::P2os { .. } => Reading::P2os(p2os::Deframer::new()),
            BaseProtocol::RoboClaw { address, .. } => {
                Reading::RoboClaw { address, collector: Collector::new() }
            }
            BaseProtocol::Rflex { .. } => Reading::Rflex { deframer: rflex::Deframer::new(), way: None },
        };
        Self { bytes: ByteTimes::new(baud), reading, track: BaseTrack::default() }
    }

    /// What the host sent: what a RoboClaw says next answers it.
    pub fn asked(&mut self, bytes: &[u8]) {
        let Reading::RoboClaw { address, collector } = &mut self.reading else { return };
        match Request::parse(bytes) {
            Ok(request)
                if request.address == *address && !matches!(request.question, Question::Status(_)) =>
            {
                collector.ask(request);
            }
            _ => collector.abandon(),
        }
    }

    /// Takes the bytes of a read.
    pub fn take(&mut self, time_ns: i64, bytes: &[u8]) {
        self.bytes.read(time_ns, bytes.len());
        let (times, track) = (&self.bytes, &mut self.track);
        match &mut self.reading {
            Reading::P2os(deframer) => deframer.feed(bytes, |item| {
                if let Item::Frame { offset, bytes } = item {
                    track.keep(times.left_ns(offset), bytes);
                }
            }),
            Reading::Rflex { deframer, way } => deframer.feed(bytes, |item| {
                if let Item::Frame { offset, bytes } = item {
                    track.keep_axis(times.left_ns(offset), bytes, way);
                }
            }),
            Reading::RoboClaw { collector, .. } => {
                if let Some(Ok(received)) = collector.take(bytes)
                    && let Answer::Encoders { m1_counts, m2_counts } = received.answer
                {
                    track.counts.push((times.left_ns(received.offset), [m1_counts, m2_counts]));
                }
            }
        }
    }

    /// The track, if there was any byte.
    #[must_use]
    pub fn finish(mut self) -> Option<BaseTrack> {
        self.track.skipped_bytes = match &mut self.reading {
            Reading::P2os(deframer) => {
                deframer.finish();
                while deframer.next().is_some() {}
                deframer.counts().skipped_bytes
            }
            Reading::Rflex { deframer, .. } => {
                deframer.finish();
                while deframer.next().is_some() {}
                deframer.counts().skipped_bytes
            }
            Reading::RoboClaw { collector, .. } => {
                collector.abandon();
                collector.counts().skipped_bytes
            }
        };
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

    /// Way and bearing come in packets of their own, the way first.
    fn keep_axis(&mut self, time_ns: i64, frame: &[u8], way: &mut Option<(i64, i32)>) {
        let report = rflex::Packet::parse(frame).and_then(|packet| packet.report());
        let Ok(rflex::Report::Motion(motion)) = report else { return };
        match motion.axis {
            rflex::TRANSLATION => *way = Some((time_ns, motion.position)),
            rflex::ROTATION => {
                let first = way.take();
                self.counts.extend(first.map(|(way_ns, way)| (way_ns, [way, motion.position])));
            }
            _ => {}
        }
    }

    /// When each of its odometry reports left.
    pub fn times_ns(&self) -> impl Iterator<Item = i64> + '_ {
        let counts = self.counts.iter().map(|(time_ns, _)| *time_ns);
        self.packets.iter().map(|packet| packet.time_ns).chain(counts)
    }
}
