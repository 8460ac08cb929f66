//! A mock SICK laser on a network (LMS1xx, LMS5xx, TiM) without any input or output: it answers in either
//! dialect and streams scans with counters and times of its own, on a clock that is an argument.
//!
//! Sources: SICK telegram listing 8014631, captures of an LMS111, an LMS511 and a TiM871S. What a second
//! client meets is known of no device: here it is refused while there is a first.

pub mod model;
mod requests;
mod scans;
mod stream;
pub mod telegram;

use biplane_wire::Item;
use biplane_wire::cola::{Deframer, Dialect, Kind, Telegram};

use crate::devices::device::{Device, DeviceCounts};
use crate::rig::fan::FanSource;
pub use model::ColaParams;
pub use requests::Settings;
use stream::MeasuredScans;
pub use stream::{ColaScans, Telegrams};

/// How often a device that has nothing to do wants to be asked.
const IDLE_NS: i64 = 1_000_000_000;

/// A mock laser.
pub struct ColaDevice {
    params: ColaParams,
    scans: Box<dyn ColaScans>,
    deframer: Box<Deframer>,
    settings: Settings,
    /// Answers and when they leave.
    answers: Vec<(i64, Vec<u8>)>,
    /// Scans are sent, in this dialect.
    subscribed: Option<Dialect>,
    /// A client waits for the next scan alone, in this dialect.
    asked: Option<Dialect>,
    /// From then on it answers.
    awake_ns: i64,
    counts: DeviceCounts,
}

impl ColaDevice {
    /// A laser that measures what `source` gives.
    #[must_use]
    pub fn new(params: ColaParams, source: FanSource) -> Self {
        let scans = MeasuredScans::new(&params, source);
        Self::of_scans(params, Box::new(scans))
    }

    /// A laser that sends these scans.
    #[must_use]
    pub fn of_scans(params: ColaParams, scans: Box<dyn ColaScans>) -> Self {
        Self {
            settings: Settings::of(&params, scans.are_recorded()),
            params,
            scans,
            deframer: Box::new(Deframer::new()),
            answers: Vec::new(),
            subscribed: None,
            asked: None,
            awake_ns: i64::MIN,
            counts: DeviceCounts::default(),
        }
    }

    /// Writes to its memory so far.
    #[must_use]
    pub fn saves(&self) -> u64 {
        self.settings.saves
    }

    /// Another client sets what telegrams hold.
    pub fn set_by_another_client(&mut self, data: biplane_wire::cola::ScanDataConfig) {
        self.settings.data = data;
    }

    fn answer(&mut self, now_ns: i64, telegram: &Telegram<'_>) {
        if self.params.dialect.is_some_and(|dialect| dialect != telegram.dialect) {
            self.counts.noise_bytes += telegram.encoded_len() as u64;
            return;
        }
        self.counts.requests += 1;
        let answered = self.settings.answer(&self.params, telegram);
        self.counts.refused += u64::from(answered.is_refused);
        if answered.wants_scan {
            if self.subscribed.is_none() && self.asked.is_none() {
                self.scans.begin_at(now_ns + self.params.latency_ns);
            }
            self.asked = Some(telegram.dialect);
            return;
        }
        if let Some(is_on) = answered.subscribes {
            self.subscribed = is_on.then_some(telegram.dialect);
            self.scans.begin_at(now_ns + self.params.latency_ns);
        }
        if answered.restarts_mirror {
            self.scans.set(&self.params, &self.settings.scan, now_ns);
        }
        self.answers.push((now_ns + self.params.latency_ns, answered.bytes));
    }
}

impl ColaDevice {
    /// Sends a scan to whom it is due.
    fn send_scan(&mut self, now_ns: i64, out: &mut Vec<u8>) -> bool {
        let wanted = [(Kind::ReadAnswer, self.asked), (Kind::Event, self.subscribed)];
        let forms = wanted.into_iter().filter_map(|(kind, dialect)| Some((kind, dialect?)));
        let forms: Vec<(Kind, Dialect)> = forms.collect();
        if forms.is_empty() {
            return false;
        }
        let telegrams = Telegrams { params: &self.params, settings: &self.settings, forms: &forms };
        let is_sent = self.scans.send(now_ns, &telegrams, out);
        if is_sent {
            self.counts.telegrams += forms.len() as u64;
            self.asked = None;
        }
        is_sent
    }
}

impl Device for ColaDevice {
    fn handle(&mut self, now_ns: i64, bytes: &[u8]) {
        self.counts.bytes_received += bytes.len() as u64;
        let mut requests = Vec::new();
        self.deframer.feed(bytes, |item| {
            if let Item::Frame { bytes, .. } = item {
                requests.push(bytes.to_vec());
            }
        });
        if now_ns < self.awake_ns {
            return;
        }
        for request in requests {
            if let Ok(telegram) = Telegram::parse(&request) {
                self.answer(now_ns, &telegram);
            }
        }
    }

    fn handle_noise(&mut self, _: i64, count: usize) {
        self.counts.receive_noise(count);
    }

    fn poll(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64 {
        let sent = out.len();
        self.answers.retain(|(at_ns, bytes)| {
            let waits = *at_ns > now_ns;
            if !waits {
                out.extend_from_slice(bytes);
            }
            waits
        });
        while self.send_scan(now_ns, out) {}
        self.counts.bytes_sent += (out.len() - sent) as u64;
        let answer_ns = self.answers.iter().map(|(at_ns, _)| *at_ns).min();
        let scan_ns = self.subscribed.or(self.asked).map(|_| self.scans.next_ns(now_ns));
        [answer_ns, scan_ns].into_iter().flatten().min().unwrap_or(now_ns + IDLE_NS)
    }

    fn power_on(&mut self, now_ns: i64) {
        self.settings = Settings::of(&self.params, self.scans.are_recorded());
        self.answers.clear();
        (self.subscribed, self.asked) = (None, None);
        self.awake_ns = now_ns + self.params.boot_ns;
        self.scans.power_on(now_ns);
    }

    fn connected(&mut self, _: i64) {
        *self.deframer = Deframer::new();
        self.answers.clear();
        (self.subscribed, self.asked) = (None, None);
    }

    fn disconnected(&mut self, now_ns: i64) {
        self.connected(now_ns);
    }

    fn baud(&self) -> u32 {
        0
    }

    fn is_streaming(&self) -> bool {
        self.subscribed.is_some()
    }

    fn counts(&self) -> DeviceCounts {
        self.counts
    }
}
