//! The state of a live run for people (one line) and for machines (one JSON object), once a second.

pub(crate) mod notifier;
pub(crate) mod rates;
pub(crate) mod service;

use std::fmt::Write;
use std::path::{Path, PathBuf};

use biplane_matcher::{Odometry, Outcome};
use serde::Serialize;

use crate::engine::out::health::Health;
use crate::engine::out::health::LineFault;
use crate::engine::out::health::LineHealth;
use crate::types::mount_fault::Mounting;

/// The state of one line.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct LineStatus {
    /// Whether measurements flow.
    pub streaming: bool,
    /// What keeps them from flowing, in two or three words.
    pub fault: Option<&'static str>,
    /// Scans or odometry reports in the last second, a second.
    pub rate_hz: f64,
    /// Scans or odometry reports so far.
    pub measurements: u64,
    /// Telegrams with a wrong checksum so far.
    pub crc_errors: u64,
    /// Telegrams of a wrong length, or cut, so far.
    pub cut_telegrams: u64,
    /// Bytes that belong to no intact telegram, so far.
    pub skipped_bytes: u64,
    /// Times that the session had to start again.
    pub restarts: u64,
    /// From a measurement's stamp to its arrival, the largest in the last second, milliseconds.
    pub latency_ms: f64,
    /// Rate of the line, bits per second.
    pub baud: u32,
    /// Times that its port's buffer was full before this computer read it.
    pub overruns: u64,
    /// Whether a laser sits as the rig says: `not known yet`, `fits`, or what does not fit; nothing for a
    /// base.
    pub mounting: Option<&'static str>,
}

/// The state of the matcher.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct MatcherStatus {
    /// What became of the last scan: `first`, `matched`, `weak`, `lost`, `no_returns`; nothing before the
    /// first.
    pub outcome: Option<&'static str>,
    /// What became of its odometry: `used`, `missing`, `jumped`, `stalled`, `contradicted`,
    /// `reversed`; nothing before the first scan.
    pub odometry: Option<&'static str>,
    /// Its score, 0 to 1.
    pub score: f64,
    /// Poses so far.
    pub poses: u64,
    /// Of these, poses that follow the odometry because the match failed.
    pub unmatched: u64,
    /// From a scan's stamp to its pose, the largest in the last second, milliseconds.
    pub latency_ms: f64,
}

/// The last pose of `base_link` in `map`.
#[derive(Copy, Clone, PartialEq, Debug, Serialize)]
pub(crate) struct PoseStatus {
    /// Meters.
    pub x_m: f64,
    /// Meters.
    pub y_m: f64,
    /// Heading, radians, counter-clockwise from x.
    pub theta_rad: f64,
}

/// The state of a run. Field by field in `docs/recording.md`.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Status {
    /// Always `status`: other objects may come on the same stream.
    pub kind: &'static str,
    /// UTC, nanoseconds.
    pub time_ns: i64,
    /// Since the run's start, seconds.
    pub elapsed_s: f64,
    /// The recording's name as it was asked for.
    pub output: PathBuf,
    /// The laser that localizes.
    pub horizontal: LineStatus,
    /// The laser that sees the building; nothing where the rig has none.
    pub vertical: Option<LineStatus>,
    /// The base.
    pub base: LineStatus,
    /// The inertial unit; nothing where the rig has none on a line.
    pub imu: Option<LineStatus>,
    /// Nothing before the first.
    pub pose: Option<PoseStatus>,
    /// The matcher.
    pub matcher: MatcherStatus,
    /// Messages and reads that a full queue dropped.
    pub dropped: u64,
    /// Stamps that stepped back.
    pub backward_stamps: u64,
    /// Room on the recording's disk, bytes.
    pub disk_free_bytes: Option<u64>,
    /// Files that were removed or moved away while they were written.
    pub files_taken_away: u64,
}

