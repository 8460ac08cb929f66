//! Scans flowing, scans failing to flow, and the stop.

use biplane_wire::lms::{MIRROR_TURN_NS, Mode, ModeResult, Reply, Request, ScanView};

use super::machine::{Machine, State};
use super::reading::decode;
use crate::session::retry::Patience;
use crate::session::{Event, Output, Step};
use crate::stamping::byte_time_ns;

/// A mode change may take 3 s.
const START: Patience = Patience::new(400, 8);
const STOP: Patience = Patience::new(400, 3);
/// Without an intact telegram for so long, the session starts again; at slow rates for two and a half scan periods.
const SILENCE_NS: i64 = 1_000_000_000;
/// Bytes of the longest scan telegram.
const LONGEST_TELEGRAM: i64 = 812;
/// With a byte in the last so many nanoseconds the line is not silent, only damaged.
const RECENT_NS: i64 = 500_000_000;

impl Machine {
    pub(super) fn enter_start_stream(&mut self) {
        self.ask(State::StartStream, Step::StartStream, Request::Mode(Mode::StreamAll), START);
    }

    pub(super) fn start_stream_answered(&mut self, reply: &Reply<'_>) {
        let Reply::Mode(result) = reply else { return };
        if *result == ModeResult::Done {
            self.enter_streaming();
        } else {
            self.refused();
        }
    }

    fn enter_streaming(&mut self) {
        self.question = None;
        self.has_streamed = true;
        self.likely_baud = self.baud;
        self.last_frame_ns = self.now_ns;
        self.state = State::Streaming { since_ns: self.now_ns };
        self.say(Event::Streaming);
    }

    /// Scans count once this session has set the device up, also those that an adapter held back until after a stop or a search
    /// began. Those of a device that somebody else left streaming only show that it is there.
    pub(super) fn scan(&mut self, offset: u64, length: usize, view: &ScanView<'_>) {
        if self.state == State::StartStream {
            self.enter_streaming();
        }
        if self.has_streamed || self.state == State::Listening {
            self.keep_scan(offset, length, view);
        }
        self.heard_while_searching();
    }

    fn keep_scan(&mut self, offset: u64, length: usize, view: &ScanView<'_>) {
        if self.info.config.is_none() && !self.mode_said {
            self.mode_said = true;
            self.say(Event::ModeAssumed);
        }
        match decode(offset, length, view, self.info.measuring_mode(), self.info.is_s14()) {
            Some(reading) => {
                let (fov_deg, resolution_cdeg) = (reading.fan.fov_deg(), reading.fan.step_cdeg);
                let wanted = (self.settings.fov_deg, self.settings.resolution_cdeg);
                if self.state == State::Listening
                    && (fov_deg, resolution_cdeg) != wanted
                    && !self.variant_said
                {
                    self.variant_said = true;
                    self.say(Event::VariantKept { fov_deg, resolution_cdeg });
                }
                self.outputs.push(Output::Scan(reading));
            }
            None => self.not_kept += 1,
        }
    }

    pub(super) fn silence_deadline_ns(&self) -> i64 {
        let transfer_ns = LONGEST_TELEGRAM * byte_time_ns(self.baud) + 4 * MIRROR_TURN_NS;
        self.last_frame_ns.saturating_add(SILENCE_NS.max(transfer_ns * 5 / 2))
    }

    pub(super) fn look_for_silence(&mut self) {
        if !matches!(self.state, State::Streaming { .. }) || self.now_ns < self.silence_deadline_ns() {
            return;
        }
        let for_ms = u32::try_from((self.now_ns - self.last_frame_ns) / 1_000_000).unwrap_or(u32::MAX);
        let is_quiet = self.now_ns - self.last_byte_ns >= RECENT_NS;
        self.say(if is_quiet { Event::Silent { for_ms } } else { Event::Garbled { for_ms } });
        self.enter_search(0, 0);
    }

    /// The device has lost everything but its EEPROM, its rate first of all.
    pub(super) fn powered_on(&mut self) {
        self.say(Event::PoweredOn);
        self.refused_rate = false;
        self.has_streamed = false;
        self.likely_baud = self.baud;
        match self.state {
            State::Listening | State::Stopping | State::Done => {}
            State::FindRate { .. } | State::ConfirmRate { .. } => self.heard_while_searching(),
            _ => self.enter_search(0, 0),
        }
    }

    pub(super) fn stop(&mut self) {
        match self.state {
            State::Stopping | State::Done => {}
            State::Listening | State::FindRate { .. } | State::ConfirmRate { .. } => {
                self.question = None;
                self.state = State::Done;
            }
            _ => self.ask(State::Stopping, Step::StopStream, Request::Mode(Mode::OnRequest), STOP),
        }
    }

    pub(super) fn stopping_answered(&mut self, reply: &Reply<'_>) {
        if matches!(reply, Reply::Mode(_)) {
            self.say(Event::Stopped);
            self.finish_stop();
        }
    }

    pub(super) fn finish_stop(&mut self) {
        self.question = None;
        self.state = State::Done;
    }
}
