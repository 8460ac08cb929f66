//! The mean of several scans, beam by beam.
//!
//! The mean is that of the ranges; flags are cleared (SICK telegram listing, B6). What a laser does with
//! beams that had a range in some of the scans only is not told there: here half of them are enough, and with
//! fewer the last code stands.

use crate::devices::lms::scans::value_words::{CODES, range_mask};
use crate::rig::source::ScanWords;

/// Scans summed up so far.
#[derive(Clone, Debug, Default)]
pub struct Mean {
    /// Of each beam: sum of the ranges, how many, last code.
    beams: Vec<(u32, u32, u16)>,
    scans: u32,
}

impl Mean {
    /// How many scans.
    #[must_use]
    pub fn scans(&self) -> u32 {
        self.scans
    }

    /// Takes a scan in this measuring mode.
    pub fn add(&mut self, words: &ScanWords, mode: u8) {
        let top = range_mask(mode);
        self.beams.resize(words.len(), (0, 0, top));
        for (beam, word) in self.beams.iter_mut().zip(words) {
            let range = word & top;
            if top - range <= CODES {
                beam.2 = range;
            } else {
                beam.0 += u32::from(range);
                beam.1 += 1;
            }
        }
        self.scans += 1;
    }

    /// The mean, rounded to the nearest unit.
    #[must_use]
    pub fn words(&self) -> ScanWords {
        let mean = |&(sum, ranges, code): &(u32, u32, u16)| {
            let enough = ranges > 0 && 2 * ranges >= self.scans;
            if enough { u16::try_from((sum + ranges / 2) / ranges).unwrap_or(code) } else { code }
        };
        self.beams.iter().map(mean).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_averaged_and_codes_left_out_until_they_are_more() {
        let scan = |words: [u16; 4]| ScanWords::from_slice(&words).expect("fits");
        let mut mean = Mean::default();
        mean.add(&scan([100, 200, 8191, 0x2000 | 10]), 0);
        mean.add(&scan([101, 8191, 8183, 0x2000 | 20]), 0);
        mean.add(&scan([103, 8191, 300, 0x4000 | 31]), 0);
        assert_eq!(mean.words()[..], [101, 8191, 8183, 20]);
        assert_eq!(mean.scans(), 3);
    }
}
