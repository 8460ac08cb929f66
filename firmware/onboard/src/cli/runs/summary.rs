//! The account of a run in words or as JSON.

use crate::types::run_report::{RunEnd, RunReport};

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

fn text(report: &RunReport) -> String {
    let output = match &report.parts[..] {
        [first, .., last] => format!("{} to {}", first.display(), last.display()),
        _ => report.output.display().to_string(),
    };
    let mut text = format!(
        "{output}: {:.1} s, {} horizontal scans ({} posed, {} not matched), {} vertical scans ({} posed), {} odometry reports",
        report.duration_s,
        report.recorded.scans_horizontal,
        report.recorded.poses,
        report.recorded.unmatched,
        report.recorded.scans_vertical,
        report.recorded.poses_vertical,
        report.recorded.odometry,
    );
    let remarks = [
        (report.arrival.damaged, "telegrams arrived damaged or cut"),
        (report.arrival.rejected, "of them had a good checksum, but not the form of the device's telegrams"),
        (report.arrival.lost_telegrams, "laser telegrams did not arrive whole, by their index bytes"),
        (report.arrival.dazzled_values, "values are missing because a laser was dazzled"),
        (report.arrival.polluted_scans, "scans were taken through a polluted window"),
        (report.arrival.skipped_bytes, "bytes belong to no telegram"),
        (report.arrival.cut_by_us, "telegrams were cut by our own start or stop: no damage"),
        (report.arrival.backward_stamps, "stamps step back"),
        (
            report.arrival.clock_steps,
            "steps back of the clock that wrote the input: the run's time goes on from there",
        ),
        (
            report.map.map_forgotten_tiles,
            "tiles of the map were forgotten because its memory was full: --map-memory gives it more",
        ),
        (report.losses.not_understood, "intact telegrams were not understood: NOT KEPT"),
        (
            report.losses.reads_without_laser,
            "reads of a vertical laser, but the rig has no section [vertical]: NOT KEPT",
        ),
        (
            report.losses.scans_without_laser,
            "vertical scans, but the rig has no section [vertical]: LEFT OUT",
        ),
        (report.losses.dropped, "messages or reads were dropped by a full queue: NOT KEPT"),
    ];
    for (count, what) in remarks.into_iter().filter(|(count, _)| *count > 0) {
        text += &format!("\n  {count} {what}");
    }
    if report.map.map_filled_percent >= 90 && report.map.map_forgotten_tiles == 0 {
        let percent = report.map.map_filled_percent;
        text += &format!("\n  {percent} % of the map's memory are in use: --map-memory gives it more");
    }
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
        RunEnd::DiskLow => text += "\n  ended before the disk was full: CUT SHORT",
        RunEnd::Interrupted => text += "\n  stopped before the input was over: the rest was NOT KEPT",
        RunEnd::Stopped if report.recorded.scans_horizontal == 0 => {
            text += "\n  stopped before the first horizontal scan: the file is kept, and holds no pose";
        }
        RunEnd::InputOver | RunEnd::DurationOver | RunEnd::Stopped | RunEnd::WriteFailed => {}
    }
    text
}
