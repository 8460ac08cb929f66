//! What an engine tells of itself: the state once a second, and the account at the end.

use biplane_recording::Port;
use biplane_wire::Counts;

use crate::engine::line::decoded::WithoutLine;
use crate::engine::line::devices::Devices;
use crate::engine::line::inertial_line::InertialLine;
use crate::engine::line::laser_device::LaserDevice;
use crate::engine::line::lines::Lines;
use crate::engine::localize::posing::Posing;
use crate::engine::mount_check::news::News;
use crate::engine::out::health::{Health, LineHealth};
use crate::session::event::Event;
use crate::types::device_name::device_name;
use crate::types::run_report::RunReport;
use crate::types::uncovered::Uncovered;

/// Stamps of scans that stepped back.
fn backward_stamps(lines: &Lines, without_line: &WithoutLine) -> u64 {
    lines.backward_stamps() + without_line.backward_stamps()
}

/// The state of all lines and of the matcher; what has begun or ended since the last one is said. What the
/// sink lost is not in it.
pub(crate) fn state(
    devices: &mut Devices,
    posing: &mut Posing,
    without_line: &mut WithoutLine,
    interval_s: f64,
) -> Health {
    let lasers = [Port::Horizontal, Port::Vertical].map(|port| (port, devices.state(port, interval_s)));
    while let Some(News { port, mount_fault, begins }) = posing.mounting.news() {
        devices.event(port, Event::Mounting { mount_fault, begins });
    }
    let [base, imu] = [Port::Base, Port::Imu].map(|port| devices.state(port, interval_s));
    let decoded = without_line.health(interval_s);
    let [horizontal, vertical] = lasers.map(|(port, line)| {
        let mounting = Some(posing.mounting.mounting(port));
        line.map(|line| LineHealth { mounting, ..line })
    });
    Health {
        horizontal: devices.reported(Port::Horizontal, horizontal, &decoded[0]),
        vertical: devices.reported(Port::Vertical, vertical, &decoded[1]),
        base: devices.reported(Port::Base, base, &decoded[2]),
        imu: devices.reported(Port::Imu, imu, &decoded[3]),
        inertial: devices.lines.imu.as_ref().map(|unit| *unit.line.session.health()),
        matcher: posing.health(),
        dropped: devices.dropped(),
        unreported: devices.outbox.unreported,
        backward_stamps: backward_stamps(&devices.lines, without_line),
        ..Health::default()
    }
}

/// The account so far. What the sink lost is not in it.
pub(crate) fn account(devices: &Devices, posing: &mut Posing, without_line: &WithoutLine) -> RunReport {
    let mut report = RunReport::default();
    report.arrival.backward_stamps = backward_stamps(&devices.lines, without_line);
    report.losses.dropped = devices.dropped();
    report.losses.unreported = devices.outbox.unreported;
    posing.account(&mut report);
    without_line.account(&mut report);
    add_lines(&devices.lines, &mut report);
    report.uncovered = uncovered(&devices.lines, without_line);
    let losses = &mut report.losses;
    losses.lost = losses.dropped
        + losses.not_understood
        + losses.reads_without_laser
        + losses.reads_without_imu
        + losses.scans_without_laser;
    report
}

/// Devices that were there for a part of the run only.
fn uncovered(lines: &Lines, without_line: &WithoutLine) -> Vec<Uncovered> {
    let span = |port: Port| {
        let (line, decoded) = (lines.span_ns(port), without_line.span_ns(port));
        let both = line.zip(decoded).map(|(a, b)| (a.0.min(b.0), a.1.max(b.1)));
        Some((device_name(port), both.or(line).or(decoded)?))
    };
    let spans: Vec<_> = Port::ALL.into_iter().filter_map(span).collect();
    Uncovered::of(&spans)
}

/// Adds what the lines have brought, and what not.
fn add_lines(lines: &Lines, report: &mut RunReport) {
    report.recorded.scans_horizontal += lines.horizontal.line.meter.measurements;
    report.recorded.scans_vertical +=
        lines.vertical.as_ref().map_or(0, |laser| laser.line.meter.measurements);
    report.recorded.odometry += lines.base.meter.measurements;
    report.mounting.odd_interval_ms_horizontal = lines.horizontal.odd_interval_ms();
    report.mounting.odd_interval_ms_vertical =
        lines.vertical.as_ref().and_then(|laser| laser.odd_interval_ms());
    for laser in lines.lasers() {
        add_laser(&laser.session, report);
        report.losses.not_understood += laser.session.not_kept();
    }
    report.losses.not_understood += lines.base.session.not_kept();
    if let Some(unit) = &lines.imu {
        add_inertial(unit, report);
    }
    for counts in Port::ALL.into_iter().filter_map(|port| lines.counts(port)) {
        add_counts(counts, report);
    }
    report.arrival.damaged = report.arrival.damaged.saturating_sub(report.arrival.cut_by_us);
    let confirmed_bytes: u64 = lines.lasers().map(|laser| laser.session.health().confirmed_bytes).sum();
    report.arrival.skipped_bytes =
        report.arrival.skipped_bytes.saturating_sub(report.arrival.cut_by_us_bytes + confirmed_bytes);
}

fn add_counts(counts: Counts, report: &mut RunReport) {
    report.arrival.damaged += counts.bad_checksums + counts.bad_lengths + counts.abandoned;
    report.arrival.skipped_bytes += counts.skipped_bytes;
}

fn add_inertial(unit: &InertialLine, report: &mut RunReport) {
    let health = unit.line.session.health();
    report.recorded.inertial += unit.line.meter.measurements;
    report.losses.not_understood += unit.line.session.not_kept();
    report.arrival.damaged += health.rejected;
    report.arrival.rejected += health.rejected;
    report.arrival.lost_samples += health.missing;
}

fn add_laser(session: &LaserDevice, report: &mut RunReport) {
    let (laser, cuts) = (session.health(), session.truncated());
    report.arrival.cut_by_us += cuts.telegrams;
    report.arrival.cut_by_us_bytes += cuts.bytes;
    report.arrival.damaged += laser.rejected;
    report.arrival.rejected += laser.rejected;
    report.arrival.lost_telegrams += laser.lost_telegrams;
    report.arrival.left_out_scans += laser.left_out_scans;
    report.arrival.dazzled_values += laser.dazzled_values;
    report.arrival.polluted_scans += laser.polluted_scans;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::synthetic::{Read, START_NS, drive};
    use crate::engine::tests::run;

    const MS: i64 = 1_000_000;

    #[test]
    fn a_laser_that_starts_late_is_in_the_account_of_the_run() {
        let late_ns = START_NS + 5_000 * MS;
        let is_there = |read: &Read| read.port != Port::Vertical || read.time_ns >= late_ns;
        let reads: Vec<_> = drive(10, 60).into_iter().filter(is_there).collect();
        let (report, _) = run(&reads);
        let [late] = &report.uncovered[..] else { panic!("{:?}", report.uncovered) };
        assert_eq!(late.device, "vertical laser");
        assert!((4.0..5.5).contains(&late.at_start_s), "{late:?}");
        assert_eq!(report.exit_code(), 0);
        assert!(run(&drive(5, 60)).0.uncovered.is_empty());
    }
}
