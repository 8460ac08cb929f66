//! Measurements of another recording, which come decoded and with their stamps instead of as bytes; and what
//! no line brings.

use biplane_recording::Port;

use crate::engine::line::Meter;
use crate::engine::out::health::LineHealth;
use crate::types::run_report::RunReport;

/// Counts what comes without a line of the rig.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct WithoutLine {
    /// Decoded scans, odometry and samples of an inertial unit.
    meters: [Meter; Port::ALL.len()],
    /// Reads of a laser's or a base's line that the rig does not have.
    unknown_reads: u64,
    /// Reads of an inertial unit's line that the rig does not have.
    unknown_inertial_reads: u64,
    /// Decoded scans of a laser that the rig does not have.
    pub(crate) unknown_scans: u64,
}

impl WithoutLine {
    /// A measurement came decoded, with this stamp.
    pub(crate) fn count(&mut self, port: Port, now_ns: i64, stamp_ns: i64) {
        self.meters[port.index()].count(now_ns, stamp_ns);
    }

    /// A read came of a line that the rig does not have.
    pub(crate) fn unknown_read(&mut self, port: Port) {
        match port {
            Port::Imu => self.unknown_inertial_reads += 1,
            Port::Horizontal | Port::Vertical | Port::Base => self.unknown_reads += 1,
        }
    }

    /// From a device's first decoded measurement to its last, nanoseconds.
    pub(crate) fn span_ns(&self, port: Port) -> Option<(i64, i64)> {
        self.meters[port.index()].span_ns()
    }

    /// Adds what came without a line.
    pub(crate) fn account(&self, report: &mut RunReport) {
        let [horizontal, vertical, base, imu] = self.meters.map(|meter| meter.measurements);
        report.recorded.scans_horizontal += horizontal;
        report.recorded.scans_vertical += vertical;
        report.recorded.odometry += base;
        report.recorded.inertial += imu;
        report.losses.reads_without_imu = self.unknown_inertial_reads;
        report.losses.reads_without_laser = self.unknown_reads;
        report.losses.scans_without_laser = self.unknown_scans;
    }

    /// Stamps of scans that stepped back; the odometry of an import often has the stamps of its scans.
    pub(crate) fn backward_stamps(&self) -> u64 {
        let [horizontal, vertical, ..] = self.meters.map(|meter| meter.backward_stamps);
        horizontal + vertical
    }

    /// The states of the last interval, in the order of [`Port::ALL`]; the next one begins.
    pub(crate) fn health(&mut self, interval_s: f64) -> [LineHealth; Port::ALL.len()] {
        self.meters.each_mut().map(|meter| meter.health(interval_s))
    }
}

/// A line's state with that of decoded measurements, which come instead of bytes.
pub(crate) fn with_decoded(line: LineHealth, decoded: &LineHealth) -> LineHealth {
    if decoded.measurements == 0 {
        return line;
    }
    LineHealth { streaming: true, counts: None, baud: line.baud, mounting: line.mounting, ..*decoded }
}
