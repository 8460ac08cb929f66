//! Two reports of one moment: path length and bearing come in packets of their own. Times are nanoseconds,
//! but those in the reports, whose unit no source tells.
//!
//! Reports of one moment carry about the same time of the base's clock: closer together than half of what
//! lies between two reports of one axis, and about as close as those of other moments: a base that is asked
//! anew begins a new rhythm, whose first moment may lie close behind the last one of the old. Where that
//! clock does not run, or the axes' times never agree, those belong together that arrive together.

use biplane_wire::rflex::{MotionReport, ROTATION, TRANSLATION};

/// Reports of one moment arrive closer together than this: they come every 100 ms.
const TOGETHER_NS: i64 = 50_000_000;
/// So many pairs by arrival in a row that the base's clock denies, and it is not believed before it confirms
/// one.
const DENIALS: u8 = 5;

/// One axis as reported.
#[derive(Copy, Clone, PartialEq, Debug)]
struct Axis {
    position: i32,
    offset: u64,
    length: usize,
    time_ns: i64,
    /// The base's own time.
    clock: u32,
}

/// Both axes of one moment.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Pair {
    /// Path length and bearing, counts.
    pub counts: [i32; 2],
    /// Index in the stream of the first packet's first byte.
    pub offset: u64,
    /// Bytes of the first packet.
    pub length: usize,
}

/// Reports that wait for the other axis.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Axes {
    waiting: [Option<Axis>; 2],
    /// The base's time at each axis's last report.
    last_clock: [Option<u32>; 2],
    /// The shortest time between two reports of one axis, in the base's unit; `None` before its clock has
    /// run.
    period: Option<u32>,
    /// The longest time between the reports of one moment so far, in the base's unit.
    spread: Option<u32>,
    denials: u8,
}

impl Axes {
    /// Takes a report; a pair when the other axis has reported the same moment. An older report of the same
    /// axis is replaced.
    pub(crate) fn take(
        &mut self,
        now_ns: i64,
        offset: u64,
        length: usize,
        report: &MotionReport,
    ) -> Option<Pair> {
        let index = match report.axis {
            TRANSLATION => 0,
            ROTATION => 1,
            _ => return None,
        };
        self.learn(index, report.time);
        let now = Axis { position: report.position, offset, length, time_ns: now_ns, clock: report.time };
        let other = self.waiting[1 - index].take();
        let Some(first) = other.filter(|other| self.belong_together(*other, now)) else {
            self.waiting[index] = Some(now);
            return None;
        };
        self.waiting[index] = None;
        let mut counts = [now.position; 2];
        counts[1 - index] = first.position;
        Some(Pair { counts, offset: first.offset, length: first.length })
    }

    /// How far the base's clock runs from report to report.
    fn learn(&mut self, index: usize, clock: u32) {
        if let Some(last) = self.last_clock[index].replace(clock) {
            let ran = clock.wrapping_sub(last);
            // A clock that steps back was set to zero, with the base.
            if (1..=u32::MAX / 2).contains(&ran) {
                self.period = Some(self.period.map_or(ran, |period| period.min(ran)));
            }
        }
    }

