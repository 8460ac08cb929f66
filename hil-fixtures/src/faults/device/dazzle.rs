//! Dazzle: for seconds at a time sunlight falls into the laser, and a run of neighboring beams measures
//! nothing.
//!
//! A dazzled value is the code 8190 (16382, 32766 in the wider modes), in measuring mode 00 with its dazzle
//! bit 15; the status byte tells of implausible values (bit 6). Source: SICK telegram listing, measured
//! values and status byte. What a laser without availability level 3 does beyond that is not told there: it
//! goes on here.

use super::scan_fault::ScanFault;
use crate::devices::lms::scans::value_words::{DAZZLED, Scale, code};
use crate::faults::episodes::{Episode, EpisodeParams, Episodes};
use crate::rng::Rng;

/// Implausible measured values.
const IMPLAUSIBLE: u8 = 0x40;

/// How bright it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DazzleParams {
    /// When the sun shines in.
    pub sun: EpisodeParams,
    /// Smallest share of a scan's beams that is dazzled.
    pub smallest_share: f64,
    /// Largest share; at 1 a scan may hold no range at all.
    pub largest_share: f64,
    /// Share of the beams in the run that are dazzled in a scan. Smaller flickers more.
    pub density: f64,
}

impl Default for DazzleParams {
    fn default() -> Self {
        let sun = EpisodeParams { shortest_pause_s: 1.0, mean_pause_s: 5.0, shortest_s: 0.5, longest_s: 4.0 };
        Self { sun, smallest_share: 0.03, largest_share: 0.3, density: 0.9 }
    }
}

/// The fault.
#[derive(Debug)]
pub struct Dazzle {
    params: DazzleParams,
    rng: Rng,
    episodes: Episodes,
    /// The episode whose run is drawn, and the run: from and to as shares of a scan.
    run: Option<(Episode, f64, f64)>,
}

impl Dazzle {
    /// A sun with its own stream of random numbers.
    #[must_use]
    pub fn new(params: DazzleParams, mut rng: Rng) -> Self {
        let episodes = Episodes::by_chance(params.sun, rng.branch());
        Self { params, rng, episodes, run: None }
    }

    /// The run of an episode: drawn once.
    fn run_of(&mut self, episode: Episode) -> (f64, f64) {
        match self.run {
            Some((drawn, from, to)) if drawn == episode => (from, to),
            _ => {
                let share = self.rng.between(self.params.smallest_share, self.params.largest_share);
                let from = self.rng.between(0.0, 1.0 - share);
                self.run = Some((episode, from, from + share));
                (from, from + share)
            }
        }
    }
}

impl ScanFault for Dazzle {
    fn touch(&mut self, t0_ns: i64, scale: Scale, words: &mut [u16]) -> u8 {
        let Some(episode) = self.episodes.at(t0_ns) else { return 0 };
        let (from, to) = self.run_of(episode);
        let beams = words.len() as f64;
        for word in &mut words[(from * beams) as usize..(to * beams) as usize] {
            if self.rng.unit() < self.params.density {
                *word = code(scale.mode, DAZZLED);
            }
        }
        IMPLAUSIBLE
    }

    fn status_bits(&mut self, now_ns: i64) -> u8 {
        let shines = self.episodes.at(now_ns).is_some();
        if shines { IMPLAUSIBLE } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_neighbors_is_dazzled_for_seconds_and_the_status_says_so() {
        let mut sun = Dazzle::new(DazzleParams::default(), Rng::new(4, 0, 0));
        let (mut scans, mut time_ranges, mut before) = (0, 0, false);
        for scan in 0..20_000_i64 {
            let mut words = [300; 181];
            let status = sun.touch(scan * 13_320_000, Scale { mode: 0, mm: false }, &mut words);
            let at: Vec<usize> = (0..181).filter(|&beam| words[beam] != 300).collect();
            assert_eq!(status, if at.is_empty() { 0 } else { 0x40 }, "scan {scan}");
            assert!(at.iter().all(|&beam| words[beam] == 0x8000 | 8190));
            if let (Some(first), Some(last)) = (at.first(), at.last()) {
                assert!(last - first < 55 && 4 * at.len() > last - first, "{first} {last} {}", at.len());
            }
            scans += u32::from(!at.is_empty());
            time_ranges += u32::from(!before && !at.is_empty());
            before = !at.is_empty();
        }
        // 266 s: pauses of 6 s and episodes of 2.25 s on average, 32 of them.
        assert!((20..45).contains(&time_ranges), "{time_ranges}");
        assert!((90..250).contains(&(scans / time_ranges)), "{scans} in {time_ranges}");
    }
}
