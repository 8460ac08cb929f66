//! Which scan of a capture leaves when: each at its time since the capture's start. Where the capture pauses,
//! the scan before is sent again, and behind the end the last one goes on: a laser never falls silent.

use crate::capture::source::laser_feed::HOLD_NS;
use crate::devices::run::Run;

/// A filling scan leaves the line free this long before the next recorded one.
const CLEAR_NS: i64 = 250_000_000;
/// No laser sends scans closer to each other.
const MIN_STEP_NS: i64 = 1_000_000;

/// A scan that leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Played {
    /// When.
    pub at_ns: i64,
    /// Its place in the capture.
    pub index: usize,
    /// So much later than it was recorded.
    pub later_ns: i64,
    /// Scans that were sent again before, and this one if it is one of them.
    pub repeats: u16,
}

/// The scans of a capture on their way to a client.
#[derive(Clone, Debug)]
pub(super) struct Playback {
    /// Times since the run's start.
    scans: Vec<Played>,
    /// From a scan to the next, to go on with the last one.
    usual_ns: i64,
    run: Run,
    once: bool,
}

impl Playback {
    /// Scans at these times since the capture's start; with `once` there is nothing behind the last one.
    pub(super) fn new(times_ns: &[i64], run: Run, once: bool) -> Self {
        let mut steps_ns: Vec<i64> = times_ns.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps_ns.sort_unstable();
        let usual_ns = steps_ns.get(steps_ns.len() / 2).copied().unwrap_or(HOLD_NS).max(MIN_STEP_NS);
        let hold_ns = HOLD_NS.max(2 * usual_ns);
        let mut scans: Vec<Played> = Vec::with_capacity(times_ns.len());
        let mut repeats = 0;
        for (index, &time_ns) in times_ns.iter().enumerate() {
            if let Some(before_ns) = index.checked_sub(1).and_then(|before| times_ns.get(before)) {
                let mut at_ns = before_ns + hold_ns;
                while at_ns + CLEAR_NS <= time_ns {
                    repeats += 1;
                    scans.push(Played { at_ns, index: index - 1, later_ns: at_ns - before_ns, repeats });
                    at_ns += hold_ns;
                }
            }
            scans.push(Played { at_ns: time_ns, index, later_ns: 0, repeats });
        }
        Self { scans, usual_ns, run, once }
    }

    /// The scan of a place; `None` before the run has begun, and behind the end.
    pub(super) fn scan(&self, place: usize) -> Option<Played> {
        let start_ns = self.run.begun()?.start_ns;
        let played = match self.scans.get(place) {
            Some(played) => *played,
            None if self.once => return None,
            None => {
                let last = self.scans.last()?;
                let again = place + 1 - self.scans.len();
                let later_ns = again as i64 * self.usual_ns;
                Played {
                    at_ns: last.at_ns + later_ns,
                    later_ns: last.later_ns + later_ns,
                    repeats: last.repeats.wrapping_add(again as u16),
                    ..*last
                }
            }
        };
        Some(Played { at_ns: start_ns + played.at_ns, ..played })
    }

    /// The first place whose scan leaves at this time or later.
    pub(super) fn place_from(&self, at_ns: i64) -> usize {
        let Some(begun) = self.run.begun() else { return 0 };
        let since_ns = at_ns - begun.start_ns;
        let behind_ns = self.scans.last().map_or(0, |last| since_ns - last.at_ns);
        if behind_ns > 0 {
            return self.scans.len() - 1 + ((behind_ns - 1) / self.usual_ns + 1) as usize;
        }
        self.scans.partition_point(|played| played.at_ns < since_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::run::RunRules;

    const MS: i64 = 1_000_000;

    fn playback(times_ms: &[i64], once: bool) -> Playback {
        let rules =
            RunRules { lasers: 1, others: 0, pause_ns: 0, patience_ns: None, start_at_ns: Some(7 * MS) };
        let times_ns: Vec<i64> = times_ms.iter().map(|time_ms| time_ms * MS).collect();
        Playback::new(&times_ns, Run::new(rules), once)
    }

    fn played(playback: &Playback, count: usize) -> Vec<(i64, usize, i64, u16)> {
        let scans = (0..count).filter_map(|place| playback.scan(place));
        scans.map(|s| (s.at_ns / MS - 7, s.index, s.later_ns / MS, s.repeats)).collect()
    }

    #[test]
    fn every_scan_leaves_at_its_time_and_pauses_are_filled() {
        let playback = playback(&[0, 20, 40, 60, 1_400, 1_420], true);
        let expected = [
            (0, 0, 0, 0),
            (20, 1, 0, 0),
            (40, 2, 0, 0),
            (60, 3, 0, 0),
            (560, 3, 500, 1),
            (1_060, 3, 1_000, 2),
            (1_400, 4, 0, 2),
            (1_420, 5, 0, 2),
        ];
        assert_eq!(played(&playback, 100), expected);
    }

    #[test]
    fn behind_the_end_the_last_scan_goes_on_and_a_late_client_begins_there() {
        let playback = playback(&[0, 20, 40], false);
        let expected = [(0, 0, 0, 0), (20, 1, 0, 0), (40, 2, 0, 0), (60, 2, 20, 1), (80, 2, 40, 2)];
        assert_eq!(played(&playback, 5), expected);
        for (at_ms, place) in [(-5, 0), (0, 0), (1, 1), (40, 2), (41, 3), (60, 3), (61, 4), (100, 5)] {
            assert_eq!(playback.place_from((at_ms + 7) * MS), place, "{at_ms} ms");
        }
    }
}
