//! Scans that wait for what comes a moment later: horizontal ones for the odometry of their stamp, vertical
//! ones for the matched pose on their other side. Both queues are bounded; who waits too long, or in a full
//! queue, goes on with what is known.

use crate::engine::localize::interpolated_poses::PoseTrack;
use crate::engine::localize::odometry_history::OdometryBuffer;
use crate::engine::scan_data::ScanData;

/// Horizontal scans that may wait: at the highest rate, 75 Hz, for 0.4 s.
const HORIZONTAL_CAPACITY: usize = 32;
/// Vertical scans that may wait; only their stamps are kept.
const VERTICAL_CAPACITY: usize = 512;
/// A scan that came over a line does not wait for odometry: its pose is wanted now. The base's motion is led
/// on from its last two reports, over a tenth of a second or so; what that is off by, the match sets right.
pub(crate) const WAIT_OF_LINES_NS: i64 = 0;
/// A scan of another recording waits for odometry this long at most, nanoseconds: two reports of a base.
/// Nobody waits for it, and who wrote the file may have written odometry later than the scans that it belongs
/// to.
pub(crate) const WAIT_OF_RECORDINGS_NS: i64 = 300_000_000;
/// Odometry that has not come for so long is not waited for, nanoseconds.
const ODOMETRY_GONE_NS: i64 = 10_000_000_000;
/// A vertical scan waits for a matched pose this long at most, nanoseconds: two scans at 9600 Bd.
const POSE_WAIT_NS: i64 = 2_000_000_000;

/// Horizontal scans waiting for odometry, in order of arrival; with each, until when.
#[derive(Debug)]
pub(crate) struct WaitingScans {
    queue: Box<heapless::Deque<(i64, ScanData), HORIZONTAL_CAPACITY>>,
}

impl Default for WaitingScans {
    fn default() -> Self {
        Self { queue: Box::new(heapless::Deque::new()) }
    }
}

impl WaitingScans {
    /// Adds a scan that waits until `due_ns` at most; the oldest comes back when the queue is full.
    pub(crate) fn push(&mut self, due_ns: i64, scan: ScanData) -> Option<ScanData> {
        let oldest = if self.queue.is_full() { self.queue.pop_front() } else { None };
        // There is room now.
        let _ = self.queue.push_back((due_ns, scan));
        oldest.map(|(_, scan)| scan)
    }

    /// The next scan that need not wait any longer. `odometry_ns` is when odometry came last.
    pub(crate) fn pop(
        &mut self,
        now_ns: i64,
        odometry: &OdometryBuffer,
        odometry_ns: Option<i64>,
    ) -> Option<ScanData> {
        let (due_ns, scan) = self.queue.front()?;
        let is_flowing = odometry_ns.is_some_and(|at_ns| now_ns - at_ns < ODOMETRY_GONE_NS);
        if !is_flowing || now_ns >= *due_ns || odometry.covers(scan.stamp_ns) {
            return self.queue.pop_front().map(|(_, scan)| scan);
        }
        None
    }

    /// The next scan, whatever it waits for.
    pub(crate) fn pop_any(&mut self) -> Option<ScanData> {
        self.queue.pop_front().map(|(_, scan)| scan)
    }

    /// When the oldest has waited long enough.
    #[must_use]
    pub(crate) fn deadline_ns(&self) -> i64 {
        self.queue.front().map_or(i64::MAX, |(due_ns, _)| *due_ns)
    }

    /// Scans that wait.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.queue.len()
    }
}

/// Stamps of vertical scans waiting for a pose, in order of arrival.
#[derive(Debug, Default)]
pub(crate) struct WaitingStamps {
    queue: Box<heapless::Deque<(i64, i64), VERTICAL_CAPACITY>>,
}

impl WaitingStamps {
    /// Adds the stamp of a scan that came now; the oldest stamp comes back when the queue is full.
    pub(crate) fn push(&mut self, now_ns: i64, stamp_ns: i64) -> Option<i64> {
        let oldest = if self.queue.is_full() { self.queue.pop_front() } else { None };
        let _ = self.queue.push_back((now_ns, stamp_ns));
        oldest.map(|(_, stamp_ns)| stamp_ns)
    }

    /// The next stamp that has its pose, or has waited long enough.
    pub(crate) fn pop(&mut self, now_ns: i64, poses: &PoseTrack) -> Option<i64> {
        let &(arrived_ns, stamp_ns) = self.queue.front()?;
        let is_due = now_ns - arrived_ns >= POSE_WAIT_NS;
        (is_due || poses.reaches(stamp_ns)).then(|| self.queue.pop_front().map(|_| stamp_ns)).flatten()
    }

    /// The next stamp, whatever it waits for.
    pub(crate) fn pop_any(&mut self) -> Option<i64> {
        self.queue.pop_front().map(|(_, stamp_ns)| stamp_ns)
    }

    /// When the oldest has waited long enough.
    #[must_use]
    pub(crate) fn deadline_ns(&self) -> i64 {
        self.queue.front().map_or(i64::MAX, |(arrived_ns, _)| arrived_ns.saturating_add(POSE_WAIT_NS))
    }

    /// Stamps that wait.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.queue.len()
    }
}
