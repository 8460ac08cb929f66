//! The account of a run in words or as JSON.

use crate::report::RunReport;

/// JSON on stdout, or a few lines on stderr.
pub fn print(report: &RunReport, json: bool) {
    if json {
        match serde_json::to_string_pretty(report) {
            Ok(text) => super::print_result(&(text + "\n")),
            Err(error) => eprintln!("biplane-onboard: the report cannot be written as JSON: {error}"),
        }
    } else {
        eprintln!("{}", text(report));
    }
}

fn text(report: &RunReport) -> String {
    let mut text = format!(
        "{}: {:.1} s, {} horizontal scans ({} posed, {} not matched), {} vertical scans ({} posed), {} odometry reports",
        report.output.display(),
        report.duration_s,
        report.scans_horizontal,
        report.poses,
        report.unmatched,
        report.scans_vertical,
        report.poses_vertical,
        report.odometry,
    );
    let remarks = [
        (report.damaged, "telegrams arrived damaged or cut"),
        (report.skipped_bytes, "bytes belong to no telegram"),
        (report.backward_stamps, "stamps step back"),
        (report.not_understood, "intact telegrams were not understood: NOT KEPT"),
        (
            report.reads_without_laser,
            "reads of a vertical laser, but the rig has no section [vertical]: NOT KEPT",
        ),
        (report.scans_without_laser, "vertical scans, but the rig has no section [vertical]: LEFT OUT"),
        (report.dropped, "messages or reads were dropped by a full queue: NOT KEPT"),
    ];
    for (count, what) in remarks.into_iter().filter(|(count, _)| *count > 0) {
        text += &format!("\n  {count} {what}");
    }
    text
}
