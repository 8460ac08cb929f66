//! Two reports of one moment: path length and bearing come in packets of their own. Times are nanoseconds.

use biplane_wire::rflex::{MotionReport, ROTATION, TRANSLATION};

/// Reports of one moment come closer together than this: they come every 100 ms.
const TOGETHER_NS: i64 = 50_000_000;

/// One axis as reported.
#[derive(Copy, Clone, PartialEq, Debug)]
struct Axis {
    position: i32,
    offset: u64,
    length: usize,
    time_ns: i64,
}

/// Both axes of one moment.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(super) struct Pair {
    /// Path length and bearing, counts.
    pub counts: [i32; 2],
    /// Index in the stream of the first packet's first byte.
    pub offset: u64,
    /// Bytes of the first packet.
    pub length: usize,
}

/// Reports that wait for the other axis.
#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Axes {
    waiting: [Option<Axis>; 2],
}

impl Axes {
    /// Takes a report; a pair when the other axis has reported a moment ago. An older report of the same axis is replaced.
    pub(super) fn take(
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
        let now = Axis { position: report.position, offset, length, time_ns: now_ns };
        let other = self.waiting[1 - index].take();
        let Some(first) = other.filter(|other| now_ns - other.time_ns < TOGETHER_NS) else {
            self.waiting[index] = Some(now);
            return None;
        };
        self.waiting[index] = None;
        let mut counts = [now.position; 2];
        counts[1 - index] = first.position;
        Some(Pair { counts, offset: first.offset, length: first.length })
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
