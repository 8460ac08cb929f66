//! Scans flowing, and scans failing to flow.

use biplane_wire::lms::{MIRROR_TURN_NS, Mode, ModeResult, Reply, Request, Span, Status};

use super::machine::{Machine, State};
use super::plausible::Form;
use super::reading::{Measured, ScanReading, Unpublished};
use super::search::PAUSE_NS;
use crate::session::retry::Patience;
use crate::session::{Event, Output, Step, silence};

/// A mode change takes up to 3 s; most take 80 ms.
const START: Patience = Patience::new(250, 4).acknowledged(3200);
/// Without a byte for so long, the device is silent: also a slow line pauses for two mirror turns at most, and adapters
/// stall for 0.3 s.
pub(super) const SILENT_NS: i64 = 900_000_000;
/// With a byte in the last so many nanoseconds the line is called garbled, not silent.
const RECENT_NS: i64 = 500_000_000;
/// Without a telegram for so long, the line is garbled, which is said within a second; at slow rates a little more than the time of
/// one, and two and a half of it without an intact one.
const GARBLED_NS: i64 = 950_000_000;
/// Everything of a scan telegram that is not a value: frame, count, index bytes, and what parts of a fan add.
const OVERHEAD_BYTES: usize = 24;
/// A device that refuses to send remission so often does not have it.
const REMISSION_ATTEMPTS: u8 = 2;

/// The telegram that measured values came in.
#[derive(Copy, Clone, Debug)]
pub(super) struct Source {
    pub(super) offset: u64,
    pub(super) length: usize,
    pub(super) address: u8,
    pub(super) code: u8,
    pub(super) status: Status,
}

impl Machine {
    fn asks_remission(&self) -> bool {
        self.settings.remission && !self.refused_remission
    }

    /// Values of a scan of the variant in force.
    fn beams(&self) -> u16 {
        if self.info.is_s14(&self.settings) {
            return 181;
        }
        let wanted = (self.settings.fov_deg, self.settings.resolution_cdeg);
        let (fov_deg, resolution_cdeg) = self.info.variant.unwrap_or(wanted);
        fov_deg.saturating_mul(100) / resolution_cdeg.max(1) + 1
    }

    pub(super) fn enter_start_stream(&mut self) {
        let span = Span { first: 1, last: self.beams() };
        let mode = if !self.asks_remission() {
            Mode::StreamAll
        } else if self.info.is_s14(&self.settings) {
            Mode::Reflectivity { first: span.first, last: span.last }
        } else {
            Mode::Pairs([span].into_iter().collect())
        };
        self.ask(State::StartStream, Step::StartStream, Request::Mode(mode), START);
    }

    pub(super) fn start_stream_answered(&mut self, reply: &Reply<'_>) {
        let Reply::Mode(result) = reply else { return };
        if *result == ModeResult::Done {
            self.enter_streaming();
        } else {
            self.refused();
        }
    }

    /// A refused start: without remission, if that was asked for.
    pub(super) fn start_refused(&mut self) {
        let asked = self.question.as_ref().map_or(0, |(question, ..)| question.asked());
        if self.asks_remission() && asked >= REMISSION_ATTEMPTS {
            self.start_failed();
        } else {
            self.ask_again();
        }
    }

    pub(super) fn start_failed(&mut self) {
        if self.asks_remission() {
            self.refused_remission = true;
            self.say(Event::RemissionRefused);
            self.enter_start_stream();
        } else {
            self.restart_search();
        }
    }

    fn enter_streaming(&mut self) {
        self.question = None;
        self.said.succeeded(Step::StartStream);
        self.has_streamed = true;
        self.likely_baud = self.baud;
        self.last_frame_ns = self.now_ns;
        self.last_sign_ns = self.now_ns;
        self.last_byte_ns = self.now_ns;
        self.telegram_bytes = None;
        self.index_watch.restart();
        self.plausibility.restart(self.info.config.as_ref());
        self.health.differs = self.differs();
        self.state = State::Streaming;
        self.say(Event::Streaming);
    }

    /// Whether the device streams otherwise than the rig asks: its rate, its variant, its configuration, or without remission.
    fn differs(&self) -> bool {
        let wanted = (self.settings.fov_deg, self.settings.resolution_cdeg);
        self.baud != self.settings.baud
            || self.info.variant.is_some_and(|variant| variant != wanted)
            || self.info.differs(&self.settings).is_some_and(|change| !change.is_empty())
            || (self.settings.remission && self.refused_remission)
    }

    /// Scans count once this session has set the device up, also those that an adapter held back until after a stop or a search
    /// began. Those of a device that somebody else left streaming only show that it is there.
    pub(super) fn measured(&mut self, source: &Source, measured: &Measured<'_>) {
        if self.state == State::StartStream {
            self.enter_streaming();
        }
        if self.has_streamed || self.state == State::Listening {
            self.keep(source, measured);
        }
        self.heard_while_searching();
    }