    fn belong_together(&mut self, first: Axis, second: Axis) -> bool {
        let arrive_together = second.time_ns - first.time_ns < TOGETHER_NS;
        let Some(period) = self.period else { return arrive_together };
        let apart = second.clock.wrapping_sub(first.clock);
        let apart = apart.min(apart.wrapping_neg());
        let is_near = apart < period.div_ceil(2);
        if is_near && self.spread.is_none_or(|spread| apart <= spread + period / 8) {
            self.spread = self.spread.max(Some(apart));
            self.denials = 0;
            return true;
        }
        self.denials = (self.denials + u8::from(arrive_together)).min(DENIALS);
        let is_overruled = arrive_together && self.denials == DENIALS;
        if is_overruled && is_near {
            self.spread = Some(apart);
        }
        is_overruled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn take(axes: &mut Axes, ms: i64, axis: u8, position: i32) -> Option<[i32; 2]> {
        let report = MotionReport { axis, position, ..MotionReport::default() };
        axes.take(ms * MS, 0, 34, &report).map(|pair| pair.counts)
    }

    #[test]
    fn reports_pair_in_either_order() {
        let mut axes = Axes::default();
        assert_eq!(take(&mut axes, 0, 0, 5), None);
        assert_eq!(take(&mut axes, 3, 1, 7), Some([5, 7]));
        assert_eq!(take(&mut axes, 100, 1, 8), None);
        assert_eq!(take(&mut axes, 103, 0, 6), Some([6, 8]));
    }

    /// What comes of reports: when they arrive (ms), axis, the base's time, position.
    fn pairs(reports: &[(i64, u8, u32, i32)]) -> Vec<[i32; 2]> {
        let mut axes = Axes::default();
        let take = |&(ms, axis, time, position): &(i64, u8, u32, i32)| {
            let report = MotionReport { axis, time, position, ..MotionReport::default() };
            axes.take(ms * MS, 0, 34, &report).map(|pair| pair.counts)
        };
        reports.iter().filter_map(take).collect()
    }

    #[test]
    fn reports_that_an_adapter_held_back_pair_by_the_bases_own_time_whatever_its_unit() {
        for unit in [1, 100, 100_000] {
            let start =
                [(0, 0, 7 * unit, 1), (3, 1, 7 * unit, 2), (100, 0, 8 * unit, 3), (103, 1, 8 * unit, 4)];
            // The bearing at 9 and the path length at 10 were lost; then all comes at once.
            let late = [
                (500, 0, 9 * unit, 5),
                (500, 1, 10 * unit, 8),
                (500, 0, 11 * unit, 9),
                (500, 1, 11 * unit, 10),
            ];
            assert_eq!(pairs(&[start, late].concat()), [[1, 2], [3, 4], [9, 10]], "{unit}");
        }
        // The clock wraps; half of a pair arrives 80 ms late.
        let top = u32::MAX - 10;
        let wrapping = [
            (0, 0, top, 1),
            (3, 1, top, 2),
            (100, 0, top.wrapping_add(100), 3),
            (180, 1, top.wrapping_add(101), 4),
        ];
        assert_eq!(pairs(&wrapping), [[1, 2], [3, 4]]);
    }

    #[test]
    fn a_base_that_is_asked_anew_does_not_pair_half_a_moment_of_before_with_half_of_the_next() {
        let steady = [(0, 0, 700, 1), (3, 1, 700, 2), (100, 0, 800, 3), (103, 1, 800, 4)];
        // The path length at 900 was lost; the new rhythm begins 30 later.
        let anew = [(203, 1, 900, 6), (230, 0, 930, 7), (233, 1, 930, 8)];
        assert_eq!(pairs(&[&steady[..], &anew].concat()), [[1, 2], [3, 4], [7, 8]]);
    }

    #[test]
    fn a_clock_that_stands_or_differs_between_the_axes_is_not_asked() {
        let standing: Vec<_> =
            (0..20).map(|k| (k / 2 * 100 + k % 2 * 3, (k % 2) as u8, 0, k as i32)).collect();
        assert_eq!(pairs(&standing).len(), 10);
        let apart: Vec<_> = (0..20)
            .map(|k| (k / 2 * 100 + k % 2 * 3, (k % 2) as u8, (k / 2 * 100 + k % 2 * 5000) as u32, 0))
            .collect();
        assert_eq!(pairs(&apart).len(), 1 + 9 - 4);
    }

    #[test]
    fn a_base_that_starts_again_pairs_on() {
        let clock = [900, 1000, 1100, 5, 105];
        let reports: Vec<_> =
            (0..10).map(|k| (k / 2 * 100 + k % 2 * 3, (k % 2) as u8, clock[k as usize / 2], 0)).collect();
        assert_eq!(pairs(&reports).len(), 5);
    }

    #[test]
    fn a_lost_report_makes_no_pair_of_two_moments() {
        let mut axes = Axes::default();
        // The bearing at 3 ms is lost, then the path length at 200 ms.
        assert_eq!(take(&mut axes, 0, 0, 5), None);
        assert_eq!(take(&mut axes, 100, 0, 6), None);
        assert_eq!(take(&mut axes, 103, 1, 8), Some([6, 8]));
        assert_eq!(take(&mut axes, 203, 1, 9), None);
        assert_eq!(take(&mut axes, 300, 0, 8), None);
        assert_eq!(take(&mut axes, 303, 1, 10), Some([8, 10]));
        assert_eq!(take(&mut axes, 304, 2, 99), None);
    }
}
