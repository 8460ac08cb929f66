//! What a run has recorded, and what it has not.

use std::path::PathBuf;

use biplane_matcher::{Estimate, OdometryScale};
use biplane_recording::PartsReport;
use serde::Serialize;

use crate::types::live_report::LiveReport;
use crate::types::pose_delays::PoseDelays;
use crate::types::uncovered::Uncovered;

/// Why a run ended.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RunEnd {
    /// The input was over.
    #[default]
    InputOver,
    /// The time asked for was over.
    DurationOver,
    /// A live run was told to stop.
    Stopped,
    /// A replay was told to stop before its input was over: the rest of it is not in the output.
    Interrupted,
    /// The disk was nearly full.
    DiskLow,
    /// The file could not be written any more.
    WriteFailed,
}

/// What is in the recording.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct RecordedCounts {
    /// Scans of the laser that localizes.
    pub scans_horizontal: u64,
    /// Scans of the laser that sees the building.
    pub scans_vertical: u64,
    /// Odometry reports.
    pub odometry: u64,
    /// Samples of an inertial unit.
    pub inertial: u64,
    /// Matched poses, one a horizontal scan.
    pub poses: u64,
    /// Poses of vertical scans.
    pub poses_vertical: u64,
    /// Scans whose match failed, so that their pose follows the odometry.
    pub unmatched: u64,
}

/// What arrived damaged, cut or late, and what devices did not send. None of it is a loss.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct ArrivalCounts {
    /// Telegrams that arrived damaged: checksum or length wrong, cut, or of a form that the device does not
    /// send.
    pub damaged: u64,
    /// Of these, telegrams of lasers and of an inertial unit with a good checksum.
    pub rejected: u64,
    /// Laser telegrams that were sent and did not arrive whole, by their index bytes; damaged ones are among
    /// them.
    pub lost_telegrams: u64,
    /// Samples of an inertial unit that were sent and did not arrive whole, by their count; damaged ones are
    /// among them.
    pub lost_samples: u64,
    /// Scans that lasers measured and did not send because the line was busy, by their index bytes: no loss
    /// on the way.
    pub left_out_scans: u64,
    /// Values that lasers could not measure because they were dazzled.
    pub dazzled_values: u64,
    /// Scans taken through a polluted window.
    pub polluted_scans: u64,
    /// Bytes that belong to no intact telegram.
    pub skipped_bytes: u64,
    /// Telegrams that were cut because a laser was stopped, at the start or at the end: not damaged, and not
    /// among those.
    pub cut_by_us: u64,
    /// The bytes of these, not among the skipped ones.
    pub cut_by_us_bytes: u64,
    /// Scans whose stamp is earlier than that of the one before.
    pub backward_stamps: u64,
    /// Times that the clock went back with which the input was recorded: from there on, times are later than
    /// its `log_time`.
    pub clock_steps: u64,
}

/// What arrived intact and was not kept, and why.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct LossCounts {
    /// Intact telegrams and messages that were not kept, for whatever reason: see the fields below and the
    /// warnings.
    pub lost: u64,
    /// Of these, intact telegrams that are no scan of the laser, no report of the base or no whole
    /// measurement of the inertial unit.
    pub not_understood: u64,
    /// Of these, reads of the vertical laser's line where the rig has no such laser.
    pub reads_without_laser: u64,
    /// Of these, reads of an inertial unit's line where the rig has no such unit on a line.
    pub reads_without_imu: u64,
    /// Of these, decoded vertical scans where the rig has no vertical laser: nobody could say where they were
    /// taken from.
    pub scans_without_laser: u64,
    /// Of these, what a full queue dropped.
    pub dropped: u64,
    /// What the log and the status were not told, because whoever reads them did not keep up: no loss of the
    /// recording.
    #[serde(rename = "untold")]
    pub unreported: u64,
}

/// How the lasers sit and turn, as far as their scans told.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct MountingReport {
    /// Whether the horizontal laser sits as the rig says, as far as its scans told: `not known yet`, `fits`,
    /// or what does not fit.
    pub mounting_horizontal: &'static str,
    /// The same of the vertical one; nothing where the rig has none.
    pub mounting_vertical: Option<&'static str>,
    /// At which distance the horizontal laser's scans came, where that is no whole number of turns of a
    /// mirror at 75 Hz, milliseconds.
    pub odd_interval_ms_horizontal: Option<f64>,
    /// The same of the vertical one.
    pub odd_interval_ms_vertical: Option<f64>,
}