impl Status {
    /// The state at a time, nanoseconds UTC, of a run that began at `start_ns`.
    #[must_use]
    pub(crate) fn new(
        start_ns: i64,
        time_ns: i64,
        health: &Health,
        output: &Path,
        disk_free_bytes: Option<u64>,
        files_taken_away: u64,
    ) -> Self {
        let matcher = &health.matcher;
        let [x_m, y_m, theta_rad] = matcher.last_pose;
        Self {
            kind: "status",
            time_ns,
            elapsed_s: time_ns.saturating_sub(start_ns) as f64 / 1e9,
            output: output.to_owned(),
            horizontal: line(&health.horizontal),
            vertical: health.vertical.present.then(|| line(&health.vertical)),
            base: line(&health.base),
            imu: health.imu.present.then(|| line(&health.imu)),
            pose: (matcher.poses > 0).then_some(PoseStatus { x_m, y_m, theta_rad }),
            matcher: MatcherStatus {
                outcome: matcher.last_outcome.map(outcome),
                odometry: matcher.last_outcome.map(|_| odometry(matcher.last_odometry)),
                score: matcher.last_score,
                poses: matcher.poses,
                unmatched: matcher.unmatched,
                latency_ms: matcher.latency_s * 1e3,
            },
            dropped: health.dropped,
            backward_stamps: health.backward_stamps,
            disk_free_bytes,
            files_taken_away,
        }
    }

    /// One line of at most `columns` letters, the most important first; what does not fit is left out whole.
    #[must_use]
    pub(crate) fn line(&self, columns: usize) -> String {
        let mut words = vec![elapsed(self.elapsed_s), rate("H", &self.horizontal)];
        words.extend(self.vertical.as_ref().map(|vertical| rate("V", vertical)));
        words.push(rate("base", &self.base));
        words.extend(self.imu.as_ref().map(|imu| rate("imu", imu)));
        let lines = [Some(&self.horizontal), self.vertical.as_ref(), Some(&self.base), self.imu.as_ref()];
        // Of a telegram that was cut the checksum is wrong, too.
        let bad: u64 = lines.into_iter().flatten().map(|line| line.crc_errors).sum();
        words.push(format!("bad {bad}"));
        words.push(format!("drops {}", self.dropped));
        words.extend(self.disk_free_bytes.map(disk));
        words.extend(self.pose.map(|pose| {
            let heading_deg = pose.theta_rad.to_degrees();
            let [x, y] = [pose.x_m, pose.y_m].map(|meters| fixed(meters, 2));
            let heading = fixed(heading_deg, 0);
            format!("x {x} y {y} {heading} deg")
        }));
        if let Some(outcome) = self.matcher.outcome {
            words.push(format!("{outcome} {:.2}", self.matcher.score));
        }
        let mut text = String::new();
        for word in words {
            let gap = if text.is_empty() { "" } else { "  " };
            if text.chars().count() + gap.len() + word.chars().count() <= columns {
                let _ = write!(text, "{gap}{word}");
            }
        }
        text
    }
}

fn line(line: &LineHealth) -> LineStatus {
    let counts = line.counts.unwrap_or_default();
    LineStatus {
        streaming: line.streaming,
        fault: match line.fault {
            LineFault::Lasts(words) => Some(words),
            LineFault::Over(_) | LineFault::None => None,
        },
        rate_hz: line.rate_hz,
        measurements: line.measurements,
        crc_errors: counts.bad_checksums,
        cut_telegrams: counts.bad_lengths + counts.abandoned,
        skipped_bytes: counts.skipped_bytes,
        restarts: line.restarts,
        latency_ms: line.latency_s * 1e3,
        baud: line.baud,
        overruns: line.overruns,
        mounting: line.mounting.map(Mounting::words),
    }
}

/// A number with so many decimals; what is rounded to zero has no sign.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|byte| matches!(byte, b'0' | b'.')) => digits.to_owned(),
        _ => text,
    }
}

fn outcome(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::First => "first",
        Outcome::Matched => "matched",
        Outcome::Weak => "weak",
        Outcome::Lost => "lost",
        Outcome::NoReturns => "no_returns",
    }
}

