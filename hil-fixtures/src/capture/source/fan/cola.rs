//! The side of a SICK laser on a network in a capture: its scans as they were sent, and who it said it is.

use super::playback::{Playback, Played};
use super::{NETWORK_BAUD, RecordedTelegram, times_ns};
use crate::capture::source::byte_times::ByteTimes;
use crate::devices::cola::telegram::framed;
use crate::devices::cola::{ColaParams, ColaScans, Telegrams};
use crate::devices::run::Run;
use biplane_wire::Item;
use biplane_wire::cola::{
    Channel, Deframer, Family, Kind, OutputRange, Scan, ScanConfig, ScanDataConfig, Telegram, Width,
    parse_texts,
};
use std::sync::Arc;

const NS_PER_US: i64 = 1_000;
/// A laser that has nothing to send is asked again after this long.
const PATIENCE_NS: i64 = 5_000_000;
/// A step this near to a fraction of two degrees is that fraction, 1/10000 degree: it is sent rounded.
const TWO_DEG_E4: f64 = 20_000.0;
/// The one rate of a TiM, in hundredths.
const TIM_RATE_CHZ: u32 = 1_500;

/// A laser's side of a capture.
#[derive(Clone, Debug, Default)]
pub struct ColaTrack {
    /// Its scans in order.
    pub scans: Vec<RecordedTelegram>,
    /// Name and version, where it said them.
    pub ident: Option<[String; 2]>,
    /// Bytes that are in no telegram.
    pub skipped_bytes: u64,
}

/// Bytes of a laser on their way to a track.
pub struct ColaReading {
    /// Bytes taken so far and their times.
    pub bytes: ByteTimes,
    deframer: Box<Deframer>,
    track: ColaTrack,
}

impl Default for ColaReading {
    fn default() -> Self {
        let (deframer, track) = (Box::new(Deframer::new()), ColaTrack::default());
        Self { bytes: ByteTimes::new(NETWORK_BAUD), deframer, track }
    }
}

impl ColaReading {
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
    pub fn finish(mut self) -> Option<ColaTrack> {
        self.deframer.finish();
        while self.deframer.next().is_some() {}
        self.track.skipped_bytes = self.deframer.counts().skipped_bytes;
        (self.bytes.position > 0).then_some(self.track)
    }
}

impl ColaTrack {
    fn keep(&mut self, time_ns: i64, bytes: &[u8]) {
        let Ok(telegram) = Telegram::parse(bytes) else { return };
        match (telegram.kind, telegram.name) {
            (Kind::Event | Kind::ReadAnswer, Scan::NAME) if Scan::parse(&telegram).is_ok() => {
                self.scans.push(RecordedTelegram { time_ns, bytes: bytes.to_vec() });
            }
            (Kind::ReadAnswer, b"DeviceIdent") => {
                let texts = parse_texts(&telegram).map(|text| String::from_utf8_lossy(text).into_owned());
                self.ident = Some(texts);
            }
            _ => {}
        }
    }

    /// Beams of a scan.
    #[must_use]
    pub fn beams(&self) -> usize {
        self.first(|scan| ranges(scan).map_or(0, |channel| channel.values.len())).unwrap_or(0)
    }

    fn first<T>(&self, take: impl FnOnce(&Scan<'_>) -> T) -> Option<T> {
        let telegram = Telegram::parse(&self.scans.first()?.bytes).ok()?;
        Scan::parse(&telegram).ok().map(|scan| take(&scan))
    }

    /// The laser as it was recorded: what it is, and how it is set.
    #[must_use]
    pub fn params(&self, like: &ColaParams) -> ColaParams {
        let named = self.ident.clone().filter(|[name, _]| Family::of_name(name.as_bytes()).is_some());
        let named = named.unwrap_or_else(|| {
            let family = self.first(family_of).unwrap_or(Family::Lms1xx);
            [family.name().to_owned(), like.version.clone()]
        });
        let [name, version] = named;
        let family = Family::of_name(name.as_bytes()).unwrap_or(Family::Lms1xx);
        let mut params = ColaParams { version, ..ColaParams::new(family, &name) };
        params.boot_ns = like.boot_ns;
        self.first(|scan| {
            params.serial = scan.head.serial;
            params.data = data_of(scan);
            let Some(channel) = ranges(scan) else { return };
            params.range = range_of(channel);
            let (rate_chz, step_e4deg) = (scan.head.scan_frequency_chz, params.range.step_e4deg);
            params.scan = ScanConfig { rate_chz, step_e4deg, ..params.scan };
        });
        params
    }
}

fn ranges<'a>(scan: &'a Scan<'_>) -> Option<&'a Channel<'a>> {
    scan.channels.iter().find(|channel| channel.name == *b"DIST1")
}

