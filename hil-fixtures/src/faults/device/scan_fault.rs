//! Faults of the measurement: what a laser sees is spoiled before it is sent, and its status byte says so
//! where the protocol has a bit for it (SICK telegram listing, status byte: bit 6 implausible values, bit 7
//! pollution of the front window).

use crate::devices::lms::scans::feed::{Answer, Ask, ScanFeed};
use crate::devices::lms::scans::value_words::Scale;
use crate::devices::lms::settings::Variant;

/// A fault of one laser's measurement, asked with times that do not step back.
pub trait ScanFault: Send {
    /// Spoils the value words of the scan whose first beam is at `t0_ns`. Returns the bits to be set in its
    /// status byte.
    fn touch(&mut self, t0_ns: i64, scale: Scale, words: &mut [u16]) -> u8;

    /// The bits that replies at this time have set in their status byte.
    fn status_bits(&mut self, now_ns: i64) -> u8;
}

/// A feed whose scans are spoiled.
pub struct SpoiledFeed {
    feed: Box<dyn ScanFeed>,
    faults: Vec<Box<dyn ScanFault>>,
}

impl SpoiledFeed {
    /// All of the faults act on each scan.
    #[must_use]
    pub fn new(feed: Box<dyn ScanFeed>, faults: Vec<Box<dyn ScanFault>>) -> Self {
        Self { feed, faults }
    }
}

impl ScanFeed for SpoiledFeed {
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

#[cfg(test)]
mod tests {
    use crate::devices::device::Device;
    use crate::devices::lms::scans::feed::{MirrorFeed, Timeline};
    use crate::devices::lms::{LmsDevice, LmsParams};
    use crate::faults::{Faults, Preset};
    use crate::rig::source::{ScanSource, ScanWords};

    struct World;

    impl ScanSource for World {
        fn scan(&mut self, _: i64, _: u16, _: u16, _: bool) -> Option<ScanWords> {
            Some(std::iter::repeat_n(300, 361).collect())
        }
    }

    impl Timeline for World {
        fn world_ns(&self, device_ns: i64) -> i64 {
            device_ns
        }
    }

    /// A streaming laser that is asked for its faults each half second; all it says in a minute.
    fn minute(faults: &Faults) -> Vec<u8> {
        let feed = faults.feed(Box::new(MirrorFeed::new(Box::new(World), Box::new(World))), 0);
        let params = LmsParams { baud: 500_000, left_streaming: true, ..LmsParams::default() };
        let mut laser = LmsDevice::new(params, feed);
        let mut out = Vec::new();
        for ms in 0..60_000_i64 {
            if ms % 500 == 0 {
                laser.handle(ms * 1_000_000, &[0x02, 0x00, 0x01, 0x00, 0x32, 0x16, 0x12]);
            }
            laser.poll(ms * 1_000_000, &mut out);
        }
        out
    }

    #[test]
    fn scans_and_replies_of_a_device_tell_of_dirt_and_dazzle_and_repeat_with_the_seed() {
        let faults = Faults::new(&[Preset::WindowDirty, Preset::Dazzle], 3);
        let reported = minute(&faults);
        let ends = |marks: &[u8]| reported.windows(marks.len()).filter(|window| *window == marks).count();
        // The head of a reply to 32h with its status byte: undisturbed, dirty, dazzled, both.
        for status in [0x10, 0x90, 0x50, 0xD0] {
            let replies = ends(&[0x02, 0x80, 0x02, 0x00, 0xB2, status]);
            assert!(replies > 0, "{status:02x}");
        }
        assert!(ends(&(0x8000_u16 | 8190).to_le_bytes()) > 1000);
        assert_eq!(reported, minute(&faults));
        assert_ne!(reported, minute(&Faults { seed: 4, ..faults }));
    }
}
