//! Scans flowing: the device is asked to stream, and what comes is read, judged and handed on.

use biplane_wire::lms::{MIRROR_TURN_NS, Mode, ModeResult, Request, Span, Status};

use crate::session::device_session::Output;
use crate::session::event::{Event, Step};
use crate::session::lms::device::Device;
use crate::session::lms::dialogue::{Dialogue, Next, State};
use crate::session::lms::scan::condition::Condition;
use crate::session::lms::scan::plausible::{Form, Plausibility, Verdict};
use crate::session::lms::scan::ranges::{Measured, ScanReading, Unpublished};
use crate::session::lms::streaming::index_watch::IndexWatch;
use crate::session::timing::retry::Patience;

/// A mode change takes up to 3 s; most take 80 ms.
const START: Patience = Patience::new(250, 4).acknowledged(3200);
/// Everything of a scan telegram that is not a value: frame, count, index bytes, and what parts of a fan add.
const OVERHEAD_BYTES: usize = 24;
/// A device that refuses to send remission so often does not have it.
const REMISSION_ATTEMPTS: u8 = 2;

/// The telegram that measured values came in.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Source {
    pub(crate) offset: u64,
    pub(crate) length: usize,
    pub(crate) address: u8,
    pub(crate) code: u8,
    pub(crate) status: Status,
}

/// What is known of the scans that flow.
#[derive(Debug)]
pub(crate) struct Stream {
    plausibility: Plausibility,
    /// The scan of the telegram before this one, when it is doubted: handed on when the next one confirms it.
    doubted: Box<Option<(Form, Option<ScanReading>)>>,
    condition: Condition,
    index_watch: IndexWatch,
    /// Bytes of the last scan's telegram.
    telegram_bytes: Option<usize>,
    /// When the last scan came.
    scan_ns: i64,
    /// The device does not send remission.
    refused_remission: bool,
    /// This session has set the device up.
    has_streamed: bool,
}

impl Default for Stream {
    fn default() -> Self {
        Self {
            plausibility: Plausibility::default(),
            doubted: Box::default(),
            condition: Condition::default(),
            index_watch: IndexWatch::default(),
            telegram_bytes: None,
            scan_ns: i64::MIN,
            refused_remission: false,
            has_streamed: false,
        }
    }
}

impl Stream {
    /// When the last scan came; `None` before the first.
    pub(crate) fn scan_ns(&self) -> Option<i64> {
        Some(self.scan_ns).filter(|&scan_ns| scan_ns > i64::MIN)
    }

    /// How scans are to be read may be another: the next ones show their form anew.
    pub(crate) fn settings_reported(&mut self, device: &Device) {
        self.plausibility.restart(device.info.config.as_ref());
    }

    /// Another device: what the one before refused says nothing of it.
    pub(crate) fn forget_refusal(&mut self) {
        self.refused_remission = false;
    }

    /// No scan is decoded until the device is set up anew.
    pub(crate) fn is_interrupted(&mut self) {
        self.has_streamed = false;
    }

    /// The device was switched on: it counts anew.
    pub(crate) fn powered_on(&mut self) {
        self.has_streamed = false;
        self.index_watch.restart();
    }

    fn asks_remission(&self, device: &Device) -> bool {
        device.settings.remission && !self.refused_remission
    }

    /// Asks the device to stream.
    pub(crate) fn start(&self, talk: &mut Dialogue, device: &Device) -> Next {
        let span = Span { first: 1, last: device.beams() };
        let mode = if !self.asks_remission(device) {
            Mode::StreamAll
        } else if device.is_s14() {
            Mode::Reflectivity { first: span.first, last: span.last }
        } else {
            Mode::Pairs([span].into_iter().collect())
        };
        talk.ask(State::StartStream, Step::StartStream, Request::Mode(mode), START)
    }

    /// A refused start: without remission, if that was asked for.
    pub(crate) fn start_refused(&mut self, talk: &mut Dialogue, device: &Device) -> Next {
        if self.asks_remission(device) && talk.asked() >= REMISSION_ATTEMPTS {
            return self.start_failed(talk, device);
        }
        talk.ask_again();
        Next::Stay
    }

    /// No start in all attempts: without remission, if that was asked for.
    pub(crate) fn start_failed(&mut self, talk: &mut Dialogue, device: &Device) -> Next {
        if !self.asks_remission(device) {
            return Next::SearchAgain;
        }
        self.refused_remission = true;
        talk.say(Event::RemissionRefused);
        Next::StartStream
    }

    /// The device streams.
    pub(crate) fn begin(&mut self, talk: &mut Dialogue, device: &mut Device) {
        talk.open = None;
        talk.event_dedup.succeeded(Step::StartStream);
        self.has_streamed = true;
        self.telegram_bytes = None;
        self.index_watch.restart();
        self.plausibility.restart(device.info.config.as_ref());
        device.health.differs = self.differs(talk, device);
        talk.state = State::Streaming;
        talk.say(Event::Streaming);
    }