fn odometry(odometry: Odometry) -> &'static str {
    match odometry {
        Odometry::Used => "used",
        Odometry::Missing => "missing",
        Odometry::Jumped => "jumped",
        Odometry::Stalled => "stalled",
        Odometry::Contradicted => "contradicted",
        Odometry::Reversed => "reversed",
    }
}

fn elapsed(seconds: f64) -> String {
    let seconds = seconds.max(0.0) as u64;
    format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

fn rate(name: &str, line: &LineStatus) -> String {
    match line.fault {
        Some(fault) => format!("{name} {}", fault.to_uppercase()),
        None if !line.streaming => format!("{name} starts"),
        None => format!("{name} {:.1} Hz", line.rate_hz),
    }
}

fn disk(bytes: u64) -> String {
    match bytes {
        0..10_000_000_000 => format!("disk {} MB", bytes / 1_000_000),
        _ => format!("disk {} GB", bytes / 1_000_000_000),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_wire::Counts;

    fn status() -> Status {
        let counts =
            Counts { bad_checksums: 2, bad_lengths: 1, abandoned: 3, skipped_bytes: 40, ..Counts::default() };
        let flows = LineHealth {
            present: true,
            streaming: true,
            baud: 38400,
            rate_hz: 9.4,
            measurements: 1234,
            counts: Some(counts),
            latency_s: 0.125,
            ..LineHealth::default()
        };
        let mut health = Health { horizontal: flows, vertical: flows, base: flows, ..Health::default() };
        health.vertical.fault = LineFault::Lasts("silent");
        health.matcher.poses = 5;
        health.matcher.last_pose = [1.5, -2.25, std::f64::consts::FRAC_PI_2];
        health.matcher.last_outcome = Some(Outcome::Matched);
        health.matcher.last_score = 0.875;
        Status::new(0, 3_723_000_000_000, &health, Path::new("run.mcap"), Some(12_345_678_901), 0)
    }

    #[test]
    fn the_line_tells_what_counts_and_keeps_to_its_width() {
        let whole = "1:02:03  H 9.4 Hz  V SILENT  base 9.4 Hz  bad 6  drops 0  disk 12 GB  x 1.50 y -2.25 90 deg  matched 0.88";
        assert_eq!(status().line(200), whole);
        assert_eq!(status().line(40), "1:02:03  H 9.4 Hz  V SILENT  base 9.4 Hz");
        assert_eq!(status().line(39), "1:02:03  H 9.4 Hz  V SILENT  bad 6");
        for columns in 0..whole.len() {
            assert!(status().line(columns).chars().count() <= columns, "{columns}");
        }
    }

    #[test]
    fn what_is_rounded_to_zero_has_no_sign() {
        let mut status = status();
        status.pose = Some(PoseStatus { x_m: -0.004, y_m: -0.0, theta_rad: -0.008 });
        assert!(status.line(200).contains("  x 0.00 y 0.00 0 deg  "), "{}", status.line(200));
        assert_eq!(fixed(-0.006, 2), "-0.01");
    }

    #[test]
    fn machines_get_every_field_under_its_documented_name() {
        let value: serde_json::Value = serde_json::to_value(status()).unwrap();
        assert_eq!(value["kind"], "status");
        assert_eq!(value["elapsed_s"], 3723.0);
        assert_eq!(value["horizontal"]["cut_telegrams"], 4);
        assert_eq!(value["vertical"]["fault"], "silent");
        assert_eq!(value["pose"]["y_m"], -2.25);
        assert_eq!(value["matcher"]["outcome"], "matched");
        let docs = include_str!("../../../../../docs/recording.md");
        let names =
            |value: &serde_json::Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
        let parts = [&value, &value["base"], &value["pose"], &value["matcher"]];
        for name in parts.into_iter().flat_map(names) {
            assert!(docs.contains(&format!("`{name}`")), "docs/recording.md does not tell of {name}");
        }
    }
}
