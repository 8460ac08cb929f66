//! A serial capture as the source of a mock rig: every scan and odometry packet in it, with the time at which it left its device.
//!
//! Capture format: `/serial/<port>/rx` of the contract, section 3. It may begin anywhere and hold faults: what does not deframe is
//! passed over and counted. Times are nanoseconds on the capture's clock.

pub mod base_feed;
pub mod laser_feed;
pub mod slots;

use crate::lms_device::settings::{CONFIG_BYTES, ConfigBlock, Variant};
use crate::pacing::transfer_ns;
use crate::source::ScanWords;
use biplane_recording::{Direction, Port, ReadError, Reader, Rig};
use biplane_wire::deframe::{Deframer, Framing, Item};
use biplane_wire::lms::{self, Reply, Selection, Telegram, Unit};
use biplane_wire::p2os;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

/// Why a capture cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It has no serial bytes.
    #[error("{}: no bytes of any device (/serial/.../rx); a recording has them when it was made with --raw", path.display())]
    NoSerialBytes {
        /// The file.
        path: PathBuf,
    },
    /// Serial bytes, but nothing in them that a device could send.
    #[error("{}: {bytes} serial bytes, but no whole scan and no odometry packet in them", path.display())]
    NothingWhole {
        /// The file.
        path: PathBuf,
        /// Bytes looked through.
        bytes: u64,
    },
}

/// One scan of a capture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedScan {
    /// When its first byte left the laser.
    pub time_ns: i64,
    /// Value words as they were, flags included.
    pub words: ScanWords,
    /// Unit of the values.
    pub mm: bool,
    /// Status byte of the telegram.
    pub status: u8,
}

/// A laser's side of a capture.
#[derive(Clone, Debug, Default)]
pub struct LaserTrack {
    /// Whole scans of the most frequent number of values, in order.
    pub scans: Vec<RecordedScan>,
    /// Configuration that the laser reported.
    pub config: Option<ConfigBlock>,
    /// Type text that it reported.
    pub type_text: Option<String>,
    /// Bytes that are in no telegram.
    pub skipped_bytes: u64,
    /// Means, parts, single turns and scans of another number of values: not played.
    pub other_scans: u64,
}

impl LaserTrack {
    /// Field of view and step of its scans.
    #[must_use]
    pub fn variant(&self) -> Option<Variant> {
        let count = self.scans.first()?.words.len();
        Some(Variant::of_count(count).unwrap_or(Variant::of(180, 100)))
    }

    /// The configuration to begin with: as reported, in the unit of the scans.
    #[must_use]
    pub fn initial_config(&self) -> ConfigBlock {
        let config = self.config.unwrap_or_default();
        let mm = self.scans.first().map_or(config.is_mm(), |scan| scan.mm);
        config.with_units(mm, config.measuring_mode())
    }
}

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

/// All that a capture holds of the devices' bytes.
#[derive(Clone, Debug, Default)]
pub struct Capture {
    /// The localising laser.
    pub horizontal: Option<LaserTrack>,
    /// The building-facing laser.
    pub vertical: Option<LaserTrack>,
    /// The base.
    pub base: Option<BaseTrack>,
    /// The rig that was recorded.
    pub rig: Option<Rig>,
}

impl Capture {
    /// Reads a capture, or a recording made with `--raw`.
    pub fn read(path: &Path) -> Result<Self, CaptureError> {
        let reader = Reader::open(path)?;
        let rig = reader.rig()?;
        let baud = |port| rig_baud(rig.as_ref(), port);
        let mut horizontal = LaserReading::new(baud(Port::Horizontal));
        let mut vertical = LaserReading::new(baud(Port::Vertical));
        let mut base = BaseReading::new(baud(Port::Base));
        for message in reader.serial() {
            let message = message?;
            if message.direction == Direction::Tx {
                continue;
            }
            match message.port {
                Port::Horizontal => horizontal.take(message.time_ns, &message.bytes),
                Port::Vertical => vertical.take(message.time_ns, &message.bytes),
                Port::Base => base.take(message.time_ns, &message.bytes),
            }
        }
        let bytes = horizontal.bytes.position + vertical.bytes.position + base.bytes.position;
        let capture =
            Self { horizontal: horizontal.finish(), vertical: vertical.finish(), base: base.finish(), rig };
        match (bytes, capture.first_ns()) {
            (0, _) => Err(CaptureError::NoSerialBytes { path: path.to_owned() }),
            (_, None) => Err(CaptureError::NothingWhole { path: path.to_owned(), bytes }),
            _ => Ok(capture),
        }
    }

