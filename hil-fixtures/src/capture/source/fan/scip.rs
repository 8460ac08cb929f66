//! The side of a Hokuyo laser in a capture: its scans as they were sent, and what it said of itself.

use super::playback::Playback;
use super::{NETWORK_BAUD, RecordedTelegram, times_ns};
use crate::capture::source::byte_times::ByteTimes;
use crate::devices::run::Run;
use crate::devices::scip::{ScipLink, ScipParams, ScipScans, ScipState, scan_reply, turns};
use biplane_wire::Item;
use biplane_wire::scip::{Block, CLOCK_ROUND_MS, Command, Deframer, Delivery, Parameters, Scan, ScanRequest};
use std::sync::Arc;

const NS_PER_MS: i64 = 1_000_000;
/// A scan waits for its line so long: times of a capture are those of reads.
const WAITS_NS: i64 = 250_000_000;

/// A laser's side of a capture.
#[derive(Clone, Debug, Default)]
pub struct ScipTrack {
    /// Its scans of the most frequent kind, in order.
    pub scans: Vec<RecordedTelegram>,
    /// What was asked for them.
    pub request: Option<ScanRequest>,
    /// Geometry, reach and rate, and the model, where it said them.
    pub parameters: Option<(Parameters, String)>,
    /// Its firmware and serial number, where it said them.
    pub version: Option<[String; 2]>,
    /// Bytes that are in no reply.
    pub skipped_bytes: u64,
    /// Scans that were asked for otherwise: not played.
    pub other_scans: u64,
}

/// Bytes of a laser on their way to a track.
pub struct ScipReading {
    /// Bytes taken so far and their times.
    pub bytes: ByteTimes,
    deframer: Box<Deframer>,
    track: ScipTrack,
    requests: Vec<ScanRequest>,
}

impl ScipReading {
    /// Nothing read yet, on a line of this rate; without one, on a network.
    #[must_use]
    pub fn new(baud: Option<u32>) -> Self {
        let (deframer, track) = (Box::new(Deframer::new()), ScipTrack::default());
        Self { bytes: ByteTimes::new(baud.unwrap_or(NETWORK_BAUD)), deframer, track, requests: Vec::new() }
    }

    /// Takes the bytes of a read.
    pub fn take(&mut self, time_ns: i64, bytes: &[u8]) {
        self.bytes.read(time_ns, bytes.len());
        let (times, track, requests) = (&self.bytes, &mut self.track, &mut self.requests);
        self.deframer.feed(bytes, |item| {
            if let Item::Frame { offset, bytes } = item
                && let Ok(block) = Block::parse(bytes)
            {
                match Scan::parse(&block) {
                    Some(Ok(scan)) => {
                        let time_ns = times.left_ns(offset);
                        track.scans.push(RecordedTelegram { time_ns, bytes: bytes.to_vec() });
                        requests.push(without_count(&scan.request));
                    }
                    Some(Err(_)) => {}
                    None => track.learn(&block),
                }
            }
        });
    }

    /// The track, if there was any byte.
    #[must_use]
    pub fn finish(mut self) -> Option<ScipTrack> {
        self.deframer.finish();
        while self.deframer.next().is_some() {}
        self.track.skipped_bytes = self.deframer.counts().skipped_bytes;
        self.track.keep_one_kind(&self.requests);
        (self.bytes.position > 0).then_some(self.track)
    }
}

/// Scans of one request state how many are still to come.
fn without_count(request: &ScanRequest) -> ScanRequest {
    let delivery = match request.delivery {
        Delivery::Once => Delivery::Once,
        Delivery::Stream { skip, .. } => Delivery::Stream { skip, count: 0 },
    };
    ScanRequest { delivery, ..*request }
}

impl ScipTrack {
    fn learn(&mut self, block: &Block<'_>) {
        let text = |key: &[u8]| {
            block.value(key).map(|value| String::from_utf8_lossy(value).into_owned()).unwrap_or_default()
        };
        match block.request.command {
            Command::Version => self.version = Some([text(b"FIRM"), text(b"SERI")]),
            _ => {
                if let Some(Ok(parameters)) = Parameters::parse(block) {
                    self.parameters = Some((parameters, text(b"MODL")));
                }
            }
        }
    }