    fn keep(&mut self, source: &Source, measured: &Measured<'_>) {
        let is_s14 = self.info.is_s14(&self.settings);
        let form = Form::of(source.address, source.code, source.status, measured);
        if !self.plausibility.accepts(form) {
            self.health.rejected += 1;
            if !std::mem::replace(&mut self.said.rejected, true) {
                self.say(Event::Implausible);
            }
            return;
        }
        self.see_status(source.status);
        let mode = self.info.measuring_mode();
        if mode.is_none() && !std::mem::replace(&mut self.said.mode, true) {
            self.say(Event::ModeAssumed);
        }
        match measured.decode(source.offset, source.length, mode.unwrap_or_default(), is_s14) {
            Ok(reading) => self.publish(reading),
            Err(why) => self.unpublished(why),
        }
    }

    fn publish(&mut self, reading: ScanReading) {
        self.telegram_bytes = Some(reading.length);
        self.scan_ns = self.now_ns;
        self.health.dazzled_values += u64::from(reading.dazzled);
        if let Some(index) = reading.index {
            self.index_watch.see(self.now_ns, index, reading.fan.turns);
            self.health.lost_telegrams = self.index_watch.lost_telegrams;
            self.health.left_out_scans = self.index_watch.left_out_scans;
        }
        let variant = (reading.fan.fov_deg(), reading.fan.step_cdeg);
        let wanted = (self.settings.fov_deg, self.settings.resolution_cdeg);
        if self.state == State::Listening {
            self.health.differs = variant != wanted || self.differs();
        }
        if self.state == State::Listening && variant != wanted && self.said.variant.is_none() {
            self.said.variant = Some(variant);
            self.say(Event::VariantKept { fov_deg: variant.0, resolution_cdeg: variant.1 });
        }
        self.outputs.push(Output::Scan(reading));
    }

    /// Counts what cannot be published, and says so once for each reason.
    pub(super) fn unpublished(&mut self, why: Unpublished) {
        self.health.not_kept += 1;
        if !self.said.unpublished.contains(&why) && self.said.unpublished.push(why).is_ok() {
            self.say(Event::Unpublished(why));
        }
    }

    fn see_status(&mut self, status: Status) {
        self.health.status = Some(status);
        self.health.polluted_scans += u64::from(status.polluted());
        self.health.implausible_scans += u64::from(status.implausible());
        let (condition, outputs) = (&mut self.condition, &mut self.outputs);
        condition.see(self.now_ns, status, |trouble, begins| {
            outputs.say(Event::Trouble { trouble, begins });
        });
        self.health.troubles = self.condition.troubles(self.now_ns);
    }

    /// From a telegram to the next, at most.
    fn period_ns(&self) -> i64 {
        let values = usize::from(self.beams()) * if self.asks_remission() { 4 } else { 2 };
        let bytes = self.telegram_bytes.unwrap_or(values + OVERHEAD_BYTES);
        self.transfer_ns(bytes) + 4 * MIRROR_TURN_NS
    }

    /// After a pause a line on which bytes flow again gets as long again for a whole telegram, but not for ever.
    fn garbled_deadline_ns(&self) -> i64 {
        let period_ns = self.period_ns();
        let (without_sign_ns, without_frame_ns) =
            (GARBLED_NS.max(period_ns / 10 * 11), GARBLED_NS.max(period_ns / 2 * 5));
        let deadline_ns = |sign_ns: i64, frame_ns: i64| {
            sign_ns.saturating_add(without_sign_ns).min(frame_ns.saturating_add(without_frame_ns))
        };
        let plain_ns = deadline_ns(self.last_sign_ns, self.last_frame_ns);
        let resumed_ns =
            deadline_ns(self.last_sign_ns.max(self.resumed_ns), self.last_frame_ns.max(self.resumed_ns));
        let latest_ns = self.last_frame_ns.saturating_add(2 * without_frame_ns);
        let while_flowing_ns = self.last_byte_ns.saturating_add(PAUSE_NS);
        resumed_ns.min(plain_ns.max(while_flowing_ns)).min(latest_ns)
    }

    pub(super) fn silence_deadline_ns(&self) -> i64 {
        let silent_ns = silence::deadline_ns(self.last_byte_ns, SILENT_NS, self.heard_since_ns);
        self.garbled_deadline_ns().min(silent_ns)
    }

    pub(super) fn look_for_silence(&mut self) {
        if self.state != State::Streaming || self.now_ns < self.silence_deadline_ns() {
            return;
        }
        let for_ms = |since_ns: i64| u32::try_from((self.now_ns - since_ns) / 1_000_000).unwrap_or(u32::MAX);
        let event = if self.now_ns >= self.last_byte_ns.saturating_add(RECENT_NS) {
            Event::Silent { for_ms: for_ms(self.last_byte_ns) }
        } else {
            Event::Garbled { for_ms: for_ms(self.last_frame_ns) }
        };
        self.say(event);
        self.refused_rate = false;
        self.restart_search();
    }

    /// The device has lost everything but its EEPROM, its rate first of all: it is at the rate at which it says so.
    pub(super) fn powered_on(&mut self) {
        self.say(Event::PoweredOn);
        self.refused_rate = false;
        self.has_streamed = false;
        self.failed_switches = 0;
        self.said.forget_failures();
        self.index_watch.restart();
        match self.state {
            State::Listening => self.plausibility.restart(self.info.config.as_ref()),
            State::Stopping | State::Done => {}
            State::FindRate { .. } | State::ConfirmRate { .. } => {
                self.heard_while_searching();
                self.ask_again();
            }
            _ => {
                self.likely_baud = self.baud;
                self.restart_search();
            }
        }
    }
}
