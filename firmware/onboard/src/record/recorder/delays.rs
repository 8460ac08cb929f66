//! How long a pose takes into the file: measured by the thread that writes it, by the run's own clock.
//!
//! Two ways: from the last byte that the pose needed, of its scan or of the odometry that covers the scan's
//! stamp, and from the scan's own last byte, which also holds the wait for that odometry (a base reports
//! every 100 ms or so). Times in milliseconds.

use biplane_recording::Topic;
use biplane_recording::messages::{DiagnosticStatus, KeyValue};

use crate::output::message_ring::Head;
use crate::types::pose_delays::DelaySpread;
use crate::types::pose_delays::PoseDelays;

/// A step of the histogram, nanoseconds.
const STEP_NS: i64 = 50_000;
/// Steps; longer delays count in the last one.
const STEPS: usize = 8000;
/// Scans that may wait for their pose.
const WAITING: usize = 64;

/// Counts delays by their length.
#[derive(Clone, Debug)]
struct Histogram {
    counts: Vec<u64>,
    all: u64,
    max_ns: i64,
}

impl Histogram {
    fn new() -> Self {
        Self { counts: vec![0; STEPS], all: 0, max_ns: 0 }
    }

    fn add(&mut self, delay_ns: i64) {
        let step = usize::try_from(delay_ns / STEP_NS).unwrap_or(0).min(STEPS - 1);
        self.counts[step] += 1;
        self.all += 1;
        self.max_ns = self.max_ns.max(delay_ns);
    }

    fn spread(&self) -> DelaySpread {
        let ms = |ns: i64| ns as f64 * 1e-6;
        let at = |share: f64| {
            let rank = (share * self.all as f64).ceil() as u64;
            let mut so_far = 0;
            let step = self.counts.iter().position(|count| {
                so_far += count;
                so_far >= rank
            });
            // The last step has no upper end but the longest.
            let end_ns = step.filter(|&step| step + 1 < STEPS).map(|step| (step as i64 + 1) * STEP_NS);
            ms(end_ns.map_or(self.max_ns, |end_ns| end_ns.min(self.max_ns)))
        };
        DelaySpread { p50: at(0.5), p99: at(0.99), p99_9: at(0.999), max: ms(self.max_ns) }
    }
}

/// Watches the messages that are written.
#[derive(Clone, Debug)]
pub(crate) struct Delays {
    from_last_byte: Histogram,
    from_scan: Histogram,
    /// Stamp and arrival of the latest horizontal scans.
    scans: [(i64, i64); WAITING],
    next: usize,
}

impl Default for Delays {
    /// Nothing written yet; with all the memory it will ever have.
    fn default() -> Self {
        let (from_last_byte, from_scan) = (Histogram::new(), Histogram::new());
        Self { from_last_byte, from_scan, scans: [(i64::MIN, 0); WAITING], next: 0 }
    }
}

impl Delays {
    /// A message has been written now.
    pub(crate) fn written(&mut self, now_ns: i64, head: &Head) {
        match head.topic {
            Topic::ScanHorizontal => {
                self.scans[self.next] = (head.publish_time_ns, head.log_time_ns);
                self.next = (self.next + 1) % WAITING;
            }
            Topic::Pose => {
                self.from_last_byte.add(now_ns.saturating_sub(head.log_time_ns));
                if let Some((_, arrived_ns)) =
                    self.scans.iter().find(|(stamp_ns, _)| *stamp_ns == head.publish_time_ns)
                {
                    self.from_scan.add(now_ns.saturating_sub(*arrived_ns));
                }
            }
            _ => {}
        }
    }

    /// So far, as a status of `/diagnostics`.
    pub(crate) fn status(&self) -> DiagnosticStatus {
        let PoseDelays { from_last_byte_ms, from_scan_ms, .. } = self.report();
        let values = [("from_last_byte", from_last_byte_ms), ("from_scan", from_scan_ms)];
        let value = |key: String, ms: f64| KeyValue { key, value: format!("{ms:.2}") };
        DiagnosticStatus {
            level: DiagnosticStatus::OK,
            name: "biplane: delays".to_owned(),
            message: "from bytes to poses in the file".to_owned(),
            hardware_id: "delays".to_owned(),
            values: values
                .into_iter()
                .flat_map(|(name, spread)| {
                    [("p50", spread.p50), ("p99_9", spread.p99_9), ("max", spread.max)]
                        .map(|(quantile, ms)| value(format!("{name}_{quantile}_ms"), ms))
                })
                .collect(),
        }
    }

    /// So far.
    pub(crate) fn report(&self) -> PoseDelays {
        PoseDelays {
            poses: self.from_last_byte.all,
            from_last_byte_ms: self.from_last_byte.spread(),
            from_scan_ms: self.from_scan.spread(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    #[test]
    fn a_pose_is_timed_from_the_byte_that_released_it_and_from_its_scan() {
        let mut delays = Delays::default();
        for i in 0..1000 {
            let at_ns = i * 13 * MS;
            let scan = Head { topic: Topic::ScanHorizontal, log_time_ns: at_ns, publish_time_ns: at_ns - 7 };
            delays.written(at_ns + MS, &scan);
            // The odometry that covers it comes 40 ms later; it is written 2 ms after that, once 30 ms.
            let late_ns = if i == 500 { 30 * MS } else { 2 * MS };
            let pose = Head { topic: Topic::Pose, log_time_ns: at_ns + 40 * MS, ..scan };
            delays.written(at_ns + 40 * MS + late_ns, &pose);
        }
        let report = delays.report();
        assert_eq!(report.poses, 1000);
        let DelaySpread { p50, p99, p99_9, max } = report.from_last_byte_ms;
        assert!([p50, p99, p99_9].iter().all(|ms| (2.0..=2.051).contains(ms)), "{report:?}");
        assert_eq!(max, 30.0);
        assert!((42.0..=42.051).contains(&report.from_scan_ms.p99) && report.from_scan_ms.max == 70.0);
        let docs = include_str!("../../../../../docs/recording.md");
        for value in delays.status().values {
            assert!(docs.contains(&format!("`{}`", value.key)), "docs/recording.md: {}", value.key);
        }
    }

    #[test]
    fn nothing_written_has_no_delay() {
        assert_eq!(Delays::default().report(), PoseDelays::default());
    }
}