    fn times_ns(&self) -> impl Iterator<Item = i64> + '_ {
        let lasers = [&self.horizontal, &self.vertical].into_iter().flatten();
        let scans = lasers.flat_map(|track| track.scans.iter().map(|scan| scan.time_ns));
        let packets = self.base.iter().flat_map(|track| track.packets.iter().map(|packet| packet.time_ns));
        scans.chain(packets)
    }

    /// When the first scan or packet left.
    #[must_use]
    pub fn first_ns(&self) -> Option<i64> {
        self.times_ns().min()
    }

    /// From the first to the last scan or packet.
    #[must_use]
    pub fn duration_ns(&self) -> i64 {
        self.times_ns().max().unwrap_or(0) - self.first_ns().unwrap_or(0)
    }
}

fn rig_baud(rig: Option<&Rig>, port: Port) -> u32 {
    match (rig, port) {
        (Some(rig), Port::Horizontal) => rig.horizontal.baud,
        (Some(rig), Port::Vertical) => rig.vertical.as_ref().map_or(38_400, |laser| laser.baud),
        (Some(rig), Port::Base) => rig.base.baud,
        (None, Port::Base) => 9600,
        (None, _) => 38_400,
    }
}

/// Reads of one line, to tell when a byte left.
struct ByteTimes {
    baud: u32,
    position: u64,
    /// First byte's position, number of bytes, time of the read.
    reads: VecDeque<(u64, usize, i64)>,
}

/// No telegram spans more reads than this, unless they are of one byte each.
const READS_KEPT: usize = 1024;

impl ByteTimes {
    fn new(baud: u32) -> Self {
        Self { baud, position: 0, reads: VecDeque::new() }
    }

    fn read(&mut self, time_ns: i64, count: usize) {
        if self.reads.len() == READS_KEPT {
            self.reads.pop_front();
        }
        self.reads.push_back((self.position, count, time_ns));
        self.position += count as u64;
    }

    /// When the byte at `offset` left: its read returned once the bytes behind it had come, too; but never before the read before.
    fn left_ns(&self, offset: u64) -> i64 {
        let next = self.reads.partition_point(|read| read.0 <= offset);
        let Some(&(start, count, time_ns)) = self.reads.get(next.saturating_sub(1)) else { return 0 };
        let behind = count - usize::try_from(offset - start.min(offset)).unwrap_or(0).min(count);
        let left_ns = time_ns - transfer_ns(behind, self.baud);
        let before = next.checked_sub(2).and_then(|index| self.reads.get(index));
        before.map_or(left_ns, |before| left_ns.max(before.2 - transfer_ns(1, self.baud)))
    }
}

fn drain<F: Framing, const N: usize>(
    deframer: &mut Deframer<F, N>,
    mut bytes: &[u8],
    mut each: impl FnMut(u64, &[u8]),
) {
    loop {
        let taken = deframer.push(bytes);
        bytes = &bytes[taken..];
        while let Some(item) = deframer.next() {
            if let Item::Frame { offset, bytes } = item {
                each(offset, bytes);
            }
        }
        if bytes.is_empty() {
            break;
        }
    }
}

struct LaserReading {
    bytes: ByteTimes,
    deframer: lms::DeviceDeframer,
    track: LaserTrack,
}

impl LaserReading {
    fn new(baud: u32) -> Self {
        let (deframer, track) = (lms::DeviceDeframer::new(), LaserTrack::default());
        Self { bytes: ByteTimes::new(baud), deframer, track }
    }