/// How full the map was at the end.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct MapReport {
    /// The share of the map's memory that was in use at the end, percent.
    pub map_filled_percent: u32,
    /// Tiles that the map forgot because its memory was full.
    pub map_forgotten_tiles: u64,
}

/// What scans showed of the odometry, as far as they told.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct OdometryReport {
    /// True way over counted way, and its standard deviation.
    pub odometry_way_scale: Option<[f64; 2]>,
    /// True turn over counted turn, and its standard deviation.
    pub odometry_turn_scale: Option<[f64; 2]>,
    /// What the base truly turned beside that for each meter counted, radians, and its standard deviation.
    pub odometry_drift_rad_per_m: Option<[f64; 2]>,
}

impl OdometryReport {
    /// Of what the matcher has learned.
    pub(crate) fn new(scale: &OdometryScale) -> Self {
        let pair = |estimate: Option<Estimate>| estimate.map(|Estimate { value, sigma }| [value, sigma]);
        Self {
            odometry_way_scale: pair(scale.way),
            odometry_turn_scale: pair(scale.turn),
            odometry_drift_rad_per_m: pair(scale.drift_rad_per_m),
        }
    }
}

/// The account of one `record` or `replay`. Written as JSON it is one flat object.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct RunReport {
    /// The recording; its first file when it is in parts.
    pub output: PathBuf,
    /// All its files, in order.
    pub parts: Vec<PathBuf>,
    /// Why it ended.
    pub end: RunEnd,
    /// What was left on the disk, bytes, where that ended it.
    pub free_bytes_at_end: Option<u64>,
    /// From its first to its last input, seconds (simulated time in a replay).
    pub duration_s: f64,
    /// Devices that measured nothing in the first or last seconds of the run, when others did.
    pub uncovered: Vec<Uncovered>,
    /// What is in the recording.
    #[serde(flatten)]
    pub recorded: RecordedCounts,
    /// What arrived damaged, cut or late, and what devices did not send. None of it is a loss.
    #[serde(flatten)]
    pub arrival: ArrivalCounts,
    /// What arrived intact and was not kept, and why.
    #[serde(flatten)]
    pub losses: LossCounts,
    /// How the lasers sit and turn, as far as their scans told.
    #[serde(flatten)]
    pub mounting: MountingReport,
    /// How full the map was at the end.
    #[serde(flatten)]
    pub map: MapReport,
    /// What scans showed of the odometry, as far as they told.
    #[serde(flatten)]
    pub odometry: OdometryReport,
    /// What a live view has done, where there was one.
    pub live: Option<LiveReport>,
    /// How long poses took into the file; nothing in a replay.
    pub pose_delays: Option<PoseDelays>,
}

impl RunReport {
    /// The report with the files that were written. What was in a file that somebody removed is lost.
    #[must_use]
    pub fn with_files(mut self, written: &PartsReport) -> Self {
        self.parts = written.parts.iter().map(|part| part.path.clone()).collect();
        self.output = self.parts.first().cloned().unwrap_or_default();
        self.losses.lost += written.removed_messages;
        self
    }

    /// The process's exit code: 0, or 3 when something intact was not kept, or was not recorded as long as it
    /// was asked for.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        let cut_short = matches!(self.end, RunEnd::Interrupted | RunEnd::DiskLow);
        if self.losses.lost > 0 || cut_short { 3 } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_loss_of_something_intact_makes_the_exit_code_3() {
        let arrival = ArrivalCounts {
            damaged: 5,
            skipped_bytes: 9,
            backward_stamps: 3,
            clock_steps: 1,
            ..ArrivalCounts::default()
        };
        let harmless = RunReport { arrival, ..RunReport::default() };
        assert_eq!(harmless.exit_code(), 0);
        let losses = LossCounts { lost: 1, ..LossCounts::default() };
        assert_eq!(RunReport { losses, ..harmless.clone() }.exit_code(), 3);
        let ends =
            [RunEnd::InputOver, RunEnd::DurationOver, RunEnd::Stopped, RunEnd::Interrupted, RunEnd::DiskLow];
        let codes = ends.map(|end| RunReport { end, ..harmless.clone() }.exit_code());
        assert_eq!(codes, [0, 0, 0, 3, 3]);
    }

    #[test]
    fn as_json_it_is_one_flat_object() {
        let mut report = RunReport::default();
        report.recorded.poses = 7;
        report.losses.unreported = 2;
        let json = serde_json::to_value(&report).unwrap();
        assert_eq!(
            (&json["poses"], &json["untold"], &json["map_filled_percent"]),
            (&7.into(), &2.into(), &0.into())
        );
        assert!(json.as_object().unwrap().values().all(|value| !value.is_object()), "{json}");
    }
}
