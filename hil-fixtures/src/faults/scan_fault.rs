//! Faults of the measurement: what a laser sees is spoilt before it is sent, and its status byte says so where the protocol has a bit
//! for it (SICK telegram listing, status byte: bit 6 implausible values, bit 7 pollution of the front window).

use crate::lms_device::feed::{Answer, Ask, ScanFeed};
use crate::lms_device::settings::Variant;
use crate::lms_device::words::Scale;

/// A fault of one laser's measurement, asked with times that do not step back.
pub trait ScanFault: Send {
    /// Spoils the value words of the scan whose first beam is at `t0_ns`. Returns the bits to be set in its status byte.
    fn touch(&mut self, t0_ns: i64, scale: Scale, words: &mut [u16]) -> u8;

    /// The bits that replies at this time have set in their status byte.
    fn status_bits(&mut self, now_ns: i64) -> u8;
}

/// A feed whose scans are spoilt.
pub struct SpoiltFeed {
    feed: Box<dyn ScanFeed>,
    faults: Vec<Box<dyn ScanFault>>,
}

impl SpoiltFeed {
    /// All of the faults act on each scan.
    #[must_use]
    pub fn new(feed: Box<dyn ScanFeed>, faults: Vec<Box<dyn ScanFault>>) -> Self {
        Self { feed, faults }
    }
}

impl ScanFeed for SpoiltFeed {
    fn holds(&self, variant: Variant) -> bool {
        self.feed.holds(variant)
    }

    fn next(&mut self, ask: &Ask) -> Answer {
        let mut answer = self.feed.next(ask);
        if let Answer::Scan(offer) = &mut answer {
            let t0_ns = ask.t0_ns(offer.start_ns);
            for fault in &mut self.faults {
                offer.status |= fault.touch(t0_ns, ask.scale, &mut offer.words);
            }
        }
        answer
    }

    fn status(&mut self, now_ns: i64) -> u8 {
        let own = self.feed.status(now_ns);
        self.faults.iter_mut().fold(own, |status, fault| status | fault.status_bits(now_ns))
    }
}
