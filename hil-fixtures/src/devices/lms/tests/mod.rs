//! A mock laser in simulated time: a bench that says things to it and notes when which byte left.

mod behavior;
mod cadence;
mod contents;
mod sessions;

use super::{LmsDevice, LmsParams};
use crate::devices::bench;
use crate::devices::bench::{Same, hex};
use crate::devices::lms::scans::feed::{Mirror, MirrorFeed};
use crate::rig::source::{ScanSource, ScanWords};

pub(crate) const MS: i64 = 1_000_000;

/// Walls at three meters all around, in the unit asked for.
struct Round;

impl ScanSource for Round {
    fn scan(&mut self, _t0_ns: i64, fov_deg: u16, resolution_cdeg: u16, mm: bool) -> Option<ScanWords> {
        let beams = usize::from(fov_deg) * 100 / usize::from(resolution_cdeg) + 1;
        (beams <= 401).then(|| std::iter::repeat_n(if mm { 3000 } else { 300 }, beams).collect())
    }

    fn turn(&mut self, _t0_ns: i64, quarter: u8, mm: bool) -> Option<ScanWords> {
        let beams = if quarter == 0 { 181 } else { 180 };
        Some(std::iter::repeat_n(if mm { 3000 } else { 300 }, beams).collect())
    }
}

type Bench = bench::Bench<LmsDevice>;

impl Bench {
    pub(crate) fn new(params: LmsParams) -> Self {
        let feed = MirrorFeed::new(Box::new(Round), Box::new(Same));
        Self::of(LmsDevice::new(params, Box::new(feed)))
    }

    /// Says something now, forgetting what was heard before.
    pub(crate) fn say(&mut self, request: &str) {
        self.send(&hex(request));
    }

    /// What a request is answered with within half a second, ACK included.
    pub(crate) fn ask(&mut self, request: &str) -> Vec<u8> {
        self.say(request);
        self.run_ms(500);
        self.bytes()
    }

    /// Whole telegrams among what was heard: when the first byte had left, and the telegram.
    pub(crate) fn telegrams(&self) -> Vec<(i64, Vec<u8>)> {
        let bytes = self.bytes();
        let mut found = Vec::new();
        let mut at = 0;
        while at + 6 <= bytes.len() {
            let length = usize::from(u16::from_le_bytes([bytes[at + 2], bytes[at + 3]])) + 6;
            let whole = bytes.get(at..at + length).filter(|t| t[0] == 2 && t[1] == 0x80);
            let good = whole.filter(|t| {
                super::frame::checksum(&t[..length - 2]).to_le_bytes() == [t[length - 2], t[length - 1]]
            });
            match good {
                Some(telegram) => {
                    found.push((self.received[at].0, telegram.to_vec()));
                    at += length;
                }
                None => at += 1,
            }
        }
        found
    }

    /// Mirror of the device under test.
    pub(crate) fn mirror() -> Mirror {
        LmsParams::default().mirror
    }
}