    fn take(&mut self, time_ns: i64, bytes: &[u8]) {
        self.bytes.read(time_ns, bytes.len());
        let (times, track) = (&self.bytes, &mut self.track);
        drain(&mut self.deframer, bytes, |offset, frame| track.keep(times.left_ns(offset), frame));
    }

    fn finish(mut self) -> Option<LaserTrack> {
        self.deframer.finish();
        while self.deframer.next().is_some() {}
        self.track.skipped_bytes = self.deframer.counts().skipped_bytes;
        self.track.keep_one_count();
        (self.bytes.position > 0).then_some(self.track)
    }
}

impl LaserTrack {
    fn keep(&mut self, time_ns: i64, frame: &[u8]) {
        let Ok(telegram) = Telegram::parse(frame) else { return };
        match telegram.reply() {
            Ok(Reply::Scan(scan)) => {
                if scan.selection() != Selection::All
                    || scan.partial_offset_quarters().is_some()
                    || scan.unit() == Unit::TenCm
                {
                    self.other_scans += 1;
                    return;
                }
                let status = telegram.status().map_or(lms::Status::OK.0, |status| status.0);
                let (words, mm) = (scan.values().collect(), scan.unit() == Unit::Mm);
                self.scans.push(RecordedScan { time_ns, words, mm, status });
            }
            Ok(Reply::Config(config) | Reply::ConfigWritten { config, .. }) if self.scans.is_empty() => {
                let mut block = ConfigBlock::default();
                let known = config.as_bytes().iter().take(CONFIG_BYTES);
                block.0.iter_mut().zip(known).for_each(|(mine, theirs)| *mine = *theirs);
                self.config = Some(block);
            }
            Ok(Reply::Type { text }) => {
                self.type_text = Some(String::from_utf8_lossy(text.0).into_owned());
            }
            _ => {}
        }
    }

    /// A device has one variant at a time: the most frequent one stays.
    fn keep_one_count(&mut self) {
        let mut counts: Vec<(usize, usize)> = Vec::new();
        for scan in &self.scans {
            match counts.iter_mut().find(|(count, _)| *count == scan.words.len()) {
                Some((_, times)) => *times += 1,
                None => counts.push((scan.words.len(), 1)),
            }
        }
        let Some(&(kept, _)) = counts.iter().max_by_key(|(_, times)| *times) else { return };
        let before = self.scans.len();
        self.scans.retain(|scan| scan.words.len() == kept);
        self.other_scans += (before - self.scans.len()) as u64;
    }
}

struct BaseReading {
    bytes: ByteTimes,
    deframer: p2os::Deframer,
    track: BaseTrack,
}

impl BaseReading {
    fn new(baud: u32) -> Self {
        let (deframer, track) = (p2os::Deframer::new(), BaseTrack::default());
        Self { bytes: ByteTimes::new(baud), deframer, track }
    }

    fn take(&mut self, time_ns: i64, bytes: &[u8]) {
        self.bytes.read(time_ns, bytes.len());
        let (times, track) = (&self.bytes, &mut self.track);
        drain(&mut self.deframer, bytes, |offset, frame| track.keep(times.left_ns(offset), frame));
    }

    fn finish(mut self) -> Option<BaseTrack> {
        self.deframer.finish();
        while self.deframer.next().is_some() {}
        self.track.skipped_bytes = self.deframer.counts().skipped_bytes;
        (self.bytes.position > 0).then_some(self.track)
    }
}

impl BaseTrack {
    fn keep(&mut self, time_ns: i64, frame: &[u8]) {
        let Ok(packet) = p2os::Packet::parse(frame) else { return };
        match packet.report() {
            Ok(p2os::Report::Sip(_)) => {
                let body = frame.get(3..frame.len().saturating_sub(2)).unwrap_or_default().to_vec();
                self.packets.push(RecordedPacket { time_ns, body });
            }
            Ok(p2os::Report::Identity(identity)) => {
                let texts = [identity.name, identity.class, identity.subclass];
                self.identity = Some(texts.map(|text| String::from_utf8_lossy(text.0).into_owned()));
            }
            _ => {}
        }
    }
}
