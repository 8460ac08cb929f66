//! What an engine tells of itself: the state once a second, and the account at the end.

use biplane_recording::Port;

use super::{Engine, HEALTH_NS};
use crate::health::{Health, LineHealth};
use crate::report::RunReport;
use crate::session::Session;
use crate::session::laser::LaserSession;
use crate::sink::Sink;

impl<S: Sink> Engine<S> {
    /// Publishes the state; the next is due an interval later.
    pub(super) fn health(&mut self, now_ns: i64) {
        let interval_s = now_ns.saturating_sub(self.last_health_ns) as f64 * 1e-9;
        let health = self.state(interval_s);
        self.last_health_ns = now_ns;
        self.health_ns = now_ns.saturating_add(HEALTH_NS);
        self.publisher.health(now_ns, &health);
    }

    /// The state at the end, unless one was told a moment ago: rates of a short interval say nothing.
    pub(super) fn last_health(&mut self, now_ns: i64) {
        if now_ns.saturating_sub(self.last_health_ns) >= HEALTH_NS / 2 || self.last_health_ns == self.first_ns
        {
            self.health(now_ns);
        }
    }

    fn state(&mut self, interval_s: f64) -> Health {
        let streaming = self.horizontal.line.session.is_streaming();
        let mut horizontal = self.horizontal.line.health(interval_s, streaming);
        horizontal.laser = Some(*self.horizontal.line.session.health());
        let vertical = self.vertical.as_mut().map(|vertical| {
            let streaming = vertical.line.session.is_streaming();
            let laser = Some(*vertical.line.session.health());
            LineHealth { laser, ..vertical.line.health(interval_s, streaming) }
        });
        let horizontal = self.with_damage(Port::Horizontal, horizontal);
        let vertical = vertical.map(|line| self.with_damage(Port::Vertical, line));
        self.tell_mounting();
        let horizontal = self.with_mounting(Port::Horizontal, horizontal);
        let vertical = vertical.map(|line| self.with_mounting(Port::Vertical, line));
        let streaming = self.base.session.is_streaming();
        let base = self.base.health(interval_s, streaming);
        let base = self.with_damage(Port::Base, base);
        let decoded = self.decoded.each_mut().map(|meter| meter.health(interval_s));
        let mut matcher = self.localiser.health();
        matcher.waiting_vertical = self.waiting_verticals.len();
        Health {
            horizontal: self.faults.told(Port::Horizontal, with_decoded(horizontal, &decoded[0])),
            vertical: vertical
                .map(|line| self.faults.told(Port::Vertical, with_decoded(line, &decoded[1])))
                .unwrap_or_default(),
            base: self.faults.told(Port::Base, with_decoded(base, &decoded[2])),
            matcher,
            dropped: self.dropped(),
            untold: self.untold(),
            backward_stamps: self.backward_stamps(),
            clock_steps: self.time_line.steps(),
        }
    }

    /// What any full queue has dropped on the way from the reads to the file, or to the devices.
    fn dropped(&mut self) -> u64 {
        let vertical = self.vertical.as_ref().map_or(0, |vertical| vertical.line.session.overflowed());
        let sessions = self.horizontal.line.session.overflowed() + vertical + self.base.session.overflowed();
        self.publisher.sink().dropped() + self.commands_dropped + sessions
    }

    /// What was not said because nobody took it in time.
    fn untold(&mut self) -> u64 {
        self.publisher.sink().untold() + self.untold
    }

    /// Of scans; the odometry of an import often has the stamps of its scans.
    fn backward_stamps(&self) -> u64 {
        let vertical = self.vertical.as_ref().map_or(0, |vertical| vertical.line.meter.backward_stamps);
        let [horizontal_decoded, vertical_decoded, _] = self.decoded.map(|meter| meter.backward_stamps);
        self.horizontal.line.meter.backward_stamps + vertical + horizontal_decoded + vertical_decoded
    }

    /// The account so far.
    pub(super) fn report(&mut self) -> RunReport {
        let matcher = self.localiser.health();
        let mut report = RunReport {
            duration_s: (self.now_ns - self.first_ns) as f64 * 1e-9,
            poses: matcher.poses,
            unmatched: matcher.unmatched,
            poses_vertical: self.poses_vertical,
            backward_stamps: self.backward_stamps(),
            clock_steps: self.time_line.steps(),
            scans_horizontal: self.decoded[0].measurements,
            scans_vertical: self.decoded[1].measurements,
            odometry: self.decoded[2].measurements,
            dropped: self.dropped(),
            untold: self.untold(),
            reads_without_laser: self.unknown_reads,
            scans_without_laser: self.unknown_scans,
            mounting_horizontal: self.mounting.mounting(Port::Horizontal).words(),
            mounting_vertical: self.vertical.as_ref().map(|_| self.mounting.mounting(Port::Vertical).words()),
            ..RunReport::default()
        };
        for port in Port::ALL {
            self.add_line(port, &mut report);
        }
        report.damaged = report.damaged.saturating_sub(report.cut_by_us);
        report.skipped_bytes = report.skipped_bytes.saturating_sub(report.cut_by_us_bytes);
        report.lost =
            report.dropped + report.not_understood + report.reads_without_laser + report.scans_without_laser;
        report
    }

    fn add_line(&self, port: Port, report: &mut RunReport) {
        let (counts, not_kept) = match (port, &self.vertical) {
            (Port::Horizontal, _) => {
                let line = &self.horizontal.line;
                report.scans_horizontal += line.meter.measurements;
                add_laser(&line.session, report);
                (line.session.counts(), line.session.not_kept())
            }
            (Port::Vertical, Some(vertical)) => {
                let line = &vertical.line;
                report.scans_vertical += line.meter.measurements;
                add_laser(&line.session, report);
                (line.session.counts(), line.session.not_kept())
            }
            (Port::Vertical, None) => return,
            (Port::Base, _) => {
                report.odometry += self.base.meter.measurements;
                (self.base.session.counts(), self.base.session.not_kept())
            }
        };
        report.damaged += counts.bad_checksums + counts.bad_lengths + counts.abandoned;
        report.skipped_bytes += counts.skipped_bytes;
        report.not_understood += not_kept;
    }
}

fn add_laser(session: &LaserSession, report: &mut RunReport) {
    let (laser, cuts) = (session.health(), session.cuts());
    report.cut_by_us += cuts.telegrams;
    report.cut_by_us_bytes += cuts.bytes;
    report.damaged += laser.rejected;
    report.rejected += laser.rejected;
    report.lost_telegrams += laser.lost_telegrams;
    report.left_out_scans += laser.left_out_scans;
    report.dazzled_values += laser.dazzled_values;
    report.polluted_scans += laser.polluted_scans;
}

/// A line's state with that of decoded measurements, which come instead of bytes.
fn with_decoded(line: LineHealth, decoded: &LineHealth) -> LineHealth {
    if decoded.measurements == 0 {
        return line;
    }
    LineHealth { streaming: true, counts: None, baud: line.baud, mounting: line.mounting, ..*decoded }
}