/// A device that has not said what it is: one that sends sooner than its beams sweep the fan is no LMS5xx.
fn family_of(scan: &Scan<'_>) -> Family {
    let head = &scan.head;
    let steps =
        ranges(scan).map_or(0.0, |channel| f64::from(channel.step_e4deg) * channel.values.len() as f64);
    let sweep_us = steps / 3.6e6 * 1e8 / f64::from(head.scan_frequency_chz.max(1));
    match head.scan_frequency_chz {
        TIM_RATE_CHZ => Family::Tim7xx,
        _ if f64::from(head.sent_us.wrapping_sub(head.scan_us)) < sweep_us => Family::Lms1xx,
        _ => Family::Lms5xx,
    }
}

fn range_of(channel: &Channel<'_>) -> OutputRange {
    let step = f64::from(channel.step_e4deg.max(1));
    let exact = TWO_DEG_E4 / (TWO_DEG_E4 / step).round().max(1.0);
    let step = if (exact - step).abs() < 1.0 { exact } else { step };
    let steps = channel.values.len().saturating_sub(1) as f64;
    OutputRange {
        step_e4deg: u32::from(channel.step_e4deg),
        start_e4deg: channel.start_e4deg,
        stop_e4deg: channel.start_e4deg + (steps * step).round() as i32,
    }
}

fn data_of(scan: &Scan<'_>) -> ScanDataConfig {
    let remission = scan.channels.iter().find(|channel| channel.name == *b"RSSI1");
    ScanDataConfig {
        channels: [1, 0],
        remission: remission.is_some(),
        is_remission_wide: remission.is_some_and(|channel| channel.width == Width::Word),
        clock: scan.clock.is_some(),
        every: 1,
        ..ScanDataConfig::default()
    }
}

/// Scans of a capture for a mock laser.
pub struct RecordedColaScans {
    track: Arc<ColaTrack>,
    playback: Playback,
    next: usize,
}

impl RecordedColaScans {
    /// `origin_ns` is the capture's start; with `once` the scans end with the capture, else the last one goes
    /// on.
    #[must_use]
    pub fn new(track: Arc<ColaTrack>, origin_ns: i64, run: Run, once: bool) -> Self {
        let playback = Playback::new(&times_ns(&track.scans, origin_ns), run, once);
        Self { track, playback, next: 0 }
    }

    /// The scan as it was; of one that is sent again, times and counters go on.
    fn append(&self, played: Played, telegrams: &Telegrams<'_>, out: &mut Vec<u8>) {
        let Some(recorded) = self.track.scans.get(played.index) else { return };
        let Ok(telegram) = Telegram::parse(&recorded.bytes) else { return };
        let Ok(mut scan) = Scan::parse(&telegram) else { return };
        let later_us = (played.later_ns / NS_PER_US) as u32;
        scan.head.scan_us = scan.head.scan_us.wrapping_add(later_us);
        scan.head.sent_us = scan.head.sent_us.wrapping_add(later_us);
        scan.head.telegram_counter = scan.head.telegram_counter.wrapping_add(played.repeats);
        scan.head.scan_counter = scan.head.scan_counter.wrapping_add(played.repeats);
        for form in telegrams.forms {
            out.extend(framed(&scan, *form));
        }
    }
}

impl ColaScans for RecordedColaScans {
    fn are_recorded(&self) -> bool {
        true
    }

    fn begin_at(&mut self, now_ns: i64) {
        self.next = self.playback.place_from(now_ns);
    }

    fn next_ns(&self, now_ns: i64) -> i64 {
        self.playback.scan(self.next).map_or(now_ns + PATIENCE_NS, |played| played.at_ns)
    }

    fn send(&mut self, now_ns: i64, telegrams: &Telegrams<'_>, out: &mut Vec<u8>) -> bool {
        let Some(played) = self.playback.scan(self.next).filter(|played| played.at_ns <= now_ns) else {
            return false;
        };
        self.next += 1;
        self.append(played, telegrams, out);
        true
    }
}
