//! Scans as telegrams: which variant they were taken with, their value words, and when they are sent.

use super::busy_line::BusyLine;
use super::{EncodeError, EncodeOptions, EncodeReport};
use crate::devices::lms::scans::feed::STATUS_OK;
use crate::devices::telegrams;
use crate::line::{laser_byte_ns, transfer_ns};
use crate::rig::scanner::{BEYOND_RANGE, LARGEST_VALUE, NO_ECHO, READ_ERROR, Variant};
use crate::rig::simulated::{counts_mm, variant_of};
use crate::rig::source::ScanWords;
use biplane_recording::Topic;
use biplane_recording::messages::LaserScan;
use biplane_recording::rig::Laser;

/// A laser's scans on their line.
pub(crate) struct LaserLine {
    pub(crate) line: BusyLine,
    topic: Topic,
    /// The rig was given: scans must be as it says.
    fixed: bool,
    sent: u64,
}

impl LaserLine {
    pub(crate) fn new(options: &EncodeOptions, topic: Topic, fixed: bool, line: u64) -> Self {
        Self { line: BusyLine::new(options, line), topic, fixed, sent: 0 }
    }

    /// Sends a scan. The first one sets the laser's variant, unless the rig was given.
    pub(crate) fn send(
        &mut self,
        scan: &LaserScan,
        laser: &mut Laser,
        report: &mut EncodeReport,
    ) -> Result<(), EncodeError> {
        let variant = variant_of_scan(scan).ok_or_else(|| self.not_lms(scan, KNOWN.to_owned()))?;
        if self.sent == 0 && !self.fixed {
            laser.fov_deg = variant.fov_deg();
            laser.resolution_deg = f64::from(variant.resolution_cdeg()) / 100.0;
        }
        if variant_of(laser) != Some(variant) {
            let expected = format!("{} degrees in steps of {}", laser.fov_deg, laser.resolution_deg);
            return Err(self.not_lms(scan, expected));
        }
        let bytes = telegrams::scan(&words(scan, variant, laser, report), counts_mm(laser), STATUS_OK)?;
        let delay_ns = variant.duration_ns() + (laser.delay_ms * 1e6).round() as i64;
        let arrival_ns = |index| laser_byte_ns(index, laser.baud);
        let wait_ns =
            self.line.send(&bytes, scan.stamp_ns + delay_ns, transfer_ns(1, laser.baud), arrival_ns);
        self.line.count(scan.stamp_ns, wait_ns, report);
        self.sent += 1;
        Ok(())
    }

    fn not_lms(&self, scan: &LaserScan, expected: String) -> EncodeError {
        EncodeError::OtherLaser {
            laser: "LMS 2xx",
            topic: self.topic.name(),
            number: self.sent,
            beams: scan.ranges_m.len(),
            first_deg: f64::from(scan.angle_min_rad).to_degrees(),
            step_deg: f64::from(scan.angle_increment_rad).to_degrees(),
            expected,
        }
    }
}

const KNOWN: &str =
    "180 degrees in steps of 0.5 or 1, 100 degrees in steps of 0.25, 0.5 or 1, or 90 degrees in steps of 0.5";

/// The variant that a scan was taken with. The last beam may be missing: CARMEN logs hold 180 beams of 181.
#[must_use]
pub(crate) fn variant_of_scan(scan: &LaserScan) -> Option<Variant> {
    let step_deg = f64::from(scan.angle_increment_rad).to_degrees();
    let first_deg = f64::from(scan.angle_min_rad).to_degrees();
    [(180, 100), (180, 50), (100, 100), (100, 50), (100, 25), (90, 50)]
        .into_iter()
        .filter_map(|(fov_deg, resolution_cdeg)| Variant::new(fov_deg, resolution_cdeg))
        .find(|variant| {
            let own_step = f64::from(variant.resolution_cdeg()) / 100.0;
            let full = usize::from(variant.beam_count());
            (scan.ranges_m.len() == full || scan.ranges_m.len() + 1 == full)
                && (step_deg - own_step).abs() < 0.01 * own_step
                && (first_deg + 0.5 * f64::from(variant.fov_deg())).abs() < 0.5 * own_step
        })
}

/// Value words; a missing last beam has no echo.
fn words(scan: &LaserScan, variant: Variant, laser: &Laser, report: &mut EncodeReport) -> ScanWords {
    let mut words: ScanWords = ScanWords::new();
    for range_m in scan.ranges_m.iter().take(usize::from(variant.beam_count())) {
        let steps = (f64::from(*range_m) / laser.units.meters()).round();
        let word = if *range_m == f32::INFINITY {
            NO_ECHO
        } else if steps > f64::from(LARGEST_VALUE) {
            report.beyond_range += 1;
            BEYOND_RANGE
        } else if steps >= 0.0 {
            steps as u16
        } else {
            READ_ERROR
        };
        // At most as many as the variant has beams, and those fit.
        let _ = words.push(word);
    }
    while words.len() < usize::from(variant.beam_count()) && words.push(NO_ECHO).is_ok() {}
    words
}
