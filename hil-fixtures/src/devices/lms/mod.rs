//! A mock SICK LMS 2xx without any input or output: it acknowledges, replies, changes its rate and streams
//! scans as the real one does, on a clock that is an argument.
//!
//! Sources: SICK telegram listing 8007954 (protocol, data output), logs of a real LMS 200 (latencies),
//! transcripts of five client programs (what must be tolerated). Times are nanoseconds; words are as on the
//! wire.

pub mod frame;
pub mod model;
pub mod params;
pub mod request;
pub mod request_parser;
pub mod scans;
pub mod settings;
#[cfg(test)]
mod tests;

use crate::devices::device::{Device, DeviceCounts};
use crate::devices::lms::request_parser::{Parsed, RequestParser};
use crate::devices::lms::scans::feed::{Answer, Ask, Offer, ScanFeed, Wanted};
use crate::devices::lms::scans::stream::{Content, Output};
use crate::devices::lms::scans::telegram::{Numbers, telegram};
use crate::devices::lms::scans::value_words::Scale;
use crate::devices::pacing::{Burst, Kind, Line};
use frame::{ACK, NAK, reply};
pub use params::LmsParams;
use request::{MODE_ON_REQUEST, State, Then};
use settings::{ConfigBlock, Variant};

const MS: i64 = 1_000_000;

/// A caller that is late by less than this finds the scans that have left meanwhile; what is older is passed
/// over.
const LATEST_NS: i64 = 500 * MS;

/// How often a device that has nothing to do wants to be asked.
const IDLE_NS: i64 = 1_000 * MS;

/// A mock laser.
pub struct LmsDevice {
    params: LmsParams,
    feed: Box<dyn ScanFeed>,
    parser: RequestParser,
    line: Line,
    state: State,
    /// A rate that comes into force at a time.
    switch: Option<(i64, u32)>,
    /// When a reset is over.
    boot_until_ns: Option<i64>,
    /// Not to be asked for a scan before.
    ask_ns: i64,
    telegram_index: u8,
    counts: DeviceCounts,
}

impl LmsDevice {
    /// A laser that measures what `feed` gives.
    #[must_use]
    pub fn new(params: LmsParams, feed: Box<dyn ScanFeed>) -> Self {
        let state = State {
            type_text: params.type_text.clone(),
            address: params.address & 0x7F,
            baud: params.baud,
            max_baud: params.max_baud,
            power_on_baud: 9600,
            installation: false,
            output: if params.left_streaming { Output::Stream(Content::All) } else { Output::OnRequest },
            mode: if params.left_streaming { 0x24 } else { MODE_ON_REQUEST },
            variant: params.variant,
            config: params.config,
            config_bytes: params.config_bytes,
            second_config: [0; settings::SECOND_CONFIG_BYTES],
            errors: params.errors.clone(),
            eeprom_writes: 0,
        };
        let boot_until_ns = params.power_on_message.then_some(i64::MIN);
        let parser = RequestParser::new(params.request_gap_ns);
        let counts = DeviceCounts::default();
        let line = Line::default();
        Self {
            params,
            feed,
            parser,
            line,
            state,
            switch: None,
            boot_until_ns,
            ask_ns: i64::MIN,
            telegram_index: 0,
            counts,
        }
    }

    /// Writes to the EEPROM so far.
    #[must_use]
    pub fn eeprom_writes(&self) -> u64 {
        self.state.eeprom_writes
    }

    /// The variant in force.
    #[must_use]
    pub fn variant(&self) -> Variant {
        self.state.variant
    }

    /// The configuration in force.
    #[must_use]
    pub fn config(&self) -> &ConfigBlock {
        &self.state.config
    }

