//! A laser's session and a mock laser on one line, in simulated time: what it takes to come up, and what
//! comes.
//!
//! Bytes take ten bit times each; where both ends run at different rates, each hears noise. A read returns
//! what has come in a millisecond.

use biplane_mock::devices::device::Device;
use biplane_mock::devices::lms::scans::feed::{MirrorFeed, Timeline};
use biplane_mock::devices::lms::{LmsDevice, LmsParams};
use biplane_mock::line::garble;
use biplane_mock::line::transfer_ns;
use biplane_mock::rig::source::{ScanSource, ScanWords};
use biplane_mock::rng::Rng;

use crate::session::device_session::{Input, MAX_INPUT_BYTES, Output, Session};
use crate::session::event::Event;
use crate::session::lms::LaserSession;
use crate::session::lms::scan::ranges::ScanReading;
use crate::session::lms::setup::settings::LaserSettings;

pub(crate) const MS: i64 = 1_000_000;

/// A step at every beam: 3.00 m and so many centimeters (or millimeters) as the beam has.
struct Steps;

impl ScanSource for Steps {
    fn scan(&mut self, _t0_ns: i64, fov_deg: u16, resolution_cdeg: u16, mm: bool) -> Option<ScanWords> {
        let beams = usize::from(fov_deg) * 100 / usize::from(resolution_cdeg) + 1;
        let from = if mm { 3000 } else { 300 };
        (beams <= 401).then(|| (0..beams).map(|beam| from + beam as u16).collect())
    }
}

struct Same;

impl Timeline for Same {
    fn world_ns(&self, device_ns: i64) -> i64 {
        device_ns
    }
}

/// Both ends of a line.
pub(crate) struct Bench {
    pub device: LmsDevice,
    pub session: LaserSession,
    pub now_ns: i64,
    pub scans: Vec<ScanReading>,
    /// What was said, and when in milliseconds.
    pub reported: Vec<(i64, String)>,
    /// Nothing passes, in either direction.
    pub is_unplugged: bool,
    /// The device has no power.
    pub is_dark: bool,
    port_baud: u32,
    /// Bytes on their way to the device: when the last of them arrives, what, at which rate.
    outbound: Vec<(i64, Vec<u8>, u32)>,
    wait_ns: i64,
    rng: Rng,
}

impl Bench {
    pub(crate) fn new(params: LmsParams, settings: LaserSettings) -> Self {
        let feed = MirrorFeed::new(Box::new(Steps), Box::new(Same));
        let mut bench = Self {
            device: LmsDevice::new(params, Box::new(feed)),
            session: LaserSession::streaming(settings, 0),
            now_ns: 0,
            scans: Vec::new(),
            reported: Vec::new(),
            is_unplugged: false,
            is_dark: false,
            port_baud: 9600,
            outbound: Vec::new(),
            wait_ns: 0,
            rng: Rng::new(1, 2, 3),
        };
        bench.drain();
        bench
    }

    fn drain(&mut self) {
        loop {
            match self.session.poll() {
                Output::Write(bytes) => {
                    let arrives_ns = self.now_ns + transfer_ns(bytes.len(), self.port_baud);
                    self.outbound.push((arrives_ns, bytes.to_vec(), self.port_baud));
                }
                Output::SetBaud(baud) => self.port_baud = baud,
                Output::Scan(scan) => self.scans.push(scan),
                Output::Odometry(_) | Output::Inertial(_) | Output::TimedScan | Output::Reconnect => {
                    panic!("an LMS has none")
                }
                Output::Event(event) => self.note(&event),
                Output::WaitUntil(wait_ns) => {
                    self.wait_ns = wait_ns;
                    return;
                }
            }
        }
    }

    fn note(&mut self, event: &Event) {
        self.reported.push((self.now_ns / MS, event.to_string()));
    }

    fn deliver(&mut self) {
        for (arrives_ns, bytes, baud) in std::mem::take(&mut self.outbound) {
            if arrives_ns > self.now_ns {
                self.outbound.push((arrives_ns, bytes, baud));
            } else if self.is_dark || self.is_unplugged {
            } else if baud == self.device.baud() {
                self.device.handle(self.now_ns, &bytes);
            } else {
                self.device.handle_noise(self.now_ns, bytes.len());
            }
        }
    }

    fn hear(&mut self) {
        if self.is_dark {
            return;
        }
        let (baud, mut bytes) = (self.device.baud(), Vec::new());
        self.device.poll(self.now_ns, &mut bytes);
        if baud != self.port_baud {
            bytes = garble(&bytes, baud, self.port_baud, &mut self.rng);
        }
        if self.is_unplugged {
            return;
        }
        for chunk in bytes.chunks(MAX_INPUT_BYTES) {
            self.session.handle(self.now_ns, Input::Bytes(chunk));
            self.drain();
        }
    }

    /// Lets time pass, a millisecond at a time, until this holds or so many milliseconds are over; says
    /// whether it did.
    pub(crate) fn run_until(&mut self, limit_ms: i64, done: impl Fn(&Self) -> bool) -> bool {
        let end_ns = self.now_ns + limit_ms * MS;
        while self.now_ns < end_ns && !done(self) {
            self.now_ns += MS;
            self.deliver();
            self.hear();
            if self.wait_ns <= self.now_ns {
                self.session.handle(self.now_ns, Input::Time);
                self.drain();
            }
        }
        done(self)
    }

    pub(crate) fn run(&mut self, for_ms: i64) {
        self.run_until(for_ms, |_| false);
    }

    /// Milliseconds until the first scan; panics when it takes longer than the limit.
    pub(crate) fn first_scan_ms(&mut self, limit_ms: i64) -> i64 {
        let (from_ns, before) = (self.now_ns, self.scans.len());
        assert!(self.run_until(limit_ms, |bench| bench.scans.len() > before), "{:#?}", self.reported);
        (self.now_ns - from_ns) / MS
    }

    pub(crate) fn stop(&mut self) {
        self.session.handle(self.now_ns, Input::Stop);
        self.drain();
        assert!(self.run_until(2000, |bench| bench.session.is_done()), "{:#?}", self.reported);
    }

    /// How often something was said.
    pub(crate) fn times_reported(&self, words: &str) -> usize {
        self.reported.iter().filter(|(_, reported)| reported.contains(words)).count()
    }
}
