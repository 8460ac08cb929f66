//! What the index bytes of scan telegrams tell: telegrams that were sent but did not arrive, and scans that
//! the device measured but did not send because its line was busy.
//!
//! The telegram index grows by one a telegram, the scan index by one a turn of the mirror, both modulo 256.
//! At a fast line 256 turns are 3.4 s, so that the time between two telegrams tells how often the indices
//! went round. Source: SICK telegram listing, real-time indices.

use biplane_wire::lms::MIRROR_TURN_NS;

use crate::session::lms::scan::ranges::ScanIndex;

/// Counts what is missing.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct IndexWatch {
    last: Option<Seen>,
    /// Mirror turns from one telegram to the next, as two neighbors showed it last.
    turns_per_telegram: Option<u32>,
    /// Telegrams sent that did not arrive whole.
    pub lost_telegrams: u64,
    /// Scans measured that the device left out: on a slow line it sends every Nth.
    pub left_out_scans: u64,
}

#[derive(Copy, Clone, PartialEq, Eq, Debug)]
struct Seen {
    index: ScanIndex,
    at_ns: i64,
}

impl IndexWatch {
    /// The device starts anew; what it counts from here on has nothing to do with before.
    pub(crate) fn restart(&mut self) {
        self.last = None;
        self.turns_per_telegram = None;
    }

    /// A telegram of a scan of `turns` mirror turns has come.
    pub(crate) fn see(&mut self, now_ns: i64, index: ScanIndex, turns: u8) {
        let seen = Seen { index, at_ns: now_ns };
        if let Some(last) = self.last.replace(seen) {
            let turned = turned(&last, &seen);
            let telegrams = self.telegrams(&last, &seen, turned);
            self.lost_telegrams += telegrams.saturating_sub(1);
            let scans = turned / u64::from(turns.max(1));
            self.left_out_scans += scans.saturating_sub(telegrams);
            if telegrams == 1 {
                self.turns_per_telegram = u32::try_from(turned).ok().filter(|&turns| turns > 0);
            }
        }
    }

    /// Telegrams from one to the other: by their index, and by the turns where that may have gone round.
    fn telegrams(&self, last: &Seen, seen: &Seen, turned: u64) -> u64 {
        let step = u64::from(seen.index.telegram.wrapping_sub(last.index.telegram));
        let expected = self.turns_per_telegram.map_or(0, |turns| turned / u64::from(turns));
        unwrapped(step, expected).max(1)
    }
}

/// Mirror turns from one telegram to the other: by their index, and by the time where that may have gone
/// round.
fn turned(last: &Seen, seen: &Seen) -> u64 {
    let step = u64::from(seen.index.scan.wrapping_sub(last.index.scan));
    let elapsed_ns = seen.at_ns.saturating_sub(last.at_ns).max(0);
    unwrapped(step, (elapsed_ns / MIRROR_TURN_NS).unsigned_abs())
}

/// The number nearest to `expected` that is `step` modulo 256.
fn unwrapped(step: u64, expected: u64) -> u64 {
    step + expected.saturating_sub(step).saturating_add(128) / 256 * 256
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Telegrams by their true numbers: mirror turn and telegram since the start; the time is that of the
    /// turn, late by `late_ms`.
    fn watch(turns: u8, telegrams: &[(u64, u64, i64)]) -> (u64, u64) {
        let mut watch = IndexWatch::default();
        for &(turn, telegram, late_ms) in telegrams {
            let now_ns = turn as i64 * MIRROR_TURN_NS + late_ms * 1_000_000;
            let index = ScanIndex { scan: turn as u8, telegram: telegram as u8 };
            watch.see(now_ns, index, turns);
        }
        (watch.lost_telegrams, watch.left_out_scans)
    }

    #[test]
    fn every_scan_of_a_fast_line_in_a_row_is_no_loss_however_late_it_comes() {
        let all: Vec<_> = (0..2000).map(|i| (2 * i, i, [0, 7, 300, 0][i as usize % 4])).collect();
        assert_eq!(watch(2, &all), (0, 0));
    }

    #[test]
    fn a_slow_line_s_cadence_is_counted_as_scans_left_out_not_as_loss() {
        // Every 8th scan of two turns: seven are left out from one telegram to the next.
        let all: Vec<_> = (0..11).map(|i| (16 * i, i, 0)).collect();
        assert_eq!(watch(2, &all), (0, 70));
    }

    #[test]
    fn missing_telegrams_are_counted_however_many_they_are() {
        for missing in [1, 2, 100, 255, 256, 257, 300, 1000] {
            let after = 10 + missing;
            let telegrams = [(8, 8, 0), (9, 9, 0), (after, after, 5), (after + 1, after + 1, 0)];
            assert_eq!(watch(1, &telegrams), (missing, 0), "{missing}");
            let slow = [(0, 0, 0), (16, 1, 0), (16 * (2 + missing), 2 + missing, 30)];
            assert_eq!(watch(2, &slow), (missing, 7 * (2 + missing)), "{missing}");
        }
    }

    #[test]
    fn a_device_that_starts_anew_has_lost_nothing() {
        let mut watch = IndexWatch::default();
        watch.see(0, ScanIndex { scan: 5, telegram: 5 }, 1);
        watch.restart();
        watch.see(10_000_000_000, ScanIndex { scan: 90, telegram: 1 }, 1);
        assert_eq!((watch.lost_telegrams, watch.left_out_scans), (0, 0));
    }
}