    fn answer(&mut self, now_ns: i64, address: u8, body: &[u8]) {
        if address != 0 && address != self.state.address {
            return;
        }
        // A client that repeats its write gets the answer to the first one, and no other.
        if self.line.is_writing() && matches!(body.first(), Some(0x77 | 0x7C)) {
            return;
        }
        self.counts.requests += 1;
        self.interrupt(now_ns);
        let latency = self.params.latency;
        self.line.acknowledge(now_ns + latency.acknowledge_ns, self.state.baud, ACK);
        let feed = &self.feed;
        let Some(answer) = self.state.carry_out(body, &latency, &|variant| feed.holds(variant)) else {
            self.ask_ns = now_ns;
            return;
        };
        self.counts.refused += u64::from(answer.code == 0x92);
        let kind = match answer.then {
            Then::Nothing if matches!(answer.code, 0xF7 | 0xFC) => Kind::ReplyToWrite,
            Then::Nothing => Kind::Reply,
            Then::Baud(baud) => Kind::ReplyThenBaud(baud),
            Then::Reset => Kind::ReplyThenReset,
        };
        let status = self.status(now_ns);
        let bytes = reply(self.state.address, answer.code, &answer.data, status);
        self.line.send(now_ns + answer.after_ns, self.state.baud, kind, bytes, None);
        self.ask_ns = now_ns;
    }

    /// A request interrupts what is being sent; what a cut reply announced happens all the same.
    fn interrupt(&mut self, now_ns: i64) {
        let (bytes, kind) = self.line.interrupt(now_ns);
        match kind {
            Some(Kind::Stream) => self.counts.cut += u64::from(bytes > 0),
            Some(kind) => self.follow(kind, now_ns),
            None => {}
        }
    }

    /// What the end of a transmission sets off.
    fn follow(&mut self, kind: Kind, now_ns: i64) {
        match kind {
            Kind::ReplyThenBaud(baud) => self.switch = Some((now_ns + self.params.baud_switch_ns, baud)),
            Kind::ReplyThenReset => self.start_afresh(now_ns),
            Kind::Stream => self.counts.telegrams += 1,
            Kind::Acknowledge | Kind::Reply | Kind::ReplyToWrite => {}
        }
    }

    fn start_afresh(&mut self, now_ns: i64) {
        self.line.clear(now_ns);
        self.state.power_on();
        self.boot_until_ns = Some(now_ns + self.params.boot_ns);
    }

    fn finish_boot(&mut self, now_ns: i64) {
        self.boot_until_ns = None;
        let status = self.status(now_ns);
        let bytes = reply(self.state.address, 0x90, self.params.type_text.as_bytes(), status);
        self.line.send(now_ns, self.state.baud, Kind::Reply, bytes, None);
    }

    /// Status byte of a reply.
    fn status(&mut self, now_ns: i64) -> u8 {
        self.feed.status(now_ns) | self.state.severity()
    }

    fn wants_scan(&self) -> bool {
        self.state.output != Output::OnRequest && self.line.is_idle() && self.boot_until_ns.is_none()
    }

    /// Puts the next scan on the line when it is free; returns whether it did.
    fn offer_scan(&mut self, now_ns: i64) -> bool {
        if !self.wants_scan() || now_ns < self.ask_ns {
            return false;
        }
        let Some(content) = self.state.output.content() else { return false };
        let scale = Scale { mode: self.state.config.measuring_mode(), mm: self.state.config.is_mm() };
        let wanted = match (content, content.scans()) {
            (Content::Partial, _) => Wanted::Turn,
            (_, 1) => Wanted::Scan,
            (_, count) => Wanted::Mean(count),
        };
        let ask = Ask {
            earliest_ns: self.line.free_ns().max(self.ask_ns).max(now_ns - LATEST_NS),
            wanted,
            mirror: self.params.mirror,
            variant: self.state.variant,
            scale,
        };
        match self.feed.next(&ask) {
            Answer::Scan(offer) => self.send_scan(content, &offer, scale),
            Answer::Later(at_ns) => {
                self.ask_ns = at_ns.max(now_ns + MS);
                return false;
            }
            Answer::Ended => {
                self.ask_ns = now_ns + 20 * MS;
                return false;
            }
        }
        true
    }

