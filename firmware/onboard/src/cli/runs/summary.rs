//! The account of a run in words or as JSON.

use crate::types::run_report::{OdometryReport, RunEnd, RunReport};
use biplane_cli::counted;
use biplane_matcher::Estimate;

/// JSON on stdout, or a few lines on stderr.
pub(crate) fn print(report: &RunReport, json: bool) {
    if json {
        match serde_json::to_string_pretty(report) {
            Ok(text) => crate::cli::print_result(&(text + "\n")),
            Err(error) => {
                crate::cli::say(&format!("biplane-onboard: the report cannot be written as JSON: {error}"));
            }
        }
    } else {
        crate::cli::say(&text(report));
    }
}

/// JSON in one line on stdout, after the states that came there: `kind` tells it from them.
pub(crate) fn print_line(report: &RunReport) {
    #[derive(serde::Serialize)]
    struct Line<'a> {
        kind: &'static str,
        #[serde(flatten)]
        report: &'a RunReport,
    }
    if let Ok(text) = serde_json::to_string(&Line { kind: "report", report }) {
        crate::cli::print_result(&(text + "\n"));
    }
}

/// What a run counts that is not as it should be: how many, of what, and what became of them.
fn remarks(report: &RunReport) -> [(u64, &'static str, &'static str); 16] {
    [
        (report.arrival.damaged, "telegram", "arrived damaged or cut"),
        (
            report.arrival.rejected,
            "telegram",
            "of these had a good checksum, but not the form of the device's telegrams",
        ),
        (report.arrival.lost_telegrams, "laser telegram", "did not arrive whole, by their index bytes"),
        (report.arrival.lost_samples, "sample", "of the inertial unit did not arrive whole, by their count"),
        (report.arrival.dazzled_values, "value", "missing because a laser was dazzled"),
        (report.arrival.polluted_scans, "scan", "taken through a polluted window"),
        (report.arrival.skipped_bytes, "byte", "outside of any telegram"),
        (report.arrival.cut_by_us, "telegram", "cut by our own start or stop: no damage"),
        (report.arrival.backward_stamps, "step", "back in the stamps"),
        (
            report.arrival.clock_steps,
            "step",
            "back of the clock that wrote the input: the run's time goes on from there",
        ),
        (
            report.map.map_forgotten_tiles,
            "tile",
            "of the map forgotten because its memory was full: --map-memory gives it more",
        ),
        (report.losses.not_understood, "intact telegram", "not understood: NOT KEPT"),
        (
            report.losses.reads_without_laser,
            "read",
            "of a vertical laser, but the rig has no section [vertical]: NOT KEPT",
        ),
        (
            report.losses.reads_without_imu,
            "read",
            "of an inertial unit, but the rig has none on a line in [imu]: NOT KEPT",
        ),
        (
            report.losses.scans_without_laser,
            "vertical scan",
            "without a section [vertical] in the rig: LEFT OUT",
        ),
        (report.losses.dropped, "message", "dropped by a full queue: NOT KEPT"),
    ]
}

/// What scans showed of odometry that counts clearly too much or too little: a line each.
fn odometry_scales(odometry: &OdometryReport) -> String {
    let scales = [
        ("a meter", odometry.odometry_way_scale, 1.0, "m"),
        ("90 degrees", odometry.odometry_turn_scale, 90.0, "degrees"),
    ];
    let wrong = scales.into_iter().filter_map(|(counted, scale, unit, name)| {
        let [value, sigma] = scale?;
        let (is, sigma_is) = (unit * value, unit * sigma);
        let line = format!(
            "\n  odometry: {counted} of it is {is:.3} {name} (standard deviation {sigma_is:.3}), by the scans"
        );
        Estimate { value, sigma }.is_wrong_scale().then_some(line)
    });
    wrong.collect()
}

fn text(report: &RunReport) -> String {
    let output = match &report.parts[..] {
        [first, .., last] => format!("{} to {}", first.display(), last.display()),
        _ => report.output.display().to_string(),
    };
    let mut text = format!(
        "{output}: {:.1} s, {} ({} posed, {} not matched), {} ({} posed), {}",
        report.duration_s,
        counted(report.recorded.scans_horizontal, "horizontal scan"),
        report.recorded.poses,
        report.recorded.unmatched,
        counted(report.recorded.scans_vertical, "vertical scan"),
        report.recorded.poses_vertical,
        counted(report.recorded.odometry, "odometry report"),
    );
    if report.recorded.inertial > 0 {
        text += &format!(", {}", counted(report.recorded.inertial, "inertial sample"));
    }
    for (count, noun, what) in remarks(report).into_iter().filter(|(count, ..)| *count > 0) {
        text += &format!("\n  {} {what}", counted(count, noun));
    }
    if report.map.map_filled_percent >= 90 && report.map.map_forgotten_tiles == 0 {
        let percent = report.map.map_filled_percent;
        text += &format!("\n  {percent} % of the map's memory are in use: --map-memory gives it more");
    }
    text += &odometry_scales(&report.odometry);
    let lasers = [
        ("horizontal laser", report.mounting.odd_interval_ms_horizontal),
        ("vertical laser", report.mounting.odd_interval_ms_vertical),
    ];
    for (name, interval_ms) in lasers.into_iter().filter_map(|(name, ms)| Some((name, ms?))) {
        text += &format!(
            "\n  {name}: scans came every {interval_ms:.2} ms, its mirror does not turn at 75 Hz: stamps may err by a few milliseconds"
        );
    }
    for uncovered in &report.uncovered {
        text += &format!("\n  {}", uncovered.words());
    }
    match report.end {
        RunEnd::DiskLow => {
            let free_mb = report.free_bytes_at_end.unwrap_or(0) / 1_000_000;
            text += &format!("\n  ended because only {free_mb} MB were left on the disk: CUT SHORT");
        }
        RunEnd::Interrupted => text += "\n  stopped before the input was over: the rest was NOT KEPT",
        RunEnd::Stopped if report.recorded.scans_horizontal == 0 => {
            text += "\n  stopped before the first horizontal scan: the file is kept, and holds no pose";
        }
        RunEnd::InputOver | RunEnd::DurationOver | RunEnd::Stopped | RunEnd::WriteFailed => {}
    }
    text
}
