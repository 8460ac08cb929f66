//! A laser's side of a capture: its whole scans, and what it said about itself. Words as on the wire,
//! nanoseconds on the capture's clock.

use super::byte_times::ByteTimes;
use crate::devices::lms::model::Model;
use crate::devices::lms::settings::{CONFIG_BYTES, ConfigBlock, Variant};
use crate::rig::source::ScanWords;
use biplane_wire::framing::Item;
use biplane_wire::lms::{DeviceDeframer, Reply, Selection, Status, Telegram, Unit};

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
        if self.is_s14() && count == Variant::S14.beam_count() {
            return Some(Variant::S14);
        }
        Some(Variant::of_count(count).unwrap_or(Variant::of(180, 100)))
    }

    fn is_s14(&self) -> bool {
        self.type_text.as_deref().is_some_and(|text| Model::of_text(text) == Model::S14)
    }

    /// The configuration to begin with: as reported, in the unit of the scans.
    #[must_use]
    pub fn initial_config(&self) -> ConfigBlock {
        let config = self.config.unwrap_or_default();
        let mm = self.scans.first().map_or(config.is_mm(), |scan| scan.mm);
        config.with_units(mm, config.measuring_mode())
    }
}

/// Bytes of a laser on their way to a track.
pub struct LaserReading {
    /// Bytes taken so far and their times.
    pub bytes: ByteTimes,
    deframer: DeviceDeframer,
    track: LaserTrack,
}

impl LaserReading {
    /// Nothing read yet, on a line of this rate.
    #[must_use]
    pub fn new(baud: u32) -> Self {
        let (deframer, track) = (DeviceDeframer::new(), LaserTrack::default());
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
    pub fn finish(mut self) -> Option<LaserTrack> {
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
                let whole = scan.selection() == Selection::All && scan.partial_offset_quarters().is_none();
                let words = whole.then(|| scan.values().collect());
                self.keep_scan(time_ns, words, scan.unit(), &telegram);
            }
            // Of scans with remission the ranges.
            Ok(Reply::Pairs(pairs)) => {
                let mut parts = pairs.parts();
                let (first, alone) = (parts.next(), parts.next().is_none());
                let unit = first.map_or(Unit::Cm, |part| part.unit);
                let whole = first.filter(|part| alone && part.span.first == 1);
                let words = whole.map(|part| part.pairs().map(|(range, _)| range).collect());
                self.keep_scan(time_ns, words, unit, &telegram);
            }
            Ok(Reply::S14(scan)) => {
                self.type_text.get_or_insert_with(|| Model::text_of_name("S14").to_owned());
                self.keep_scan(time_ns, Some(scan.values().collect()), scan.unit, &telegram);
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

    /// Keeps a scan; `None` of words is one that is not whole.
    fn keep_scan(&mut self, time_ns: i64, words: Option<ScanWords>, unit: Unit, telegram: &Telegram<'_>) {
        match words.filter(|_| unit != Unit::TenCm) {
            Some(words) => {
                let status = telegram.status().unwrap_or(Status::OK).0;
                self.scans.push(RecordedScan { time_ns, words, mm: unit == Unit::Mm, status });
            }
            None => self.other_scans += 1,
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