    fn send_scan(&mut self, content: Content, offer: &Offer, scale: Scale) {
        let mirror = self.params.mirror;
        self.telegram_index = self.telegram_index.wrapping_add(1);
        let turn = mirror.turn_before(offer.start_ns);
        let scan_index = u8::try_from(turn.rem_euclid(256)).unwrap_or(0);
        let numbers = Numbers {
            address: self.state.address,
            scale,
            indices: self.state.config.sends_indices().then_some((scan_index, self.telegram_index)),
            quarter: mirror.quarter_before(offer.start_ns, self.state.variant.turns()),
            status: offer.status | self.state.severity(),
        };
        let bytes = telegram(content, offer, &numbers);
        let burst = Burst { bytes: self.state.model().bytes_per_turn(), period_ns: mirror.turn_ns };
        self.line.send(offer.start_ns, self.state.baud, Kind::Stream, bytes, Some(burst));
        self.counts.skipped += offer.skipped;
        self.state.output = self.state.output.after_telegram();
    }

    /// Carries out what is due; `true` when something changed and more may be due.
    fn step(&mut self, now_ns: i64, out: &mut Vec<u8>) -> bool {
        if self.boot_until_ns.is_some_and(|until_ns| until_ns <= now_ns) {
            self.finish_boot(now_ns);
            return true;
        }
        if let Some((at_ns, baud)) = self.switch
            && at_ns <= now_ns
        {
            if out.is_empty() {
                self.switch = None;
                self.state.baud = baud;
                self.parser.forget();
                return true;
            }
            return false;
        }
        if let Some(kind) = self.line.take(now_ns, out) {
            self.follow(kind, now_ns);
            return true;
        }
        self.switch.is_none() && self.offer_scan(now_ns)
    }

    fn next_due_ns(&self, now_ns: i64) -> i64 {
        let wants_scan = self.wants_scan() && self.switch.is_none();
        let due = [
            self.line.next_due_ns(),
            self.switch.map(|(at_ns, _)| at_ns),
            self.boot_until_ns,
            wants_scan.then_some(self.ask_ns),
        ];
        let soonest = due.into_iter().flatten().min().unwrap_or(i64::MAX);
        soonest.clamp(now_ns, now_ns + IDLE_NS)
    }
}

impl Device for LmsDevice {
    fn handle(&mut self, now_ns: i64, bytes: &[u8]) {
        self.counts.bytes_received += bytes.len() as u64;
        if self.boot_until_ns.is_some() {
            return;
        }
        for &byte in bytes {
            match self.parser.hear(now_ns, byte) {
                Parsed::Nothing => {}
                Parsed::Request { address, body } => self.answer(now_ns, address, &body),
                Parsed::BadChecksum => {
                    self.counts.bad_checksums += 1;
                    self.interrupt(now_ns);
                    self.line.acknowledge(now_ns + self.params.latency.acknowledge_ns, self.state.baud, NAK);
                }
            }
        }
    }

    fn handle_noise(&mut self, _now_ns: i64, count: usize) {
        self.counts.receive_noise(count);
        self.parser.forget();
    }

    fn poll(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64 {
        let before = out.len();
        while self.step(now_ns, out) {}
        self.counts.bytes_sent += (out.len() - before) as u64;
        self.next_due_ns(now_ns)
    }

    fn power_on(&mut self, now_ns: i64) {
        self.start_afresh(now_ns);
        // The mirror stood still: it has another phase now, and its turns are counted from here.
        self.params.mirror.phase_ns = now_ns;
        self.switch = None;
        self.telegram_index = 0;
        self.parser.forget();
    }

    fn baud(&self) -> u32 {
        self.state.baud
    }

    fn is_streaming(&self) -> bool {
        self.state.output.is_streaming() && self.boot_until_ns.is_none() && !self.line.owes_reply()
    }

    fn counts(&self) -> DeviceCounts {
        DeviceCounts { noise_bytes: self.counts.noise_bytes + self.parser.dropped_bytes, ..self.counts }
    }
}
