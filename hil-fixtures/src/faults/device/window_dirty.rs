//! A dirty front window: for a while, until somebody wipes it, some beams are thrown back by the dirt or
//! weakened by it.
//!
//! The beams behind a spot of dirt give a range of a few centimeters, "signal too small" (8187, 16379, 32763)
//! or the range as it was; the status byte tells of the pollution (bit 7). Source: SICK telegram listing
//! 8007954, status byte and overflow codes.

use super::scan_fault::ScanFault;
use crate::devices::lms::scans::value_words::{LOW_SIGNAL, Scale, code};
use crate::faults::episodes::{Episode, EpisodeParams, Episodes};
use crate::rng::Rng;

/// Front window pollution.
const POLLUTION: u8 = 0x80;

/// How dirty it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowDirtyParams {
    /// When it is dirty.
    pub dirt: EpisodeParams,
    /// Spots of dirt.
    pub spots: usize,
    /// Widest spot as a share of the scan.
    pub widest_share: f64,
    /// Share of the beams behind dirt that give a range of a few centimeters.
    pub short_share: f64,
    /// Share of them that give no range; the rest is measured as if nothing were there.
    pub weak_share: f64,
    /// Longest of the short ranges, meters.
    pub longest_short_m: f64,
}

impl Default for WindowDirtyParams {
    fn default() -> Self {
        let dirt =
            EpisodeParams { shortest_pause_s: 2.0, mean_pause_s: 4.0, shortest_s: 3.0, longest_s: 12.0 };
        Self { dirt, spots: 3, widest_share: 0.06, short_share: 0.3, weak_share: 0.4, longest_short_m: 0.15 }
    }
}

/// The fault.
#[derive(Debug)]
pub struct WindowDirty {
    params: WindowDirtyParams,
    rng: Rng,
    episodes: Episodes,
    /// The episode whose spots are drawn.
    drawn: Option<Episode>,
    /// From and to as shares of a scan.
    spots: Vec<(f64, f64)>,
}

impl WindowDirty {
    /// A window with its own stream of random numbers.
    #[must_use]
    pub fn new(params: WindowDirtyParams, mut rng: Rng) -> Self {
        let episodes = Episodes::by_chance(params.dirt, rng.branch());
        Self { params, rng, episodes, drawn: None, spots: Vec::new() }
    }

    fn soil(&mut self, episode: Episode) {
        if self.drawn == Some(episode) {
            return;
        }
        self.drawn = Some(episode);
        self.spots.clear();
        for _ in 0..self.params.spots {
            let share = self.rng.between(0.1 * self.params.widest_share, self.params.widest_share);
            let from = self.rng.between(0.0, 1.0 - share);
            self.spots.push((from, from + share));
        }
    }

    fn behind_dirt(&mut self, word: u16, scale: Scale) -> u16 {
        let params = self.params;
        let fate = self.rng.unit();
        if fate < params.short_share {
            let unit_m = if scale.mm { 0.001 } else { 0.01 };
            (self.rng.between(unit_m, params.longest_short_m) / unit_m).max(1.0) as u16
        } else if fate < params.short_share + params.weak_share {
            code(scale.mode, LOW_SIGNAL)
        } else {
            word
        }
    }
}

impl ScanFault for WindowDirty {
    fn touch(&mut self, t0_ns: i64, scale: Scale, words: &mut [u16]) -> u8 {
        let Some(episode) = self.episodes.at(t0_ns) else { return 0 };
        self.soil(episode);
        let beams = words.len() as f64;
        for (from, to) in self.spots.clone() {
            for word in &mut words[(from * beams) as usize..(to * beams) as usize] {
                *word = self.behind_dirt(*word, scale);
            }
        }
        POLLUTION
    }

    fn status_bits(&mut self, now_ns: i64) -> u8 {
        let dirty = self.episodes.at(now_ns).is_some();
        if dirty { POLLUTION } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_beams_are_short_some_invalid_and_the_status_tells_of_the_dirt() {
        let mut window = WindowDirty::new(WindowDirtyParams::default(), Rng::new(2, 0, 0));
        let (mut short, mut weak, mut kept) = (0, 0, 0);
        for scan in 0..20_000_i64 {
            let mut words = [3000; 361];
            let status = window.touch(scan * 13_320_000, Scale { mode: 6, mm: true }, &mut words);
            assert_eq!(status, window.status_bits(scan * 13_320_000));
            for word in words {
                match word {
                    3000 => kept += 1,
                    32763 => weak += 1,
                    1..=150 => short += 1,
                    other => panic!("{other}"),
                }
            }
            assert!(status == 0x80 || words == [3000; 361], "{scan}");
        }
        let spoiled = f64::from(short + weak) / f64::from(short + weak + kept);
        assert!((0.02..0.08).contains(&spoiled), "{spoiled}");
        assert!((f64::from(short) / f64::from(weak) - 0.75).abs() < 0.03, "{short} {weak}");
    }
}