    /// Whether the device streams otherwise than the rig asks: its rate, its variant, its configuration, or
    /// without remission.
    fn differs(&self, talk: &Dialogue, device: &Device) -> bool {
        talk.baud != device.settings.baud
            || device.info.variant.is_some_and(|variant| variant != device.wanted_variant())
            || !device.change().is_empty()
            || (device.settings.remission && self.refused_remission)
    }

    /// Scans count once this session has set the device up, also those that an adapter held back until after
    /// a stop or a search began. Those of a device that somebody else left streaming only show that it is
    /// there.
    pub(crate) fn measured(
        &mut self,
        talk: &mut Dialogue,
        device: &mut Device,
        source: &Source,
        measured: &Measured<'_>,
    ) {
        if !self.has_streamed && talk.state != State::Listening {
            return;
        }
        let form = Form::of(source.address, source.code, source.status, measured);
        let verdict = self.plausibility.judge(form, talk.now_ns);
        let (doubted, is_damaged) = match self.doubted.take() {
            Some((before, reading)) if before == form => (reading, false),
            before => (None, before.is_some()),
        };
        if is_damaged && !std::mem::replace(&mut talk.event_dedup.rejected, true) {
            talk.say(Event::Implausible);
        }
        let mode = device.info.measuring_mode();
        let decoded =
            measured.decode(source.offset, source.length, mode.unwrap_or_default(), device.is_s14());
        match verdict {
            Verdict::Accepted => {}
            Verdict::Confirmed => self.confirmed(talk, device, doubted),
            Verdict::Doubted => {
                *self.doubted = Some((form, decoded.ok()));
                device.health.rejected += 1;
                return;
            }
        }
        self.see_status(talk, device, source.status);
        if mode.is_none() && !std::mem::replace(&mut talk.event_dedup.mode, true) {
            talk.say(Event::ModeAssumed);
        }
        match decoded {
            Ok(reading) => self.publish(talk, device, reading),
            Err(why) => unpublished(talk, device, why),
        }
    }

    /// The telegram that was doubted was none that was damaged. With others between, its scan came too long
    /// ago to be handed on in order.
    fn confirmed(&mut self, talk: &mut Dialogue, device: &mut Device, doubted: Option<ScanReading>) {
        device.health.rejected = device.health.rejected.saturating_sub(1);
        match doubted {
            Some(reading) => {
                device.health.confirmed_bytes += reading.length as u64;
                self.publish(talk, device, reading);
            }
            None => device.health.not_kept += 1,
        }
    }

    fn publish(&mut self, talk: &mut Dialogue, device: &mut Device, reading: ScanReading) {
        self.telegram_bytes = Some(reading.length);
        self.scan_ns = talk.now_ns;
        device.health.dazzled_values += u64::from(reading.dazzled);
        if let Some(index) = reading.index {
            self.index_watch.see(talk.now_ns, index, reading.geometry.turns);
            device.health.lost_telegrams = self.index_watch.lost_telegrams;
            device.health.left_out_scans = self.index_watch.left_out_scans;
        }
        let variant = (reading.geometry.fov_deg(), reading.geometry.step_cdeg);
        if talk.state == State::Listening {
            let is_other = variant != device.wanted_variant();
            device.health.differs = is_other || self.differs(talk, device);
            if is_other && talk.event_dedup.variant.is_none() {
                talk.event_dedup.variant = Some(variant);
                talk.say(Event::VariantKept { fov_deg: variant.0, resolution_cdeg: variant.1 });
            }
        }
        talk.outputs.push(Output::Scan(reading));
    }

    fn see_status(&mut self, talk: &mut Dialogue, device: &mut Device, status: Status) {
        device.health.status = Some(status);
        device.health.polluted_scans += u64::from(status.polluted());
        device.health.implausible_scans += u64::from(status.implausible());
        self.condition.see(talk.now_ns, status, |trouble, begins| {
            talk.outputs.say(Event::Trouble { trouble, begins });
        });
        device.health.troubles = self.condition.troubles(talk.now_ns);
    }

    /// From a telegram to the next, at most, nanoseconds.
    pub(crate) fn period_ns(&self, talk: &Dialogue, device: &Device) -> i64 {
        let value_bytes = if self.asks_remission(device) { 4 } else { 2 };
        let values_bytes = usize::from(device.beams()) * value_bytes;
        let bytes = self.telegram_bytes.unwrap_or(values_bytes + OVERHEAD_BYTES);
        talk.transfer_ns(bytes) + 4 * MIRROR_TURN_NS
    }
}

/// The device says whether it streams from here on.
pub(crate) fn start_answered(result: ModeResult) -> Next {
    if result == ModeResult::Done { Next::Streaming } else { Next::Refused }
}

/// Counts what cannot be published, and says so once for each reason.
pub(crate) fn unpublished(talk: &mut Dialogue, device: &mut Device, why: Unpublished) {
    device.health.not_kept += 1;
    if !talk.event_dedup.unpublished.contains(&why) && talk.event_dedup.unpublished.push(why).is_ok() {
        talk.say(Event::Unpublished(why));
    }
}