    /// A stream has one kind of scans: the most frequent one stays.
    fn keep_one_kind(&mut self, requests: &[ScanRequest]) {
        let count = |request: &ScanRequest| requests.iter().filter(|other| *other == request).count();
        let mut kinds: Vec<ScanRequest> = Vec::new();
        for request in requests {
            if !kinds.contains(request) {
                kinds.push(*request);
            }
        }
        self.request = kinds.into_iter().max_by_key(count);
        let mut of = requests.iter();
        let before = self.scans.len();
        self.scans.retain(|_| of.next() == self.request.as_ref());
        self.other_scans = (before - self.scans.len()) as u64;
    }

    /// The laser as it was recorded, on the line of a rig. Without its parameters it is one of this type.
    #[must_use]
    pub fn params(&self, like: ScipParams, is_network: bool, baud: u32) -> ScipParams {
        let link = match (is_network, like.link) {
            (true, _) => ScipLink::Network,
            (false, ScipLink::Usb) => ScipLink::Usb,
            (false, _) => ScipLink::Serial(baud),
        };
        let mut params = ScipParams { link, state: ScipState::Idle, ..like };
        if let Some((parameters, model)) = &self.parameters {
            params.parameters = *parameters;
            params.model.clone_from(model);
        }
        if let Some([firmware, serial]) = &self.version {
            params.firmware.clone_from(firmware);
            params.serial.clone_from(serial);
        }
        if let Some(request) = self.request {
            // A client that asks for all that there is gets what there is.
            params.parameters.first_step = request.first_step;
            params.parameters.last_step = request.last_step;
            params.has_intensity |= request.with_intensity;
        }
        params
    }
}

/// Scans of a capture for a mock laser, and a clock for whoever asks in between.
pub struct RecordedScipScans {
    track: Arc<ScipTrack>,
    playback: Playback,
    first_ms: u32,
    clock_at_ns: i64,
}

impl RecordedScipScans {
    /// `origin_ns` is the capture's start; with `once` the scans end with the capture, else the last one goes
    /// on.
    #[must_use]
    pub fn new(track: Arc<ScipTrack>, origin_ns: i64, run: Run, once: bool) -> Self {
        let playback = Playback::new(&times_ns(&track.scans, origin_ns), run, once);
        let first_ms = track.scans.first().and_then(|scan| Block::parse(&scan.bytes).ok()?.clock_ms());
        Self { track, playback, first_ms: first_ms.unwrap_or(0), clock_at_ns: 0 }
    }

    /// The place of a turn: turns between the scans were left out when they were recorded.
    fn place(request: &ScanRequest, turn: i64) -> usize {
        usize::try_from(turn / turns(request)).unwrap_or(0)
    }

    fn request(&self) -> Option<ScanRequest> {
        self.track.request
    }
}

impl ScipScans for RecordedScipScans {
    fn has(&self, request: &ScanRequest) -> bool {
        self.request() == Some(without_count(request))
    }

    fn clock_ms(&self, now_ns: i64) -> u32 {
        let passed_ms = (now_ns - self.clock_at_ns).div_euclid(NS_PER_MS) + i64::from(self.first_ms);
        passed_ms.rem_euclid(i64::from(CLOCK_ROUND_MS)) as u32
    }

    fn reset_clock(&mut self, now_ns: i64) {
        (self.first_ms, self.clock_at_ns) = (0, now_ns);
    }

    fn turn_from(&self, at_ns: i64) -> i64 {
        let place = self.playback.place_from(at_ns) as i64;
        place * self.request().map_or(1, |request| turns(&request))
    }

    fn sent_ns(&self, _: &ScipParams, request: &ScanRequest, turn: i64) -> i64 {
        self.playback.scan(Self::place(request, turn)).map_or(i64::MAX, |played| played.at_ns)
    }

    fn reply(&mut self, _: &ScipParams, request: &ScanRequest, turn: i64, tag: Option<&[u8]>) -> Vec<u8> {
        let played = self.playback.scan(Self::place(request, turn));
        let recorded = played.and_then(|played| self.track.scans.get(played.index));
        let block = recorded.and_then(|recorded| Block::parse(&recorded.bytes).ok());
        let Some((played, Some(Ok(scan)))) = played.zip(block.as_ref().map(Scan::parse)) else {
            return Vec::new();
        };
        let later_ms = (played.later_ns / NS_PER_MS) as u32;
        let clock_ms = scan.clock_ms.wrapping_add(later_ms) % CLOCK_ROUND_MS;
        let readings: Vec<_> = scan.values.iter().collect();
        scan_reply(request, clock_ms, tag, &readings)
    }

    fn waits_ns(&self) -> i64 {
        WAITS_NS
    }
}
